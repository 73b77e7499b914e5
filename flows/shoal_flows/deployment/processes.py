"""The lines of the Procfile: which there are, when each starts, and how it says that it is ready."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from urllib.error import URLError
from urllib.request import urlopen

from shoal.errors import InputError
from shoal.ports import check_free

FOLDER = Path(__file__).parents[3]
"""Where Procfile and prefect.yaml lie: the folder of a checkout."""

STAGES = (
    ("mlflow", "prefect", "dask-scheduler"),
    ("gauss", "exudyn", "casadi", "dask-worker"),
    ("worker", "nightly"),
)
"""Started in this order and stopped in the reverse one: a worker of Prefect that is told to end together with its
server waits for it for ever. When all are ready, `deploy` runs to its end."""

PROFILES: Mapping[str, tuple[str, ...]] = {"nightly": ("nightly",), "scale": ("dask-scheduler", "dask-worker")}
"""What runs only if asked for; the compose file has the same profiles."""

_READY = {
    "mlflow": ("SHOAL_MLFLOW_PORT", 5000, "/health"),
    "prefect": ("SHOAL_PREFECT_PORT", 4200, "/api/ready"),
    "worker": ("SHOAL_WORKER_PORT", 8080, "/health"),
    "nightly": ("SHOAL_NIGHTLY_PORT", 8081, "/health"),
    "gauss": ("SHOAL_GAUSS_PORT", 8001, "/ready"),
    "exudyn": ("SHOAL_EXUDYN_PORT", 8002, "/ready"),
    "casadi": ("SHOAL_CASADI_PORT", 8003, "/ready"),
    "dask-scheduler": ("SHOAL_DASK_PAGES_PORT", 8787, "/health"),
    "dask-worker": ("SHOAL_DASK_WORKER_PORT", 8788, "/health"),
}
"""Setting of the port, its default, and the path that answers when the process is ready."""


def chosen(profiles: Sequence[str]) -> list[tuple[str, ...]]:
    """The stages with what runs under these profiles. Raises InputError."""
    if unknown := [profile for profile in profiles if profile not in PROFILES]:
        raise InputError(f"--with: no profile {unknown[0]!r}; there are {', '.join(PROFILES)}")
    left_out = {name for profile, names in PROFILES.items() if profile not in profiles for name in names}
    return [tuple(name for name in stage if name not in left_out) for stage in STAGES]


def port(name: str) -> int:
    """The port on which a process answers. Raises InputError."""
    setting, default, _ = _READY[name]
    text = os.environ.get(setting) or str(default)
    if not (text.isdigit() and 0 < int(text) < 65536):
        raise InputError(f"{setting}: {text!r} is not a port between 1 and 65535")
    return int(text)


def check_port(name: str) -> None:
    """Raises InputError if a process cannot listen on its port."""
    check_free("127.0.0.1", port(name), _READY[name][0])


def is_ready(name: str) -> bool:
    """Whether a process answers that it can do its work."""
    try:
        with urlopen(f"http://127.0.0.1:{port(name)}{_READY[name][2]}", timeout=5) as answer:
            return bool(answer.status == 200)
    except (URLError, OSError):
        return False
