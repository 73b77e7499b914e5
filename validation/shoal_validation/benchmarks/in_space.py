"""`python -m shoal_validation.benchmarks.in_space`: machines in space beside Exudyn; `make bench` prints it, too.

The flexible spherical double pendulum, 4 and 8 cables: equal steps of both, loops alone and whole calls. Bricard's
mechanism, P3 at 1 s, at equal error: each time is the median of some calls, Exudyn's of its solver alone. Exudyn's time
at our errors follows from its step nearest to them by its order, two: it grows with the root of the error.
"""

from __future__ import annotations

import argparse
import statistics
import time

import numpy as np
from shoal.engines.exudyn import ExudynEngine
from shoal.engines.exudyn.build import library, silence
from shoal.engines.exudyn.record import choose_steps
from shoal.engines.prepared import Prepared
from shoal.scene import load_scene

from shoal_validation.benchmarks.forward import Row, measure, show
from shoal_validation.spatial.machines import PUBLISHED, bricard

TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10)
STEPS = (1e-2, 4e-3, 2e-3, 1e-3)


def rows() -> list[Row]:
    """Both machines, one line a way of running them."""
    return [*measure(load_scene("flexible-spherical-double-pendulum"), "in space, 4/8 cables"), *_bricard()]


def _bricard() -> list[Row]:
    found, theirs = [], []
    for step in STEPS:
        error, seconds = _exudyn(step)
        theirs.append((error, seconds))
        found.append(Row(f"Bricard: Exudyn, time loop, step {step:g} s, {error:.1e} m", seconds, 1.0))
    for tolerance in TOLERANCES:
        error, seconds = _own(tolerance)
        nearest = min(theirs, key=lambda one: abs(np.log(one[0] / error)))
        same = nearest[1] * np.sqrt(nearest[0] / error)
        found.append(Row(f"Bricard: ours, whole call, tolerance {tolerance:g}, {error:.1e} m", seconds, same / seconds))
    return found


def _own(tolerance: float) -> tuple[float, float]:
    """Error [m] and median time [s] of a run of ours."""
    values = {"solver.relative_tolerance": tolerance, "solver.absolute_tolerance": tolerance / 10}
    run, times = Prepared(bricard().with_values(values), threads=1), []
    for _ in range(16):
        begin = time.perf_counter()
        found = run(times=[1.0])
        times.append(time.perf_counter() - begin)
        assert found.ok, found.message
    return float(np.linalg.norm(found.marker("P3")[-1] - PUBLISHED)), statistics.median(times[1:])


def _exudyn(step: float) -> tuple[float, float]:
    """The same of Exudyn's solver, modified Newton; its answer judged as the engine does."""
    engine, exu, scene = ExudynEngine(modified_newton=True), library(), bricard().with_values({"solver.step": step})
    found, times = engine.simulate(scene, [1.0]), []
    assert found.ok, found.message
    for _ in range(4):
        machine = engine.machine(exu, scene, 1.0)
        settings = engine.simulation_settings(exu, machine, choose_steps(np.array([1.0]), step, machine.unknowns))
        begin = time.perf_counter()
        with silence(exu):
            machine.mbs.SolveDynamic(settings, showHints=False)
        times.append(time.perf_counter() - begin)
    return float(np.linalg.norm(found.marker("P3")[-1] - PUBLISHED)), statistics.median(times[1:])


def main() -> None:
    """Measure and print."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    show(rows())


if __name__ == "__main__":
    main()
