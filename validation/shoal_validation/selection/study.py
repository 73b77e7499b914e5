"""One machine through the selection: true error, and work beside the cheapest model that would have done."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np
from shoal.selection import Selection, select
from shoal.selection.levels import LADDERS, Level
from shoal.selection.refine import PATIENCE, LevelRuns
from shoal.selection.run import Candidate, distance

from shoal_validation.benchmarks.timing import undisturbed
from shoal_validation.selection.machines import Draw

FINER = 4.0
"""The truth is the finest model of a selection whose tolerance is smaller by this factor,"""
JUDGE = 20.0
"""none of whose refinements takes longer [s]."""
AFFORDABLE = 3e8
"""The cheapest model is looked for where all cheaper ones together take less work, in steps of one cable element."""


@dataclass(frozen=True)
class Case:
    """Result for one machine.

    stiffness: geometric mean of the rods' moduli [Pa]; rigid: whether all rods came out rigid;
    error: true distance from the reference of the finer selection [m], nan if there is none; work: of the chosen model;
    uncapped: the least work of those tried models within the tolerance whose inertia is not capped; least: of all such
    models, nan if not searched for; seconds: of the selection, less what it waited for others on the machine
    """

    seed: int
    rods: int
    stiffness: float
    tolerance: float
    met: bool
    reason: str
    model: str
    rigid: bool
    estimate: float
    error: float
    reference_error: float
    work: float
    uncapped: float
    least: float
    cheapest: str
    seconds: float

    @property
    def known(self) -> bool:
        """Return whether the finer model is known well enough to judge by."""
        return bool(self.reference_error < 0.5 * self.tolerance)


def study(machine: Draw, exhaustive: bool = False, patience: float = PATIENCE) -> Case:
    """Select, then judge by a finer selection. patience: see `select` [s]."""
    seconds, chosen = undisturbed(lambda: select(machine.scene, machine.tolerance, patience=patience))
    finer = select(machine.scene, machine.tolerance / FINER, patience=JUDGE, coarsened=False)
    # A finer selection that is not met may have stayed with another theory, by which nothing is judged.
    limits = finer.limits if finer.met else chosen.limits
    reference = min(
        (r for r in finer.candidates if np.isfinite(r.error) and _of(r, limits)), key=lambda r: r.error, default=None
    )
    error = distance(chosen.chosen.trajectory, reference.trajectory) if reference is not None else np.nan
    least, cheapest = (np.nan, "") if not exhaustive or reference is None else _cheapest(machine, chosen, reference)
    return Case(
        machine.seed,
        len(machine.scene.bodies),
        _stiffness(machine),
        machine.tolerance,
        chosen.met,
        chosen.reason,
        chosen.chosen.name,
        all(level.element == "rigid" for level in chosen.chosen.levels.values()),
        chosen.chosen.error,
        error,
        reference.error if reference is not None else np.nan,
        chosen.chosen.work,
        _uncapped(chosen),
        least,
        cheapest,
        seconds,
    )


def _of(candidate: Candidate, limits: Mapping[str, str]) -> bool:
    """Return whether a model belongs to the theory whose limits are the truth."""
    return all(level in LADDERS[limits[rod]] for rod, level in candidate.levels.items())


def _uncapped(chosen: Selection) -> float:
    mine = (candidate for candidate in chosen.candidates if _of(candidate, chosen.limits))
    plain = [candidate for candidate in mine if candidate.ok and not candidate.scene.solver.inertia_cap]
    return min(
        (candidate.work for candidate in plain if candidate.error <= chosen.tolerance), default=chosen.chosen.work
    )


def _stiffness(machine: Draw) -> float:
    moduli = [getattr(body, "youngs_modulus", None) for body in machine.scene.bodies.values()]
    return float(np.exp(np.mean([np.log(modulus) for modulus in moduli if modulus])))


def _cheapest(machine: Draw, chosen: Selection, reference: Candidate) -> tuple[float, str]:
    """The least work within the tolerance among all combinations of levels, without capped inertia."""
    rods, least = tuple(chosen.chosen.levels), _uncapped(chosen)
    runs = LevelRuns(chosen.chosen.scene, reference.trajectory.times, chosen.limits, lambda _: None)
    cheaper: list[tuple[float, dict[str, Level]]] = []
    ladders = ([level for level in LADDERS[chosen.limits[rod]] if runs.knows(rod, level)] for rod in rods)
    for levels in product(*ladders):
        combination = dict(zip(rods, levels, strict=True))
        work = runs.forecast.work(combination)
        if 0 < work < least and any(level.element != "rigid" for level in levels):
            cheaper.append((work, combination))
    if sum(work for work, _ in cheaper) > AFFORDABLE:
        return np.nan, ""
    for work, combination in sorted(cheaper, key=lambda pair: pair[0]):
        if distance(runs(combination).trajectory, reference.trajectory) <= machine.tolerance:
            return work, runs.candidates[-1].name
    return least, ""
