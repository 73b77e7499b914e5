"""Horizon of the bounds of each method: by the number of parameters, the width of their intervals, and chaos.

A sum of vibrations in closed form, the mean of cos(2 pi f sqrt(k) g(t)), one for each parameter k, with frequencies f
that share no period. Without chaos g is the time t in cycles of the first, so that phases part in proportion to it;
with a rate r, g = (exp(r t) - 1) / r, and neighbours part exponentially. Each phase is monotonic in its parameter, and
the bounds of a sum of functions of one parameter each are the sums of theirs: they are known.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from shoal.errors import InputError
from shoal.response import respond
from shoal.response.inputs import Inputs, UncertainParameter
from shoal.response.marginals import Interval
from shoal.response.runs import Answers, Model
from shoal.trajectory import Array

INSTANTS = np.geomspace(0.3, 300.0, 13)
"""Cycles that are looked at, up to where rounding decides."""
ROUNDING = 1e7
"""Cycles of phase that a double still tells the place in."""
PARAMETERS, WIDTHS, RATES = (1, 2, 4), (0.01, 0.1), (0.0, 0.2)
"""Of the whole map; widths: of each interval, as shares; rates: per cycle, 0 without chaos."""
MOST = 1_500
"""Runs that a method may make."""
GOOD = 0.01
"""Share of the width that attained bounds may miss."""
OFF = 1e-5
"""Share of the width by which the closed form may be off."""


@dataclass(frozen=True)
class Question:
    """parameters: their number; width: of each, as a share; rate: of chaos, per cycle."""

    parameters: int
    width: float
    rate: float

    @property
    def times(self) -> Array:
        """Instants, in cycles."""
        return INSTANTS[self._stretched(INSTANTS) < ROUNDING]

    @property
    def inputs(self) -> Inputs:
        """Stiffnesses."""
        ends = 1 - self.width / 2, 1 + self.width / 2
        return Inputs(
            tuple(UncertainParameter(f"k{n}", Interval(*ends), {f"k{n}": 1.0}) for n in range(self.parameters))
        )

    def _stretched(self, times: Array) -> Array:
        return times if self.rate == 0 else np.asarray(np.expm1(self.rate * times) / self.rate)

    def at(self, instants: Array) -> Model:
        """Return the study as a model."""

        def model(values: Mapping[str, Array]) -> Answers:
            pace = np.stack([_frequency(n) * np.sqrt(k)[:, None] for n, k in enumerate(values.values())])
            parts = np.cos(2 * np.pi * pace * self._stretched(instants))
            return Answers(np.mean(parts, axis=0), np.ones(len(parts[0]), dtype=bool))

        return model

    def reference(self) -> tuple[Array, Array]:
        """Lower and upper bounds, (instants,)."""
        sides = []
        for n in range(self.parameters):
            turns = _frequency(n) * self._stretched(self.times)
            first, last = np.sqrt(1 - self.width / 2) * turns, np.sqrt(1 + self.width / 2) * turns
            ends = np.cos(2 * np.pi * np.stack([first, last]))
            lowest = np.where(np.floor(last - 0.5) >= np.ceil(first - 0.5), -1.0, ends.min(axis=0))
            sides.append((lowest, np.where(np.floor(last) >= np.ceil(first), 1.0, ends.max(axis=0))))
        low, high = np.mean(sides, axis=0)
        return low, high


def _frequency(number: int) -> float:
    """Frequency of a vibration, over that of the first."""
    return math.sqrt(1 + 0.6 * number)


@dataclass(frozen=True)
class Cell:
    """Result of a method. runs: made; horizon: cycles up to which attained bounds are right and it does not refuse;
    told: whether it tells outer bounds; beyond: how far true bounds lie beyond these where they are told, as a share of
    the width, more than the gap told
    """

    method: str
    question: Question
    runs: int
    horizon: float
    told: bool
    beyond: float

    @property
    def silent(self) -> bool:
        """Return whether outer bounds are wrong without a finding."""
        return self.beyond > OFF


def cell(method: str, asked: Question) -> Cell:
    """One method on one question."""
    times, (low, high) = asked.times, asked.reference()
    one = np.zeros(len(times))
    try:
        answer = respond(
            asked.at(times),
            asked.inputs,
            len(times),
            method=method,
            groups=one,
            instants=times,
            most=MOST,
            over_time=asked.at,
        )
    except InputError:
        return Cell(method, asked, 0, 0.0, False, 0.0)
    found = answer.bounds
    assert found is not None
    width = float((high - low).max())
    within = times <= found.horizon
    short = np.maximum(found.lower - low, high - found.upper) / width
    right = within & (short < GOOD)
    count = len(times) if right.all() else int(np.argmin(right))
    beyond = np.maximum(found.lower_outer - low, high - found.upper_outer)[within].max(initial=0.0) / width
    told = not math.isnan(found.gap)
    end = float(times[count - 1]) if count else 0.0
    return Cell(method, asked, answer.runs.evaluations, end, told, max(0.0, beyond - found.gap) if told else 0.0)


def surveyed(methods: Sequence[str], *, quick: bool) -> list[Cell]:
    """Every method on every question; quick: up to two parameters of the larger width."""
    counts, widths = (PARAMETERS[:2], WIDTHS[1:]) if quick else (PARAMETERS, WIDTHS)
    asked = [Question(*one) for one in product(counts, widths, RATES)]
    return [cell(method, one) for method in methods for one in asked]
