"""Compile the kernels into the cache, for one lane and for tiles of lanes, so that no later run waits for it."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterable

import numpy as np

from shoal.mechanics.integrators import INTEGRATORS
from shoal.mechanics.simulate import simulate
from shoal.scene import load_scene

WIDE = ("leapfrog", "rk4", "dop853", "generalized-alpha")
"""Integrators of which tiles of lanes are compiled ahead; the others compile theirs when they are first asked to."""


def warm(integrators: Iterable[str] = tuple(INTEGRATORS), note: Callable[[str], None] = lambda _: None) -> float:
    """Compile what is not yet in the cache; returns the seconds it took. `note` is told what is being done."""
    begin = time.perf_counter()
    scene = load_scene("flexible-double-pendulum")
    for integrator in integrators:
        small = scene.with_values({"solver.integrator": integrator, "solver.step": 2e-4})
        for lanes in (1, 2) if integrator in WIDE else (1,):
            started = time.perf_counter()
            angles = {"initial.OA.angle": np.linspace(0.7, 0.8, lanes)} if lanes > 1 else None
            simulate(small, np.array([4e-4]), angles)
            note(f"{integrator}, {'single' if lanes == 1 else 'lanes'}: {time.perf_counter() - started:.1f} s")
    return time.perf_counter() - begin


if __name__ == "__main__":
    warm(note=lambda line: print(f"  kernels {line}", file=sys.stderr))  # noqa: T201 - a command
