"""`python -m shoal_validation.benchmarks.linkages`: closed linkages, alone and 64 at once, beside Exudyn and MuJoCo.

All take a thousand equal steps in turn, so that what else the machine does meets all alike: medians of 15 rounds, time
loops alone, from prepared arrays, on one core, without what they wait for others. Ours go by the Runge-Kutta method of
order four and by leapfrog; 64 at once differ in gravity. Exudyn's solver goes by its modified Newton, of order two.
MuJoCo closes loops by soft constraints, which open; its lines say how far. `make bench` prints the table, too.
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
from collections.abc import Callable

import numpy as np
from shoal.engines.exudyn import ExudynEngine
from shoal.engines.exudyn.build import library
from shoal.engines.exudyn.record import choose_steps
from shoal.engines.mujoco.engine import library as mujoco_library
from shoal.engines.mujoco.engine import loaded, quiet
from shoal.engines.mujoco.mjcf import Mjcf
from shoal.home import processor
from shoal.scene import Scene, load_scene

from shoal_validation.benchmarks.forward import LANES, STEPS, Row, prepare, show
from shoal_validation.benchmarks.timing import undisturbed

STEP = {"equal-slider-crank": 1e-3, "andrews-squeezer": 2e-5, "bricard": 1e-3, "n-four-bar-40": 1e-3}
"""Steps [s] by scene."""
OURS = ("rk4", "leapfrog")
THEIRS = ("RK4", "EULER")
"""MuJoCo's integrators; its implicit Euler method is its cheapest."""


def rows(repeats: int = 15) -> list[Row]:
    """Seven lines a linkage."""
    return [row for name, step in STEP.items() for row in _linkage(name, step, repeats)]


def _linkage(name: str, step: float, repeats: int) -> list[Row]:
    scene = load_scene(name).with_values({"solver.step": step, "solver.duration": STEPS * step})
    timed: dict[str, tuple[int, Callable[[], float]]] = {"Exudyn, modified Newton": (1, _exudyn(scene))}
    soft = Mjcf(scene)
    for integrator in THEIRS:
        opened, loop = _mujoco(soft, integrator)
        timed[f"MuJoCo, {integrator}, loops open by {opened:.0e} m"] = 1, loop
    lanes = {"gravity.1": (scene.gravity[1] or -9.81) * np.linspace(0.95, 1.05, LANES)}
    for integrator in OURS:
        ours = scene.with_values({"solver.integrator": integrator})
        timed[f"ours, {integrator}, one simulation"] = 1, _seconds(prepare(ours, {}))
        timed[f"ours, {integrator}, {LANES} lanes"] = LANES, _seconds(prepare(ours, lanes))
    found: dict[str, list[float]] = {way: [] for way in timed}
    for _ in range(repeats + 1):
        for way, (count, loop) in timed.items():
            found[way].append(loop() / count)
    medians = {way: statistics.median(times[1:]) for way, times in found.items()}  # the first time may compile
    peer = next(iter(medians.values()))
    return [Row(f"{name}: {way}", median, peer / median) for way, median in medians.items()]


def _seconds(run: Callable[[], object]) -> Callable[[], float]:
    return lambda: undisturbed(run)[0]


def _exudyn(scene: Scene) -> Callable[[], float]:
    """Return the solver's loop alone, which begins at the start of the machine each time."""
    engine, exu = ExudynEngine(modified_newton=True), library()
    machine = engine.machine(exu, scene.with_values({"solver.integrator": "generalized-alpha"}))
    steps = choose_steps(np.array([scene.solver.duration]), scene.solver.step, machine.unknowns)
    settings = engine.simulation_settings(exu, machine, steps)
    return _seconds(lambda: machine.mbs.SolveDynamic(settings, showHints=False))


def _mujoco(machine: Mjcf, integrator: str) -> tuple[float, Callable[[], float]]:
    """Return how far loops are open after its steps [m], and a loop that returns its seconds."""
    mujoco = mujoco_library()
    model, _ = loaded(mujoco, machine)
    model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator}")
    opened = list[float]()

    def loop() -> float:
        data = mujoco.MjData(model)
        data.qvel[:] = machine.rates
        mujoco.mj_forward(model, data)
        with quiet(mujoco):
            seconds, _ = undisturbed(lambda: mujoco.mj_step(model, data, STEPS))
        mujoco.mj_forward(model, data)
        opened.append(float(np.max(np.abs(data.efc_pos[: data.nefc]), initial=0.0)))
        return seconds

    loop()
    return opened[0], loop


def main() -> None:
    """Measure and print."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    show(rows())
    sys.stdout.write(f"{processor()}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}\n")


if __name__ == "__main__":
    main()
