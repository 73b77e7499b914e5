"""Is everything there that Shoal needs? Each check says what is wrong and what would mend it."""

from __future__ import annotations

import json
import os
import platform
import socket
import sqlite3
import sys
from collections.abc import Mapping
from contextlib import closing
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any
from urllib.error import HTTPError, URLError
from urllib.request import Request, urlopen

import numpy as np

from shoal.csrf import csrf_headers
from shoal.errors import InputError, ShoalError
from shoal.home import compiled, home, kernel_cache, origin, unused_home
from shoal.ports import PORTS, port, setting_of

_PACKAGES = {
    "pipeline": ("prefect", "mlflow"),
    "services": ("fastapi", "uvicorn", "orjson"),
    "sample": ("emcee",),
}
"""What the extras bring that has no check of its own."""
_PORTS = {"MLflow": 5000, "Prefect": 4200, **PORTS}
"""Where `make up`, `shoal ui` and `shoal serve` listen unless $SHOAL_NAME_PORT or an option says otherwise."""
PATIENCE = 3.0
"""Seconds that a server has to answer."""
CLOSE = 1e-4
"""Distance [m] from the native solver within which an engine is right on the pendulum."""


@dataclass(frozen=True)
class Check:
    """One thing looked at. advice: what to do when it is not ok."""

    name: str
    ok: bool
    found: str
    advice: str = ""


def examine() -> list[Check]:
    """All checks, in the order a newcomer needs them."""
    return [
        _python(),
        _folder(),
        _native(),
        _cache(),
        *(check_engine(name) for name in ("exudyn", "casadi")),
        *(check_package(name, extra) for extra, names in _PACKAGES.items() for name in names),
        check_server("Prefect", "PREFECT_API_URL", "a flow starts its own"),
        check_server("MLflow", "MLFLOW_TRACKING_URI", "runs go to a database in the state folder"),
        *check_runs(os.environ.get("MLFLOW_TRACKING_URI")),
        *check_ports(),
    ]


def _python() -> Check:
    suits = (3, 11) <= sys.version_info[:2] <= (3, 12)
    return Check("Python", suits, platform.python_version(), "" if suits else "use Python 3.11 or 3.12")


def _folder() -> Check:
    try:
        return Check("state folder", True, f"{home()} ({origin()})", unused_home())
    except ShoalError as error:
        return Check("state folder", False, "not writable", str(error))


def _native() -> Check:
    """The headline scene on our own solver, against the figure that CasADi and Exudyn agree on."""
    from shoal.engines import get_engine
    from shoal.scene import load_scene

    known = compiled()
    trajectory = get_engine("gauss").simulate(load_scene("flexible-double-pendulum"))
    gap = abs(float(trajectory.marker("B")[-1, 0]) - 2.676161)
    right = trajectory.ok and gap < 1e-5
    found = f"right within {gap:.0e} m; kernels {'were' if known else 'now'} compiled"
    return Check("native solver", right, found, "" if right else f"remove the folder {kernel_cache()} and try again")


def _cache() -> Check:
    """The compiled kernels, and folders of versions that kept them elsewhere."""
    current = kernel_cache()
    size = sum(file.stat().st_size for file in current.rglob("*") if file.is_file())
    others = len(list(current.parent.glob("kernels-*")))
    older = f"; {others} older folders beside it, kernels-*, may be removed" if others else ""
    return Check("compile cache", True, f"{current}, {size / 1e6:.0f} MB{older}")


def check_engine(name: str, close: float = CLOSE) -> Check:
    """Another engine on the pendulum, against our own."""
    check = check_package(name, "engines")
    if not check.ok:
        return check
    from shoal.engines import get_engine
    from shoal.scene import load_scene

    scene = load_scene("single-pendulum")
    try:
        run = get_engine(name).simulate(scene, [0.5])
        gap = float(np.max(np.abs(run.points - get_engine("gauss").simulate(scene, [0.5]).points)))
    except (ImportError, ShoalError) as error:
        return Check(name, False, f"{check.found} does not run: {error}", "reinstall it: make setup")
    if not gap < close:
        return Check(name, False, f"{check.found} is {gap:.0e} m off a pendulum", "reinstall it: make setup")
    return Check(name, True, f"{check.found}, right within {gap:.0e} m")


def check_package(name: str, extra: str) -> Check:
    """Return whether a package is there, and which extra brings it."""
    try:
        return Check(name, True, version(name))
    except PackageNotFoundError:
        return Check(name, False, "not installed", f"run make setup, or install shoal with its extra '{extra}'")


def check_server(name: str, variable: str, otherwise: str) -> Check:
    """Return whether a server that the user has named answers."""
    address = os.environ.get(variable, "")
    what = f"{name} server"
    if not address.startswith(("http://", "https://")):
        return Check(what, True, f"{variable} names none; {otherwise}")
    if _answers(f"{address.rstrip('/')}/health"):
        return Check(what, True, f"{address} answers")
    return Check(what, False, f"{address} does not answer", f"start it (make up), or unset {variable}")


def check_runs(address: str | None, patience: float = PATIENCE) -> list[Check]:
    """Return whether MLflow's database can be read, where runs go to one of SQLite that is there.

    address: of MLflow, None for the database of the state folder; patience: seconds that another program may hold it
    """
    try:
        path = Path((address or f"sqlite:///{home() / 'mlflow.db'}").removeprefix("sqlite:///").partition("?")[0])
    except ShoalError:
        return []  # told already
    if (address and not address.startswith("sqlite:///")) or not path.exists():
        return []
    what = "runs"
    try:
        with closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", patience, uri=True)) as database:
            database.execute("SELECT count(*) FROM sqlite_master").fetchone()
    except sqlite3.OperationalError as error:
        return [Check(what, False, f"{path}: {error}", "end the program that holds it, or look at who may read it")]
    except sqlite3.DatabaseError as error:
        return [Check(what, False, f"{path}: {error}", "move it away, and a new one is made; then: shoal upload")]
    return [Check(what, True, f"{path} can be read")]


def check_nights(address: str) -> Check:
    """Return whether the Prefect server there has the next night in its calendar: a schedule alone makes no run."""
    what, api = "nights", address.rstrip("/")
    if not _answers(f"{api}/health"):
        return Check(what, True, f"no Prefect server at {api}; none are scheduled")
    try:
        deployment = _asked(f"{api}/deployments/name/nightly/night")
        future = {
            "expected_start_time": {"after_": datetime.now(UTC).isoformat()},
            "state": {"type": {"any_": ["SCHEDULED"]}},
        }
        chosen = {"deployments": {"id": {"any_": [deployment["id"]]}}, "flow_runs": future}
        coming = _asked(
            f"{api}/flow_runs/filter",
            {**chosen, "sort": "EXPECTED_START_TIME_ASC"},
            csrf_headers(api, PATIENCE),
        )
    except HTTPError as error:
        if error.code == 404:
            return Check(what, False, f"{api} has no deployment nightly/night", "state it: make up")
        return Check(what, False, f"{api} does not tell: HTTP status {error.code}", "look at the server's output")
    except (URLError, OSError, ValueError):
        return Check(what, False, f"{api} does not tell", "look at the server's output")
    if deployment["paused"] or not any(schedule["active"] for schedule in deployment["schedules"]):
        return Check(what, False, "the schedule of nightly/night is off", "switch it on, on Prefect's pages")
    if not coming:
        advice = (
            "wait a minute after make up; then look at the server's output for what ends its scheduler (make setup)"
        )
        return Check(what, False, f"{api} has a schedule and no scheduled night", advice)
    idle = "; no worker takes it: make up ARGS='--with nightly'" if deployment["status"] != "READY" else ""
    return Check(what, True, f"{len(coming)} scheduled, the next at {coming[0]['expected_start_time']}{idle}")


def _asked(url: str, data: object = None, headers: Mapping[str, str] | None = None) -> Any:
    """Return the answer of a server. Raises URLError, OSError, ValueError."""
    body = None if data is None else json.dumps(data).encode()
    with urlopen(
        Request(url, body, {"Content-Type": "application/json", **(headers or {})}), timeout=PATIENCE
    ) as answer:
        return json.load(answer)


def check_ports() -> list[Check]:
    """Check the ports of the servers of `make up`, and whether the nightly run is scheduled."""
    numbers, wrong = {}, []
    for what, default in _PORTS.items():
        try:
            numbers[what] = port(what, default)
        except InputError as error:
            wrong.append(Check(f"port of {what}", False, str(error), f"correct {setting_of(what)}, or unset it"))
    address = os.environ.get("PREFECT_API_URL") or f"http://127.0.0.1:{numbers.get('Prefect', 4200)}/api"
    return [check_nights(address), *wrong, *(check_port(number, what) for what, number in numbers.items())]


def check_port(number: int, what: str, patience: float = PATIENCE) -> Check:
    """Check the port of `what`; patience: seconds to wait for an answer."""
    with socket.socket() as probe:
        probe.settimeout(patience)
        taken = probe.connect_ex(("127.0.0.1", number)) == 0
    if not taken:
        return Check(f"port {number}", True, f"free for {what}")
    path = "api/health" if what == "Prefect" else "health"
    healthy = _answers(f"http://127.0.0.1:{number}/{path}", patience)
    found = "a server answers there" if healthy else "another program has it; choose another with --port"
    return Check(f"port {number}", True, f"in use where {what} would be: {found}")


def _answers(url: str, patience: float = PATIENCE) -> bool:
    try:
        with urlopen(url, timeout=patience) as answer:  # an address that the user or this file names
            return bool(answer.status == 200)
    except (URLError, OSError, ValueError):
        return False
