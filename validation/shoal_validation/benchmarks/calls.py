"""A prepared scene called again and again, and what of a call its march does not take: shortest of many.

`python -m shoal_validation.benchmarks.calls`
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table
from shoal.engines.prepared import Prepared
from shoal.mechanics.integrators import halting
from shoal.mechanics.machine import Machine
from shoal.mechanics.numerics.tile import SINGLE
from shoal.mechanics.simulate import runs
from shoal.mechanics.workspace import Workspace
from shoal.scene import load_scene
from shoal.trajectory import Array

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


def main() -> None:
    """Print the table."""
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
    Console(highlight=False).print(table)


if __name__ == "__main__":
    main()
