"""Time warp: the instants of turning points, and the course between them, as polynomials of the parameters.

At equal instants runs with different periods drift apart, and no polynomial of moderate degree separates them.
At equal phase they remain alike however long it lasts (Le Maitre, Mathelin, Knio and Hussaini, Asynchronous time
integration for polynomial chaos expansion of uncertain periodic dynamics, Discrete and Continuous Dynamical Systems 28,
2010; Mai and Sudret, Surrogate models for oscillatory systems using sparse polynomial chaos expansions and stochastic
time warping, SIAM/ASA Journal on Uncertainty Quantification 5, 2017). For one dominant frequency.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from shoal.response.expansion import fit
from shoal.response.inputs import Inputs, IntArray
from shoal.response.methods.long_time import (
    TooSlowError,
    UnsuitableError,
    Watch,
    at_every_instant,
    spline,
    stated,
    turning_points,
)
from shoal.response.polynomials import Terms
from shoal.response.study import Found, Study
from shoal.trajectory import Array

NODES = 20
"""Places between two turning points: a polynomial of one degree less interpolates the course there."""
MOST = 40_000_000
"""Numbers that a surrogate may consist of."""


@dataclass(frozen=True)
class Cycles:
    """Cycles of one run. turns: 0 and the instants of turning points [s], (turns + 1,); course: between them as
    coefficients of Chebyshev polynomials, (turns, NODES, signals)
    """

    turns: Array
    course: Array


@dataclass(frozen=True)
class Warped:
    """A surrogate by way of the phase.

    turns: coefficients, (terms, turns + 1); course: coefficients, (turns, NODES * terms, signals); instants [s]
    """

    inputs: Inputs
    terms: Terms
    turns: Array
    course: Array
    instants: Array

    def __call__(self, xi: Array) -> Array:
        """Return all columns, (places, columns)."""
        basis = self.inputs.basis(xi, self.terms)
        return at_every_instant(len(xi), len(self.instants), lambda at: self._at(basis, at))

    def each(self, xi: Array, columns: IntArray) -> Array:
        """Return one column at each place, (places,)."""
        signals = self.course.shape[2]
        answers = self._at(self.inputs.basis(xi, self.terms), columns // signals)
        return np.asarray(answers[np.arange(len(xi)), columns % signals])

    @cached_property
    def _by_turn(self) -> Array:
        return np.ascontiguousarray(self.turns.T)

    def _at(self, basis: Array, at: IntArray) -> Array:
        """Return all signals at one instant of each place, (places, signals)."""
        when, last = self.instants[at], self.turns.shape[1] - 1

        def begin(turn: IntArray) -> Array:
            return np.asarray(np.einsum("ij,ij->i", basis, self._by_turn[turn]))

        # The last turn that is not later, by bisection.
        turn, above = np.zeros(len(when), dtype=np.int64), np.full(len(when), last)
        for _ in range(last.bit_length()):
            middle = (turn + above) // 2
            earlier = begin(middle) <= when
            turn, above = np.where(earlier, middle, turn), np.where(earlier, above, middle)
        start = begin(turn)
        phase = 2 * (when - start) / (begin(turn + 1) - start) - 1
        within = np.polynomial.chebyshev.chebvander(phase, NODES - 1)
        answers = np.empty((len(when), self.course.shape[2]))
        order = np.argsort(turn, kind="stable")
        for some in np.split(order, np.flatnonzero(np.diff(turn[order])) + 1):
            products = (within[some, :, None] * basis[some, None, :]).reshape(len(some), -1)
            answers[some] = products @ self.course[turn[some[0]]]
        return answers


@dataclass(frozen=True)
class TimeWarp:
    """Representation of runs by turning points and the course between them, see `LongTime`."""

    watch: Watch
    name = "time warp"

    def of(self, course: Array) -> Cycles:
        """The cycles of one run."""
        whole = spline(self.watch.times, course)
        turns = turning_points(self.watch.times, spline(self.watch.times, course[:, self.watch.signal]))
        turns = np.concatenate([[0.0], turns])
        x = np.cos((np.arange(NODES) + 0.5) * np.pi / NODES)
        at = turns[:-1, None] + np.diff(turns)[:, None] * 0.5 * (1 + x)
        to_coefficients = np.linalg.inv(np.polynomial.chebyshev.chebvander(x, NODES - 1))
        return Cycles(turns, np.einsum("ij,kjs->kis", to_coefficients, whole(at)))

    def surrogate(self, study: Study, xi: Array, runs: list[Cycles], terms: Terms) -> Warped:
        """Fit turning points and courses. Raises UnsuitableError, TooSlowError."""
        turns = min(len(run.turns) for run in runs) - 1
        if turns * len(terms) * runs[0].course[0].size > MOST:
            raise UnsuitableError(f"{turns} turning points are too many")
        if min(run.turns[turns] for run in runs) <= study.when[-1]:
            raise TooSlowError
        answers = np.concatenate(
            [np.concatenate([run.turns[: turns + 1], run.course[:turns].ravel()])[None] for run in runs]
        )
        found = fit(study.inputs, xi, answers, terms).coefficients
        shape = len(terms), turns, NODES, runs[0].course.shape[2]
        course = np.moveaxis(found[:, turns + 1 :].reshape(shape), 0, 2)
        return Warped(
            study.inputs, terms, found[:, : turns + 1], course.reshape(turns, NODES * len(terms), -1), study.when
        )


def time_warp(study: Study) -> Found:
    """Bound by time warp. Raises InputError, also where the motion has no cycles that all runs share."""
    return stated(study, TimeWarp, "time-warp")
