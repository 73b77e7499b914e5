"""A prepared scene called again and again, and what of a call its march does not take: shortest of many.

The second table has the processor time of 64 lanes of a closed loop with different dimensions: of their start with the
arrays of their model, and of whole calls of ten steps. `python -m shoal_validation.benchmarks.calls`
"""

from __future__ import annotations

import argparse
import os
import statistics
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table
from shoal.engines.prepared import Prepared
from shoal.home import processor
from shoal.mechanics.assembly.build import build
from shoal.mechanics.integrators import halting
from shoal.mechanics.machine import Machine
from shoal.mechanics.numerics.tile import SINGLE
from shoal.mechanics.simulate import runs
from shoal.mechanics.workspace import Workspace
from shoal.scene import Scene, load_scene
from shoal.trajectory import Array

from shoal_validation.benchmarks.forward import LANES

CALLS = 2000


def shortest(run: Callable[[], Any], calls: int = CALLS) -> float:
    """Shortest wall-clock time of many calls [s]."""
    found = np.inf
    for _ in range(calls):
        begin = time.perf_counter()
        run()
        found = min(found, time.perf_counter() - begin)
    return found


def call(name: str, times: Array) -> tuple[int, float, float]:
    """Steps, seconds of a call, and of the march in it with the way back to the start."""
    prepared = Prepared(load_scene(name))
    steps = prepared(times=times).steps
    kept, lane = runs(Machine.of(prepared.scene), prepared.scene.solver, float(times[-1])), slice(0, 1)
    halts = halting(kept.scene.solver, kept.model, kept.choice.name, float(times[-1]))
    space = Workspace(kept.scene.solver, kept.model, kept.choice, SINGLE, lane, times, halts)
    return steps, shortest(lambda: prepared(times=times)), shortest(lambda: space.run(kept.model, lane))


def varied() -> Iterator[tuple[Scene, str, float]]:
    """Yield closed loops and the path and value of what differs from lane to lane by a percent, up and down."""
    yield load_scene("andrews-squeezer"), "joints.B.first.point.0", -0.03635
    bar = {"kind": "rod", "height": 0.02, "width": 0.02, "density": 2700.0, "rotary_inertia": True}
    bodies = {name: {**bar, "length": length} for name, length in (("crank", 0.3), ("coupler", 1.0), ("rocker", 0.8))}
    ground = [{"body": "ground", "point": point} for point in ([0, 0, 0], [1, 0.2, 0])]
    joints = {
        "A": {"kind": "revolute", "first": ground[0], "second": {"body": "crank"}, "axis": "z"},
        "B": {"kind": "spherical", "first": {"body": "crank", "point": "end"}, "second": {"body": "coupler"}},
        "C": {"kind": "spherical", "first": {"body": "coupler", "point": "end"},
              "second": {"body": "rocker", "point": "end"}},
        "D": {"kind": "revolute", "first": ground[1], "second": {"body": "rocker"}, "axis": "y"},
    }  # fmt: skip
    data = {"name": "four-bar in space", "dimensions": 3, "bodies": bodies, "joints": joints,
            "initial": {"crank": {"angle": 0.5, "spin": [0, 0, 3.0]}},
            "markers": {"C": {"body": "coupler", "point": "end"}}}  # fmt: skip
    yield Scene.parse(data), "bodies.coupler.length", 1.0


def starts(scene: Scene, path: str, value: float, rounds: int = 15) -> tuple[float, float]:
    """Median processor times of the start of 64 lanes and of whole calls, of each lane [s]."""
    lanes = {path: value * np.linspace(0.99, 1.01, LANES)}
    step = {"solver.integrator": "rk4", "solver.step": 1e-5, "solver.duration": 1e-4, "solver.samples": 1}
    run, stated = Prepared(scene.with_values(step), threads=1), scene.with_lanes(lanes)
    ways: tuple[Callable[[], Any], ...] = (lambda: build(stated, LANES), lambda: run(lanes))
    found: list[list[float]] = [[], []]
    for _ in range(rounds + 1):
        for times, way in zip(found, ways, strict=True):
            begin = time.process_time()
            way()
            times.append((time.process_time() - begin) / LANES)
    model, call = (statistics.median(times[1:]) for times in found)
    return model, call


def main() -> None:
    """Print the tables."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    table = Table("scene", "samples", "steps", "call, us", "march, us", "beyond it, us", box=box.SIMPLE_HEAD)
    for name, times in (
        ("rigid-double-pendulum", np.array([1e-3])),
        ("rigid-double-pendulum", np.array([5e-3, 1e-2])),
        ("flexible-double-pendulum", np.array([5e-4])),
        ("flexible-double-pendulum", np.linspace(0.0, 0.5, 51)[1:]),
    ):
        steps, whole, march = call(name, times)
        figures = (f"{1e6 * seconds:.1f}" for seconds in (whole, march, whole - march))
        table.add_row(name, str(len(times)), str(steps), *figures)
    console = Console(highlight=False)
    console.print(table)
    table = Table(f"{LANES} lanes", "start, ms each", "call, ms each", box=box.SIMPLE_HEAD)
    for scene, path, value in varied():
        table.add_row(f"{scene.name}, {path}", *(f"{1e3 * seconds:.2f}" for seconds in starts(scene, path, value)))
    console.print(table)
    console.print(f"{processor()}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
