"""Tests share the compiled kernels and nothing else with the user's state."""

from __future__ import annotations

import gc
import os
import tempfile
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import settings
from numba.core import event
from scipy.integrate import solve_ivp
from shoal.home import prepare_kernel_cache

# Before SHOAL_HOME moves: the kernels compiled ahead of the tests lie in the real home.
prepare_kernel_cache()
# Before tests are collected: the pipeline's modules look where the state is when they are imported. No test reads or
# writes the state of the user's own runs.
OWN_HOME = tempfile.TemporaryDirectory(prefix="shoal-home-", ignore_cleanup_errors=True)
os.environ["SHOAL_HOME"] = OWN_HOME.name
os.environ["MPLBACKEND"] = "Agg"
# While tests are collected, which some are once for every name: the user's own names are none of theirs.
os.environ["SHOAL_LIBRARY"] = os.path.join(os.devnull, "none")

# What is collected stays until the end: looking for garbage among it costs a quarter of the collection.
gc.disable()

Array = Any

settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "repeatable"))


@pytest.hookimpl(tryfirst=True)  # before `slow` deselects
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Leave most cases of costly tests to the night; begin with what takes minutes, so that others run beside it."""
    cases: dict[tuple[Any, str], list[pytest.Item]] = {}
    for item in items:
        if item.get_closest_marker("by_day") and not item.get_closest_marker("slow"):
            cases.setdefault((item.path, getattr(item, "originalname", item.name)), []).append(item)
    for several in cases.values():
        (count,) = several[0].get_closest_marker("by_day").args
        by_day = set(np.linspace(0, len(several) - 1, count).round().astype(int).tolist())
        for number, item in enumerate(several):
            if number not in by_day:
                item.add_marker(pytest.mark.slow)
    items.sort(key=lambda item: (item.path.name != "test_up.py", "pictures" not in item.path.parts))


TOGETHER = {
    "pictures": ("tests/pictures/",),
    "fits": tuple(f"tests/flows/test_{name}.py" for name in ("jobs", "models", "remembered", "report", "tracking")),
}
"""Files that share costly session fixtures run in one process, as the tests of a file do."""


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    if config.getvalue("dist") != "loadfile":
        return None
    from xdist.scheduler import LoadFileScheduling

    class Scheduling(LoadFileScheduling):
        def _split_scope(self, nodeid: str) -> str:
            found = (name for name, begins in TOGETHER.items() if nodeid.startswith(begins))
            return next(found, super()._split_scope(nodeid))

    return Scheduling(config, log)


class Compiled(event.Listener):
    """Names of kernels of the library that were not in the cache, the outermost of each compilation."""

    def __init__(self) -> None:
        self.names: list[str] = []
        self._depth = 0

    def on_start(self, event: Any) -> None:
        function = event.data["dispatcher"].py_func
        if self._depth == 0 and function.__module__.startswith("shoal."):
            self.names.append(f"{function.__module__}.{function.__qualname__}")
        self._depth += 1

    def on_end(self, event: Any) -> None:
        self._depth -= 1


COMPILED = Compiled()
event.register("numba:compile", COMPILED)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--kernels-known", action="store_true", help="a test fails that compiles a kernel unannounced")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Iterator[None]:
    """Kernels that `make kernels` does not know are named: a fast test is to use others, or to be marked `compiles`."""
    report: Any = yield
    if COMPILED.names and not any(map(item.get_closest_marker, ("compiles", "slow"))):
        report.user_properties.append(("compiled", sorted(set(COMPILED.names))))
        if item.config.getoption("kernels_known") and report.passed:
            report.outcome = "failed"
            report.longrepr = f"compiles {', '.join(COMPILED.names)}, which `make kernels` does not know"
    COMPILED.names.clear()
    return report


def pytest_terminal_summary(terminalreporter: Any) -> None:
    reports = [one for kind in ("", "passed", "failed") for one in terminalreporter.stats.get(kind, [])]
    found = {one.nodeid: names for one in reports for key, names in one.user_properties if key == "compiled"}
    if found:
        terminalreporter.section("fast tests that compiled kernels which `make kernels` does not know")
        for nodeid, names in sorted(found.items()):
            terminalreporter.line(f"{nodeid}: {', '.join(names)}")


def pytest_collection_finish() -> None:
    gc.freeze()
    gc.enable()


def pytest_unconfigure() -> None:
    OWN_HOME.cleanup()


@pytest.fixture(autouse=True, scope="session")
def own_library() -> None:
    """What is collected runs with the library of its own home."""
    os.environ.pop("SHOAL_LIBRARY", None)


@pytest.fixture(scope="session")
def uniform_rods() -> Callable[..., Any]:
    """Motion of planar uniform rods in absolute angles, integrated by scipy; shares nothing with the package.

    centre[k, j] says how far [m] the centre of rod k lies along rod j, so that r_k = sum_j centre[k, j] e_j
    (from a fixed point), and the virtual work of m r'' = m g gives the textbook equations. friction[k, j] is the
    torque matrix, tau = -friction omega; closure[j]: sum_j closure[j] e_j = const, by multipliers.
    Returns angles and rates, each (rods, times).
    """

    def motion(
        masses: Array,
        inertias: Array,
        centre: Array,
        angles: Array,
        rates: Array,
        times: Array,
        *,
        friction: Array | None = None,
        closure: Array | None = None,
        gravity: complex = -9.81j,
    ) -> tuple[Array, Array]:
        masses, centre = np.asarray(masses, dtype=float), np.asarray(centre, dtype=float)
        count = len(angles)

        def rate(_time: float, y: Array) -> Array:
            angle, omega = y[:count], y[count:]
            e = np.exp(1j * angle)
            levers = 1j * centre * e  # d r_k / d angle_j
            matrix = np.diag(np.asarray(inertias, dtype=float)) + np.real(
                np.einsum("kj,k,ki->ji", np.conj(levers), masses, levers)
            )
            swing = -(centre * e) @ omega**2
            load = np.real(np.conj(levers).T @ (masses * (gravity - swing)))
            if friction is not None:
                load = load - friction @ omega
            if closure is not None:
                gap = np.asarray(closure) * e
                rows = np.array([np.real(1j * gap), np.imag(1j * gap)])
                pull = gap @ omega**2
                full = np.block([[matrix, rows.T], [rows, np.zeros((2, 2))]])
                change = np.linalg.solve(full, np.concatenate([load, [np.real(pull), np.imag(pull)]]))[:count]
            else:
                change = np.linalg.solve(matrix, load)
            return np.concatenate([omega, change])

        start = np.concatenate([angles, rates])
        run = solve_ivp(rate, (0.0, times[-1]), start, "DOP853", times, rtol=1e-13, atol=1e-13)
        assert run.success
        return run.y[:count], run.y[count:]

    return motion
