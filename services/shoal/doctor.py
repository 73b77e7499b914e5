"""Is everything there that Shoal needs? Each check says what is wrong and what would mend it."""

from __future__ import annotations

import platform
import socket
import sys
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version

from shoal.errors import ShoalError
from shoal.home import home, kernel_cache


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
        *(_engine(name) for name in ("exudyn", "casadi")),
        *(_package(name) for name in ("prefect", "mlflow")),
        _port(5000),
    ]


def _python() -> Check:
    suits = (3, 11) <= sys.version_info[:2] <= (3, 12)
    return Check("Python", suits, platform.python_version(), "" if suits else "use Python 3.11 or 3.12")


def _folder() -> Check:
    try:
        return Check("state folder", True, str(home()))
    except ShoalError as error:
        return Check("state folder", False, "not writable", str(error))


def _native() -> Check:
    """The headline scene on our own solver, against the figure that CasADi and Exudyn agree on."""
    from shoal.engines import get_engine
    from shoal.scene import load_scene

    compiled = any(kernel_cache().rglob("*.nbi"))
    trajectory = get_engine("gauss").simulate(load_scene("flexible-double-pendulum"))
    gap = abs(float(trajectory.marker("B")[-1, 0]) - 2.676161)
    right = trajectory.ok and gap < 1e-5
    found = f"right within {gap:.0e} m; kernels {'were' if compiled else 'now'} compiled"
    return Check("native solver", right, found, "" if right else "remove the folder .shoal/kernels-* and try again")


def _engine(name: str) -> Check:
    check = _package(name)
    if not check.ok:
        return check
    try:
        import_module(name)
    except ImportError as error:
        return Check(name, False, f"{check.found} does not load: {error}", "reinstall it: make setup")
    return check


def _package(name: str) -> Check:
    try:
        return Check(name, True, version(name))
    except PackageNotFoundError:
        return Check(name, False, "not installed", "run: make setup")


def _port(number: int) -> Check:
    with socket.socket() as probe:
        taken = probe.connect_ex(("127.0.0.1", number)) == 0
    return Check(f"port {number}", True, "in use; shoal ui --port takes another" if taken else "free for shoal ui")
