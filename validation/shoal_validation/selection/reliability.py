"""`python -m shoal_validation.selection.reliability`: does the estimated error cover the true one?

The truth is a mesh four times finer than the finest that the selection ran, by another integrator (Runge and Kutta's,
of fourth order) at half of its stable step. Machines whose truth takes too much work are passed over, and counted.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from rich.console import Console
from shoal.mechanics.simulate import stable_step
from shoal.selection import Selection, select
from shoal.selection.levels import LADDERS, Level, Levels, apply, coarsest
from shoal.selection.refine import REFERENCE
from shoal.selection.run import Candidate, distance, run
from shoal.selection.work import Forecast
from shoal.trajectory import Trajectory

from shoal_validation.document import table
from shoal_validation.selection.machines import draw

FINER = 4
"""Elements of the truth for each of the finest mesh that was run."""
INTEGRATOR, FRACTION, EVALUATIONS = "rk4", 0.5, 4
PATIENCE = 0.1
"""Longest refinement of the selection [s]: estimates of those that are not met are judged too."""
MOST = 3e7
"""Work of a truth, in steps of one cable element: a second or more; fine meshes with welds take six times as much."""


class Judged(NamedTuple):
    """Errors of the answer and of its reference: estimated, and true [m]."""

    seed: int
    tolerance: float
    met: bool
    answer: tuple[float, float]
    reference: tuple[float, float]


def judge(seed: int, most: float = MOST) -> Judged | None:
    """Return the errors of one machine; None if all rods are surely rigid, or the truth takes more work than `most`."""
    machine = draw(seed)
    found = select(machine.scene, machine.tolerance, patience=PATIENCE)
    finest = _finest(found)
    if finest is None or (truth := _truth(found, finest, most)) is None:
        return None
    of = [(candidate.error, distance(candidate.trajectory, truth)) for candidate in (found.chosen, finest)]
    return Judged(seed, machine.tolerance, found.met, of[0], of[1])


def _finest(found: Selection) -> Candidate | None:
    """The reference of the theory that was chosen, or the last refinement."""
    mine = (candidate for candidate in found.candidates if candidate.role == REFERENCE and _of(found, candidate.levels))
    return next((candidate for candidate in reversed(list(mine)) if np.isfinite(candidate.error)), None)


def _of(found: Selection, levels: Levels) -> bool:
    return all(level in LADDERS[found.limits[rod]] for rod, level in levels.items())


def _truth(found: Selection, finest: Candidate, most: float) -> Trajectory | None:
    levels = {
        rod: level if level.element == "rigid" else Level(level.element, FINER * level.elements)
        for rod, level in finest.levels.items()
    }
    modelled = apply(finest.scene, levels)
    steps = int(np.ceil(modelled.solver.duration / (FRACTION * stable_step(modelled, INTEGRATOR))))
    forecast = Forecast(finest.scene, coarsest(finest.scene, found.limits))
    leaps = modelled.solver.duration / forecast.step(levels)
    if EVALUATIONS * steps * forecast.work(levels) / leaps > most:
        return None
    pace = {"solver.integrator": INTEGRATOR, "solver.step": modelled.solver.duration / steps}
    truth = run(modelled.with_values(pace), found.candidates[0].trajectory.times)
    return truth if truth.ok else None


def judge_all(seeds: Sequence[int], console: Console) -> Iterator[Judged]:
    """Yield the machines that can be judged, and print each."""
    for seed in seeds:
        with np.errstate(invalid="ignore"):
            one = judge(seed)
        console.print(f"{seed}: {'passed over' if one is None else one}")
        if one is not None:
            yield one


def main() -> None:
    """Run the study."""
    parser = argparse.ArgumentParser(prog="python -m shoal_validation.selection.reliability", description=__doc__)
    parser.add_argument("--machines", type=int, default=40, help="how many random machines (default: 40)")
    parser.add_argument("--first", type=int, default=0, help="seed of the first (default: 0)")
    parser.add_argument("--every", type=int, default=1, help="from one seed to the next (default: 1)")
    asked = parser.parse_args()
    seeds = range(asked.first, asked.first + asked.every * asked.machines, asked.every)
    found = list(judge_all(seeds, Console(stderr=True, highlight=False, soft_wrap=True)))
    rows = []
    for name, errors in (("answer", [one.answer for one in found]), ("reference", [one.reference for one in found])):
        ratio = np.array([true / said for said, true in errors if said > 0])
        row = (name, len(ratio), sum(ratio <= 1), f"{np.median(ratio):.2f}", f"{ratio.max():.2f}")
        rows.append(tuple(map(str, row)))
    head = ("error of the", "machines", "estimate covers the true error", "true over estimate, median", "largest")
    Console(highlight=False, soft_wrap=True).print(
        f"{len(seeds)} machines, {len(seeds) - len(found)} passed over.\n\n{table(head, rows)}"
    )


if __name__ == "__main__":
    main()
