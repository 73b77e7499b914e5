"""A flexible double pendulum on a mesh of its own, some 1000 steps: our time loop beside Exudyn's."""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from shoal.engines import get_engine
from shoal.engines.exudyn import ExudynEngine
from shoal.engines.exudyn.build import library
from shoal.engines.exudyn.record import choose_steps
from shoal.mechanics.assembly.build import build
from shoal.mechanics.integrators import Choice, halting
from shoal.mechanics.numerics.tile import Array, tiles
from shoal.mechanics.workspace import Workspace
from shoal.scene import Scene, load_scene

from shoal_validation.benchmarks.timing import median_time
from shoal_validation.document import table

STEPS = 1000
LANES = 64


@dataclass(frozen=True)
class Row:
    """One line of a benchmark: seconds a simulation, and how many times faster than the peer of its group."""

    name: str
    seconds: float
    ratio: float


def show(rows: Iterable[Row]) -> None:
    """Print lines of benchmarks as a table."""
    shown = [(row.name, f"{row.seconds * 1e3:.4g}", f"{row.ratio:.3g}") for row in rows]
    sys.stdout.write(table(("machine", "ms each", "times faster"), shown) + "\n")


def scene(quadrature: str) -> Scene:
    """Case 1 with the step that both quadratures allow (the reduced one is stable up to 4.5e-4 s)."""
    step = 5e-4 if quadrature == "full" else 4e-4
    values = {"bodies.OA.quadrature": quadrature, "bodies.AB.quadrature": quadrature, "solver.step": step}
    return load_scene("flexible-double-pendulum").with_values({**values, "solver.duration": STEPS * step})


def measure(what: Scene, quadrature: str, repeats: int = 15) -> list[Row]:
    """Time loops alone, then whole calls as a user makes them (model, motion, checks)."""
    many = {"initial.OA.angle": np.linspace(0.7, 0.8, LANES)}
    one_core, exudyn = get_engine("gauss"), ExudynEngine(modified_newton=True)
    loop = statistics.median(exudyn_loop(exudyn, what) for _ in range(repeats))
    single = median_time(prepare(what, {}), repeats)
    wide = median_time(prepare(what, many), repeats) / LANES
    call = median_time(lambda: exudyn.simulate(what), repeats)
    own_call = median_time(lambda: one_core.simulate(what), repeats)
    own_many = median_time(lambda: one_core.simulate_many(what, many), repeats) / LANES
    return [
        Row(f"{quadrature}: Exudyn, modified Newton, time loop", loop, 1.0),
        Row(f"{quadrature}: ours, one simulation, time loop", single, loop / single),
        Row(f"{quadrature}: ours, {LANES} lanes, one core, time loop", wide, loop / wide),
        Row(f"{quadrature}: Exudyn, whole call", call, 1.0),
        Row(f"{quadrature}: ours, whole call", own_call, call / own_call),
        Row(f"{quadrature}: ours, {LANES} lanes, all cores, whole call", own_many, call / own_many),
    ]


def exudyn_loop(engine: ExudynEngine, what: Scene) -> float:
    """Seconds of SolveDynamic alone, on a fresh system, without callbacks and files."""
    exu = library()
    machine = engine.machine(exu, what)
    steps = choose_steps(np.array([what.solver.duration]), what.solver.step, machine.unknowns)
    settings = engine.simulation_settings(exu, machine, steps)
    begin = time.perf_counter()
    machine.mbs.SolveDynamic(settings, showHints=False)
    return time.perf_counter() - begin


def prepare(what: Scene, values: Mapping[str, Array]) -> Any:
    """A call that marches all lanes, one number each of some values, on one core from prepared arrays."""
    lanes = max((len(numbers) for numbers in values.values()), default=1)
    model = build(what.with_lanes(values), lanes)
    tile, parts = tiles(lanes)
    times = np.linspace(0.0, what.solver.duration, 51)[1:]
    choice = Choice(what.solver.integrator, "", np.inf)
    stops = halting(what.solver, model, choice.name, what.solver.duration)
    work = [(Workspace(what.solver, model, choice, tile, part, times, stops), part) for part in parts]

    def run() -> None:
        for space, part in work:
            space.run(model, part)

    return run
