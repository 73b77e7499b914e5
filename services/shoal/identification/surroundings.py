"""Surroundings of an answer before it is judged: valley, intervals, profiles."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from shoal.identification.deadline import unless_late
from shoal.identification.diagnostics.judgement import Judgement
from shoal.identification.diagnostics.minima.rivals import valley
from shoal.identification.evidence import Evidence
from shoal.identification.forward import ForwardModel
from shoal.identification.methods.growth import FRACTAL, growth
from shoal.identification.methods.outcome import Outcome
from shoal.identification.uncertainty import intervals
from shoal.identification.uncertainty.intervals import Value
from shoal.identification.uncertainty.profiles import Profile, bent, by_profile, profiles
from shoal.identification.uncertainty.rank import combinations
from shoal.trajectory import Array


@dataclass(frozen=True)
class Surroundings:
    """Parameters, valley and profiles near an answer, before the verdict.

    outcome: without the minima in the valley of the answer; ends: the answer and those minima: the intervals hold all
    curved: parameters whose intervals are those of their profiles
    """

    outcome: Outcome
    ends: list[Array]
    values: dict[str, Value]
    curved: list[int]
    profiled: dict[str, Profile]
    combinations: list[str]

    def bent(self, model: ForwardModel) -> list[str]:
        """The names of those that are curved."""
        return [model.names[k] for k in self.curved]

    def quantities(self, model: ForwardModel, near: Evidence, judgement: Judgement) -> dict[str, Value]:
        """Quantities with intervals that hold all ends, and the refits of a judgement."""
        ends = (intervals.quantities(model, end, near.at, near.correction, self.curved) for end in self.ends)
        return intervals.spanning([*ends, *(refit.quantities() for refit in judgement.refits)])


def surroundings(model: ForwardModel, outcome: Outcome, near: Evidence, profiles_too: bool) -> Surroundings:
    """Return what the surroundings of an outcome show of its parameters."""
    point, at, found, beside = near.point, near.at, outcome, list[Array]()
    if near.known:
        found, beside = unless_late(lambda: valley(model, outcome, at), (found, beside))
    ends = [point, *beside]
    values = intervals.possible(
        model, intervals.spanning([intervals.parameters(model, end, at, near.correction) for end in ends])
    )
    if not near.looked:
        values = {n: replace(p, std=np.nan, lower=np.nan, upper=np.nan) for n, p in values.items()}
    curved = _curved(model, outcome, near) if near.known else []
    values, profiled = by_profile(model, ends, at, values, curved)
    if profiles_too and near.known:
        profiled = profiles(model, point, at, profiled)
    values |= {n: replace(values[n], identifiable=False) for n, p in profiled.items() if p.open}
    return Surroundings(found, ends, values, curved, profiled, combinations(model, point, at) if near.known else [])


def _curved(model: ForwardModel, outcome: Outcome, near: Evidence) -> list[int]:
    """Parameters whose intervals linear theory does not give; where the model limits them they are wider anyway.

    Refits of a profile end on their way along the narrow valley of a chaotic motion, which would make it too narrow.
    """
    if not outcome.ended or not outcome.converged or near.tests.limited or not near.seen.reliable:
        return []
    if growth(model, near.seen.jacobian) > FRACTAL:
        return []
    return unless_late(lambda: bent(model, near.point, near.at, near.seen), [])
