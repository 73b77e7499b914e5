"""`python -m shoal_validation.spatial`: machines in space beside Exudyn, error and processor time.

Bricard's mechanism, P3 at 1 s: both run in one process on one core; each time is the median of some calls, Exudyn's of
its solver alone. Exudyn's time at our errors follows from its step nearest to them by its order, two: it grows with the
root of the error. The flexible spherical double pendulum, 4 and 8 cables: equal steps of both, loops alone and whole
calls.
"""

from __future__ import annotations

import statistics
import time

import numpy as np
from shoal.engines.exudyn import ExudynEngine
from shoal.engines.exudyn.build import library, silence
from shoal.engines.exudyn.record import choose_steps
from shoal.engines.prepared import Prepared
from shoal.scene import load_scene

from shoal_validation.benchmarks import forward
from shoal_validation.document import table
from shoal_validation.spatial.machines import PUBLISHED, bricard

TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10)
STEPS = (1e-2, 4e-3, 2e-3, 1e-3)


def own(tolerance: float) -> tuple[float, float]:
    """Error [m] and median time [s] of a run of ours."""
    values = {"solver.relative_tolerance": tolerance, "solver.absolute_tolerance": tolerance / 10}
    run, times = Prepared(bricard().with_values(values), threads=1), []
    for _ in range(16):
        begin = time.perf_counter()
        found = run(times=[1.0])
        times.append(time.perf_counter() - begin)
        assert found.ok, found.message
    return float(np.linalg.norm(found.marker("P3")[-1] - PUBLISHED)), statistics.median(times[1:])


def exudyn(step: float) -> tuple[float, float]:
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


def flexible() -> None:
    """The flexible pendulum on its own mesh."""
    rows = forward.measure(load_scene("flexible-spherical-double-pendulum"), "4/8 cables")
    shown = [(row.name, f"{row.seconds * 1e3:.4g}", f"{row.ratio:.3g}") for row in rows]
    print(table(("flexible spherical double pendulum", "ms each", "times faster"), shown))


def main() -> None:
    """Measure and print."""
    flexible()
    rows, theirs = [], []
    for step in STEPS:
        error, seconds = exudyn(step)
        theirs.append((error, seconds))
        rows.append(("exudyn", f"step {step:g} s", f"{error:.2g}", f"{seconds * 1e3:.3g}", ""))
    for tolerance in TOLERANCES:
        error, seconds = own(tolerance)
        nearest = min(theirs, key=lambda one: abs(np.log(one[0] / error)))
        same = nearest[1] * np.sqrt(nearest[0] / error)
        rows.append(
            ("gauss", f"tolerance {tolerance:g}", f"{error:.2g}", f"{seconds * 1e3:.3g}", f"{same / seconds:.3g}")
        )
    print(table(("engine", "setting", "error [m]", "time [ms]", "times that of ours"), rows))


if __name__ == "__main__":
    main()
