"""`python -m shoal_validation.benchmarks.linkages`: closed linkages, alone and 64 at once, beside Exudyn's time loop.

Runge-Kutta's method of order four at a fixed step, from prepared arrays, on one core; 64 at once differ in gravity.
Exudyn's solver goes by its modified Newton at the same steps, of order two. `make bench` prints it, too.
"""

from __future__ import annotations

import argparse
import statistics

import numpy as np
from shoal.engines.exudyn import ExudynEngine
from shoal.scene import load_scene

from shoal_validation.benchmarks.forward import LANES, Row, exudyn_loop, prepare, show
from shoal_validation.benchmarks.timing import median_time

STEPS = {"equal-slider-crank": 1e-3, "andrews-squeezer": 2e-5, "bricard": 1e-3}
"""Steps [s] by scene; a thousand each."""


def rows(repeats: int = 15) -> list[Row]:
    """Three lines a linkage."""
    found = []
    for name, step in STEPS.items():
        scene = load_scene(name).with_values(
            {"solver.integrator": "rk4", "solver.step": step, "solver.duration": 1000 * step}
        )
        theirs = scene.with_values({"solver.integrator": "generalized-alpha"})
        lanes = {"gravity.1": (scene.gravity[1] or -9.81) * np.linspace(0.95, 1.05, LANES)}
        peer = statistics.median(exudyn_loop(ExudynEngine(modified_newton=True), theirs) for _ in range(repeats))
        alone, wide = (median_time(prepare(scene, values), repeats) for values in ({}, lanes))
        found += [
            Row(f"{name}: Exudyn, modified Newton, time loop", peer, 1.0),
            Row(f"{name}: ours, one simulation, time loop", alone, peer / alone),
            Row(f"{name}: ours, {LANES} lanes, one core, time loop", wide / LANES, peer / wide * LANES),
        ]
    return found


def main() -> None:
    """Measure and print."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    show(rows())


if __name__ == "__main__":
    main()
