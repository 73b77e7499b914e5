"""Functions of one direction of the parameters.

The direction is turned by Gauss-Newton steps, with the best polynomial along it at each (Hokanson and Constantine,
Data-driven polynomial ridge approximation using variable projection, SIAM Journal on Scientific Computing 40, 2018).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from shoal.response.expansion import Expansion, fit
from shoal.response.indices import designs, jansen
from shoal.response.inputs import BoolArray, Inputs, IntArray, UncertainParameter
from shoal.response.links.combined import combined
from shoal.response.links.link import CLEARLY, Fitted, of, some
from shoal.response.marginals import Marginal, Normal
from shoal.response.polynomials import of_measure, size, total_degree
from shoal.response.regularised import Decay, likeliest, regularised
from shoal.response.study import Study
from shoal.trajectory import Array

FINE = 1e-4
"""Error, as a share of the deviation, above which coefficients along a direction are held as well."""
FAILURES = 6
"""Columns in which no ridge is found, after which none is looked for in others."""
DRAWN = 2**13
"""Places at which shares are sampled, for every parameter."""
DEGREES = 3, 6, 10, 15
"""Along a direction while it is turned."""
ROUNDS = 12
"""In which it is turned at each degree, at most."""


@dataclass(frozen=True)
class Ridge:
    """One column as an expansion along a direction of the standardised germs.

    way: the direction, of length 1, (parameters,); decay: of the coefficients, where that is what holds them
    """

    inputs: Inputs
    way: Array
    along: Expansion
    decay: Decay | None = None
    text = "a function of one direction"

    def __call__(self, germs: Array) -> Array:
        """(places, 1)."""
        return self.along((_standardised(self.inputs, germs) @ self.way)[:, None])

    def again(self, study: Study, fitted: Fitted) -> Ridge:
        """For other runs."""
        return _ridge(study, fitted, _turned_best(study, [self.way])[0], self.decay)

    @property
    def mean(self) -> Array:
        """(1,)."""
        return self.along.mean

    @property
    def variance(self) -> Array:
        """(1,)."""
        return self.along.variance

    def indices(self) -> Array:
        """In closed form for normal variables, by Mehler's formula, else sampled."""
        inputs = self.inputs
        if not inputs.unbounded.all():
            places = designs(inputs, DRAWN, len(self.along.terms))
            return jansen(self(places), len(inputs))
        degrees, parts = self.along.terms[1:, 0], self.along.coefficients[1:, 0] ** 2 / self.along.variance
        own = self.way[:, None] ** 2
        return np.array([own**degrees @ parts, 1 - (1 - own) ** degrees @ parts])[:, :, None]

    def some(self, which: BoolArray) -> Ridge:
        """It has one column."""
        return self

    @property
    def beyond(self) -> Array:
        """The expansion's own error, which tells of it, (1,)."""
        return self.along.left_out


def _turned_best(study: Study, ways: Sequence[Array]) -> tuple[Array, float]:
    """From the best of some directions, and what polynomials along it leave of the answers, root of the mean square."""
    z, y, found = _standardised(study.inputs, study.runs.germs), study.runs.values[:, 0], []
    for way in ways:
        turned = way / np.linalg.norm(way)
        for degree in DEGREES:
            turned, rest = _turned(z, y, turned, degree)
        found.append((turned, float(np.sqrt(rest / len(z)))))
    return min(found, key=lambda one: one[1])


def _ridge(study: Study, fitted: Fitted, way: Array, decay: Decay | None = None) -> Ridge:
    """Along this direction."""
    inputs, values = study.inputs, study.runs.values
    marginal: Marginal = Normal(0.0, 1.0) if inputs.unbounded.all() else combined(inputs, way)
    one = Inputs((UncertainParameter("along", marginal, {}),))
    places = (_standardised(inputs, study.runs.germs) @ way)[:, None]
    along = fitted(of(study, one, places, values))
    if decay is None and along.left_out[0] > FINE * values.std():
        decay = likeliest(one, places, values[:, 0])
    if decay is not None:
        held = regularised(one, places, values, decay)
        along = held if held.left_out[0] < along.left_out[0] else along
    return Ridge(inputs, way, along, decay)


def _turned(z: Array, y: Array, way: Array, degree: int) -> tuple[Array, float]:
    """The direction, and what polynomials along it leave of the answers, by Gauss-Newton steps."""
    rest, step = _rest(z, y, way, degree)
    for _ in range(ROUNDS):
        for part in 1.0, 0.5, 0.25, 0.1:
            tried = way + part * step
            tried /= np.linalg.norm(tried)
            found = _rest(z, y, tried, degree)
            if found[0] < rest:
                break
        else:
            break
        slow = found[0] > 0.99 * rest
        way, (rest, step) = tried, found
        if slow:
            break
    return way, rest


def _rest(z: Array, y: Array, way: Array, degree: int) -> tuple[float, Array]:
    """What polynomials along this direction leave, sum of squares, and the step that should leave least."""
    u, runs = z @ way, len(y)
    polynomials = of_measure(u, np.full(runs, 1 / runs))
    basis = polynomials(u, degree)
    coefficients = basis.T @ y / runs
    missed = y - basis @ coefficients
    h = 1e-5
    slope = (polynomials(u + h, degree) - polynomials(u - h, degree)) @ coefficients / (2 * h)
    moves = slope[:, None] * (z - np.outer(u, way))
    moves -= basis @ (basis.T @ moves) / runs
    step = np.linalg.lstsq(moves, missed, rcond=1e-8)[0]
    return float(missed @ missed), step - (step @ way) * way


def _standardised(inputs: Inputs, germs: Array) -> Array:
    """With mean 0 and deviation 1, both (runs, parameters)."""
    return np.stack([inputs.polynomials(k, germs[:, k], 1)[:, 1] for k in range(len(inputs))], axis=1)


def ridges(study: Study, found: Expansion, wanted: IntArray, fitted: Fitted) -> Sequence[tuple[IntArray, Ridge]]:
    """Of one column each, those that the expansion tells worst first."""
    inputs, runs = study.inputs, study.runs
    if len(inputs) == 1 or len(runs.germs) < 2 * (len(inputs) + DEGREES[-1]):
        return []
    known = [fit(inputs, runs.germs, runs.values, total_degree(len(inputs), 1)), found]
    if size(len(inputs), 2) < len(runs.germs):
        known.append(fit(inputs, runs.germs, runs.values, total_degree(len(inputs), 2)))
    slopes, made, failures = [_slopes(one, runs.germs) for one in known], [], 0
    for column in wanted[np.argsort(-found.left_out[wanted], kind="stable")]:
        # The direction in which each of these expansions changes most (Constantine, Active Subspaces, 2015).
        ways = [np.linalg.eigh(one[:, :, column].T @ one[:, :, column])[1][:, -1] for one in slopes]
        columns, most = np.array([column]), CLEARLY * found.left_out[column]
        alone = some(study, columns)
        way, rest = _turned_best(alone, ways)
        one = _ridge(alone, fitted, way) if rest < most else None
        if one is not None and one.along.left_out[0] < most:
            made.append((columns, one))
        else:
            failures += 1
        if failures == FAILURES:
            break
    return made


def _slopes(found: Expansion, germs: Array) -> Array:
    """By every standardised germ, (runs, parameters, columns)."""
    inputs, h = found.inputs, 1e-5
    at, slopes = found(germs), []
    for k in range(len(inputs)):
        moved = germs.copy()
        moved[:, k] += h
        width = h * np.diff(inputs.polynomials(k, np.array([0.0, 1.0]), 1)[:, 1])[0]
        slopes.append((found(moved) - at) / width)
    return np.stack(slopes, axis=1)
