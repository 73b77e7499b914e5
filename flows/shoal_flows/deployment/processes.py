"""The lines of the Procfile: which there are, when each starts, and how it says that it is ready."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from urllib.error import URLError
from urllib.request import urlopen

from shoal import ports
from shoal.errors import InputError

FOLDER = Path(__file__).parents[3]
"""Where Procfile and prefect.yaml lie: the folder of a checkout."""

STAGES = (
    ("mlflow", "prefect", "dask-scheduler"),
    ("gauss", "exudyn", "casadi", "dask-worker"),
    ("worker", "nightly"),
)
"""Started in this order and stopped in the reverse one: a worker of Prefect that is told to end together with its
server waits for it for ever. When all are ready, `deploy` runs to its end."""

NEEDS: Mapping[str, tuple[str, ...]] = {
    **dict.fromkeys(("mlflow", "prefect"), ("postgres",)),
    **dict.fromkeys(("worker", "nightly"), ("prefect", "mlflow")),
    "dask-worker": ("dask-scheduler",),
}
"""What has to be ready before one that ended is started again; `postgres` is no line of the Procfile."""

PROFILES: Mapping[str, tuple[str, ...]] = {"nightly": ("nightly",), "scale": ("dask-scheduler", "dask-worker")}
"""What runs only if asked for; the compose file has the same profiles."""

_READY = {
    "mlflow": (5000, "/health"),
    "prefect": (4200, "/api/ready"),
    "worker": (8080, "/health"),
    "nightly": (8081, "/health"),
    "gauss": (8001, "/ready"),
    "exudyn": (8002, "/ready"),
    "casadi": (8003, "/ready"),
    "dask-scheduler": (8787, "/health"),
    "dask-worker": (8788, "/health"),
}
"""Default of the port, which $SHOAL_NAME_PORT chooses, and the path that answers when the process is ready."""
_PAGES = {"dask-scheduler": "dask-pages"}
"""Whose port for messages has the setting of its own name."""


def chosen(profiles: Sequence[str]) -> list[tuple[str, ...]]:
    """The stages with what runs under these profiles. Raises InputError."""
    if unknown := [profile for profile in profiles if profile not in PROFILES]:
        raise InputError(f"--with: no profile {unknown[0]!r}; there are {', '.join(PROFILES)}")
    left_out = {name for profile, names in PROFILES.items() if profile not in profiles for name in names}
    return [tuple(name for name in stage if name not in left_out) for stage in STAGES]


def port(name: str) -> int:
    """The port on which a process answers. Raises InputError."""
    return ports.port(_PAGES.get(name, name), _READY[name][0])


def check_port(name: str) -> None:
    """Raises InputError if a process cannot listen on its port."""
    ports.check_free("127.0.0.1", port(name), ports.setting_of(_PAGES.get(name, name)))


def is_ready(name: str) -> bool:
    """Return whether a process answers that it can do its work."""
    try:
        with urlopen(f"http://127.0.0.1:{port(name)}{_READY[name][1]}", timeout=5) as answer:
            return bool(answer.status == 200)
    except (URLError, OSError):
        return False
