"""Compile the kernels into the cache, for one lane and for tiles of lanes, so that no later run waits for it."""

from __future__ import annotations

import multiprocessing
import os
import sys
import time
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor, as_completed

import numpy as np

from shoal.mechanics.integrators import INTEGRATORS
from shoal.mechanics.simulate import simulate
from shoal.scene import load_scene

WIDE = ("leapfrog", "rk4", "dop853", "generalized-alpha")
"""Integrators of which tiles of lanes are compiled ahead; the others compile theirs when they are first asked to."""


def warm(integrators: Iterable[str] = tuple(INTEGRATORS), note: Callable[[str], None] = lambda _: None) -> float:
    """Compile what is not yet in the cache, on all cores; returns the seconds it took.

    The first integrator comes before the others: its single run and its lanes share nothing that takes long, the
    others use again what they brought. `note` is told what has been done.
    """
    begin = time.perf_counter()
    first, *others = ([(name, 1), (name, 2)] if name in WIDE else [(name, 1)] for name in integrators)
    with ProcessPoolExecutor(os.cpu_count() or 1, multiprocessing.get_context("spawn")) as pool:
        for jobs in (first, [job for pair in others for job in pair]):
            for done in as_completed([pool.submit(_compile, *job) for job in jobs]):
                note(done.result())
    return time.perf_counter() - begin


def _compile(integrator: str, lanes: int) -> str:
    """Two steps of the flexible double pendulum; returns what was done and how long it took."""
    begin = time.perf_counter()
    solver = {"solver.integrator": integrator, "solver.step": 2e-4}
    angles = {"initial.OA.angle": np.linspace(0.7, 0.8, lanes)} if lanes > 1 else None
    simulate(load_scene("flexible-double-pendulum").with_values(solver), np.array([4e-4]), angles)
    return f"{integrator}, {'single' if lanes == 1 else 'lanes'}: {time.perf_counter() - begin:.1f} s"


if __name__ == "__main__":
    warm(note=lambda line: print(f"  kernels {line}", file=sys.stderr))  # noqa: T201 - a command
