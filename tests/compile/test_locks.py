"""Kernels are compiled once, whoever asks for them, ahead where that is wanted, and only those that a model calls."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numba import njit
from shoal.compile import locks, progress
from shoal.mechanics import warm
from shoal.mechanics.assembly.build import build
from shoal.mechanics.model import FunctionTable
from shoal.mechanics.numerics.tile import SINGLE
from shoal.mechanics.simulate import simulate
from shoal.mechanics.workspace import at_start
from shoal.scene import Scene, load_scene

FLEXIBLE, RIGID = load_scene("flexible-double-pendulum"), load_scene("single-pendulum")
CONSTRAINED = load_scene("parallelogram")
ONE = slice(0, 1)

KERNEL = """
from numba import njit

@njit(cache=True)
def inner(x):
    return x * x

@njit(cache=True)
def kernel(x):
    return inner(x) + 1.0
"""
FIRST = """
import pathlib, time
import kernels
from numba.core import event
from shoal.compile import locks
locks.install()
class Slow(event.Listener):
    def on_start(self, event):
        pathlib.Path("begun").touch()
        time.sleep(1.0)
    def on_end(self, event):
        pass
event.register("numba:compile", Slow())
kernels.kernel(2.0)
print(sum(kernels.kernel.stats.cache_misses.values()))
"""
SECOND = """
import pathlib, time
import kernels
from shoal.compile import locks
locks.install()
while not pathlib.Path("begun").exists():
    time.sleep(0.01)
kernels.kernel(2.0)
print(sum(kernels.kernel.stats.cache_misses.values()))
"""


@pytest.mark.slow
def test_of_two_processes_one_compiles_and_the_other_waits(tmp_path: Path) -> None:
    (tmp_path / "kernels.py").write_text(KERNEL)
    place = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    both = [
        subprocess.Popen([sys.executable, "-c", code], cwd=tmp_path, env=place, stdout=subprocess.PIPE, text=True)
        for code in (FIRST, SECOND)
    ]
    assert [process.communicate()[0].strip() for process in both] == ["1", "0"]


def test_who_listens_is_told_of_a_kernel(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(locks, "_WORTH_A_LINE", 0.0)
    lines: list[str] = []

    @njit
    def some_kernel(x):  # type: ignore[no-untyped-def]
        return x + 1.0

    with progress.reporting_to(lines.append):
        some_kernel(1.0)
    some_kernel(1)
    assert len(lines) == 1
    assert "some_kernel" in lines[0]


@pytest.mark.parametrize(
    ("scene", "lanes"),
    [(RIGID, 1), (RIGID, 2), (FLEXIBLE, 1), (FLEXIBLE, 6), (CONSTRAINED, 1)],
    ids=lambda v: str(v)[:9],
)
def test_what_is_compiled_ahead_is_what_a_run_calls(scene: Scene, lanes: int) -> None:
    body = next(iter(scene.bodies))
    values = {f"initial.{body}.angle": np.linspace(0.1, 0.2, lanes)} if lanes > 1 else None
    simulate(scene, np.array([1e-3]), values)
    for kernel in warm.required(scene, lanes):
        if kernel.name != "_stiffness":
            assert kernel.kinds in kernel.function.overloads, kernel.name
            assert kernel.cached


def _table(scene: Scene) -> FunctionTable:
    return at_start(build(scene), SINGLE, ONE)[0].table


def test_a_model_has_the_gates_that_it_calls() -> None:
    assert not _table(RIGID).force.any()
    assert np.count_nonzero(_table(FLEXIBLE).force) == np.count_nonzero(_table(FLEXIBLE).energy) == 1
    assert _table(FLEXIBLE).constrain == _table(FLEXIBLE).settle == 0
    assert _table(CONSTRAINED).constrain != 0
    assert _table(CONSTRAINED).settle != 0


def test_ahead_does_nothing_for_what_is_there() -> None:
    simulate(RIGID, np.array([1e-3]))
    lines: list[str] = []
    warm.ahead(warm.required(RIGID, 1), lines.append)
    assert lines == []
