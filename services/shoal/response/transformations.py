"""Answers as functions of something simpler: the exponential of an expansion, or a function of one direction.

Directions are turned by Gauss-Newton steps, with the best polynomial along it at each (Hokanson and Constantine,
Data-driven polynomial ridge approximation using variable projection, SIAM Journal on Scientific Computing 40, 2018). A
transformation is taken in the columns that it predicts clearly better than the expansion itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol, Self

import numpy as np
from scipy.stats import qmc

from shoal.response.expansion import Expansion, fit, outermost, unexplained
from shoal.response.inputs import BoolArray, Inputs, IntArray, UncertainParameter, inside
from shoal.response.marginals import Marginal, Normal
from shoal.response.polynomials import Recurrence, of_measure, size, total_degree
from shoal.response.regularised import Decay, likeliest, regularised
from shoal.response.runs import CachedModel
from shoal.response.statistics import designs, jansen
from shoal.response.study import CLEARLY, CONVERGED, Other, Study
from shoal.trajectory import Array

Fitted = Callable[[Study], Expansion]
"""The expansion of a study."""


class Transformation(Other, Protocol):
    """A function of something simpler, in some columns; text: in words."""

    text: str

    @property
    def mean(self) -> Array:
        """Mean, (columns,)."""
        ...

    @property
    def variance(self) -> Array:
        """Variance, (columns,)."""
        ...

    @property
    def beyond(self) -> Array:
        """Part of the deviation that no run shows, (columns,)."""
        ...

    def some(self, which: BoolArray) -> Self:
        """Return the transformation of some columns, (columns,)."""
        ...

    def again(self, study: Study, fitted: Fitted) -> Self:
        """Fit a transformation of the same kind to other runs of the same columns."""
        ...


def columns_of(study: Study, columns: IntArray) -> Study:
    """Return the study of these columns alone."""
    return with_answers(study, study.inputs, study.runs.xi, study.runs.values[:, columns])


def with_answers(study: Study, inputs: Inputs, xi: Array, values: Array) -> Study:
    """Return a study with other answers."""
    return replace(study, runs=CachedModel.known(study.runs.model, inputs, xi, values))


NODES, REACH = 2**13, 9.0
"""Of quadratures over one parameter, and how far they go over a normal variable."""
SPAN, NOWHERE = 16.0, 1e-15
"""Deviations that the grid of a linear combination goes to either side; a density that is rounding."""


def nodes(inputs: Inputs, k: int, reach: float) -> tuple[Array, Array]:
    """Germs of one parameter and their weights, (nodes,) each; denser towards its ends where it is not normal."""
    if inputs.unbounded[k]:
        xi = np.linspace(-reach, reach, NODES)
        weights = np.exp(-0.5 * xi**2)
    else:
        angle = np.pi * ((np.arange(NODES) + 0.5) / NODES - 0.5)
        xi = inputs.quantiles(np.tile(0.5 + 0.5 * np.sin(angle)[:, None], len(inputs)))[:, k]
        weights = np.cos(angle)
    return xi, weights / weights.sum()


@dataclass(frozen=True)
class Combined:
    """The distribution of a linear combination: places on a grid and their probabilities, (places,) each."""

    places: Array
    weights: Array
    text: str = ""
    random = True

    @cached_property
    def basis(self) -> Recurrence:
        """Orthonormal over these places."""
        return of_measure(self.places, self.weights)

    @property
    def tolerance(self) -> float:
        """The standard deviation."""
        return float(np.sqrt(self.weights @ self.places**2))

    def quantile(self, x: Array) -> Array:
        """The place."""
        return np.interp(x, np.cumsum(self.weights), self.places)

    def value(self, s: Array) -> Array:
        """The place."""
        return s


def combined(inputs: Inputs, way: Array) -> Combined:
    """Combine standardised variables: convolution of their distributions on a grid."""
    grid, step = np.linspace(-SPAN, SPAN, NODES, endpoint=False, retstep=True)
    spectrum = np.ones(NODES // 2 + 1, dtype=complex)
    for k, part in enumerate(way):
        xi, weights = nodes(inputs, k, REACH)
        # Each node is shared between its neighbours on the grid, which keeps the mean.
        at = np.clip(part * inputs.polynomials(k, xi, 1)[:, 1] / step, 1 - NODES / 2, NODES / 2 - 2)
        left = np.floor(at).astype(int)
        shared = np.zeros(NODES)
        np.add.at(shared, left % NODES, weights * (left + 1 - at))
        np.add.at(shared, (left + 1) % NODES, weights * (at - left))
        spectrum *= np.fft.rfft(shared)
    density = np.fft.fftshift(np.fft.irfft(spectrum, NODES))
    there = density > NOWHERE
    weights = density[there] / density[there].sum()
    # Sharing adds a little to the deviation, which is 1.
    return Combined(grid[there] / np.sqrt(weights @ grid[there] ** 2), weights)


SAMPLED = 2**13
"""Quasi-random places for moments without a closed form and, for every parameter, for Sobol's indices."""
REACHED = 5.0
"""Deviations of a normal variable; what is further out no run shows."""
BEYOND = 1e-3
"""Share of the deviation that may lie there."""


@dataclass(frozen=True)
class Exponential:
    """exp of an expansion, with a sign, (columns,); seed: of what is sampled."""

    logarithm: Expansion
    signs: Array
    seed: int
    text = "an expansion of their logarithm"

    def __call__(self, xi: Array) -> Array:
        """Return the answers, (places, columns)."""
        return np.asarray(self.signs * np.exp(self.logarithm(xi)))

    def again(self, study: Study, fitted: Fitted) -> Exponential:
        """Fit to other runs."""
        return _exponential(study, fitted)

    @property
    def mean(self) -> Array:
        """Mean, (columns,)."""
        return np.asarray(self.signs * self._moments[0])

    @property
    def variance(self) -> Array:
        """Variance, (columns,)."""
        return self._moments[1]

    @property
    def beyond(self) -> Array:
        """Contribution of places far out along a parameter, (columns,), if it is not negligible."""
        whole, near = (np.sqrt(second / first**2 - 1) for first, second in map(self._products, (REACH, REACHED)))
        apart = np.sqrt(self.variance) * np.abs(1 - np.divide(near, whole, out=np.ones_like(near), where=whole > 0))
        return np.where(apart > BEYOND * np.sqrt(self.variance), apart, 0.0)

    def some(self, which: BoolArray) -> Exponential:
        """Return some of the columns."""
        of = self.logarithm
        squares = None if of.squares is None else of.squares[which]
        logarithm = replace(of, coefficients=of.coefficients[:, which], left_out=of.left_out[which], squares=squares)
        return Exponential(logarithm, self.signs[which], self.seed)

    def indices(self) -> Array:
        """Return indices in closed form for the functions of one parameter each; products are sampled."""
        inputs, (first, second) = self.logarithm.inputs, self._parts(REACH)
        own = second / first**2
        whole = np.prod(own, axis=0)
        variance = np.maximum(whole - 1, 1e-300)
        found = np.array([(own - 1) / variance, 1 - (whole / own - 1) / variance])
        if self._cross.any():
            places = designs(inputs, SAMPLED, self.seed)
            parts = [self._split(part) for part in np.split(places, len(inputs) + 2)]
            alone, together = (np.concatenate(one) for one in zip(*parts, strict=True))
            found += jansen(together, len(inputs)) - jansen(alone, len(inputs))
        return found

    @cached_property
    def _moments(self) -> tuple[Array, Array]:
        """Mean and variance without the sign."""
        first, second = self._products(REACH)
        if self._cross.any():
            first, second = first * self._others(1), second * self._others(2)
        size = np.exp(self.logarithm.coefficients[0])
        return size * first, size**2 * np.maximum(second - first**2, 0.0)

    def _products(self, reach: float) -> Array:
        """Mean and mean square of the exponential of all functions of one parameter, (2, columns)."""
        return np.asarray(np.prod(self._parts(reach), axis=1))

    def _others(self, order: int) -> Array:
        """Return the factor of terms of several parameters in the mean of this power, (columns,).

        It is sampled where the functions of one parameter have most of that mean.
        """
        of, found = self.logarithm, np.empty(len(self.signs))
        x = inside(qmc.Sobol(len(of.inputs), rng=self.seed).random(SAMPLED))
        plain = of.inputs.quantiles(x)
        for column in range(len(found)):
            xi = plain.copy()
            for k in range(len(of.inputs)):
                if (own := self._own(k)).any():
                    at, weights = nodes(of.inputs, k, REACH)
                    weights = weights * np.exp(order * self._basis(k, at) @ of.coefficients[own, column])
                    # The middle of each step, so that places lie on either side of its node.
                    xi[:, k] = np.interp(x[:, k], (np.cumsum(weights) - 0.5 * weights) / weights.sum(), at)
            cross = of.inputs.basis(xi, of.terms[self._cross]) @ of.coefficients[self._cross, column]
            found[column] = np.exp(order * cross).mean()
        return found

    def _parts(self, reach: float) -> Array:
        """Mean and mean square of the exponentials of the functions of one parameter, (2, parameters, columns)."""
        inputs = self.logarithm.inputs
        found = np.ones((2, len(inputs), len(self.signs)))
        for k in range(len(inputs)):
            if (own := self._own(k)).any():
                xi, weights = nodes(inputs, k, reach)
                part = np.exp(self._basis(k, xi) @ self.logarithm.coefficients[own])
                found[:, k] = weights @ part, weights @ part**2
        return found

    def _own(self, k: int) -> BoolArray:
        """Terms of parameter k alone."""
        return np.asarray(self._alone & (self.logarithm.terms[:, k] > 0))

    def _basis(self, k: int, xi: Array) -> Array:
        """Polynomials of these terms at standardised variables of parameter k, (standardised variables, terms)."""
        degrees = self.logarithm.terms[self._own(k), k]
        return self.logarithm.inputs.polynomials(k, xi, int(degrees.max()))[:, degrees]

    def _split(self, places: Array) -> tuple[Array, Array]:
        """The exponential of the functions of one parameter, and of all but the constant, (places, columns) each."""
        of = self.logarithm
        alone, cross = (
            of.inputs.basis(places, of.terms[which]) @ of.coefficients[which] for which in (self._alone, self._cross)
        )
        return np.exp(alone), np.exp(alone + cross)

    @property
    def _alone(self) -> BoolArray:
        """Terms of one parameter."""
        return np.asarray((self.logarithm.terms > 0).sum(axis=1) == 1)

    @property
    def _cross(self) -> BoolArray:
        """Terms of several."""
        return np.asarray((self.logarithm.terms > 0).sum(axis=1) > 1)


def _exponential(study: Study, fitted: Fitted) -> Exponential:
    values = study.runs.values
    logarithms = with_answers(study, study.inputs, study.runs.xi, np.log(np.abs(values)))
    return Exponential(fitted(logarithms), np.sign(values[0]), len(values))


def exponentials(
    study: Study, found: Expansion, wanted: IntArray, fitted: Fitted
) -> Sequence[tuple[IntArray, Exponential]]:
    """Return exponentials of the columns with one sign."""
    values = study.runs.values[:, wanted]
    columns = wanted[(values > 0).all(axis=0) | (values < 0).all(axis=0)]
    return [(columns, _exponential(columns_of(study, columns), fitted))] if len(columns) else []


FAILURES = 6
"""Columns in which no ridge is found, after which none is looked for in others."""
ALONG_DEGREES = 3, 6, 10, 15
"""Along a direction while it is turned."""
TURNS = 12
"""In which it is turned at each degree, at most."""


@dataclass(frozen=True)
class Ridge:
    """Ridge function: one column as an expansion along a direction of the standardised variables.

    way: the direction, of length 1, (parameters,); decay: of the coefficients, where that is what holds them
    """

    inputs: Inputs
    way: Array
    along: Expansion
    decay: Decay | None = None
    text = "a function of one direction"

    def __call__(self, xi: Array) -> Array:
        """Return the answers, (places, 1)."""
        return self.along((_standardised(self.inputs, xi) @ self.way)[:, None])

    def again(self, study: Study, fitted: Fitted) -> Ridge:
        """Fit to other runs."""
        return _ridge(study, fitted, _turned_best(study, [self.way])[0], self.decay)

    @property
    def mean(self) -> Array:
        """Mean, (1,)."""
        return self.along.mean

    @property
    def variance(self) -> Array:
        """Variance, (1,)."""
        return self.along.variance

    def indices(self) -> Array:
        """Return indices in closed form for normal variables, by Mehler's formula, else sampled."""
        inputs = self.inputs
        if not inputs.unbounded.all():
            places = designs(inputs, SAMPLED, len(self.along.terms))
            return jansen(self(places), len(inputs))
        degrees, parts = self.along.terms[1:, 0], self.along.coefficients[1:, 0] ** 2 / self.along.variance
        own = self.way[:, None] ** 2
        return np.array([own**degrees @ parts, 1 - (1 - own) ** degrees @ parts])[:, :, None]

    def some(self, which: BoolArray) -> Ridge:
        """Return itself: there is one column."""
        return self

    @property
    def beyond(self) -> Array:
        """The expansion's own error, which includes it, (1,)."""
        return self.along.left_out


def _turned_best(study: Study, ways: Sequence[Array]) -> tuple[Array, float]:
    """Turn the best of some directions; also returns the root-mean-square residual of polynomials along it."""
    z, y, found = _standardised(study.inputs, study.runs.xi), study.runs.values[:, 0], []
    for way in ways:
        turned = way / np.linalg.norm(way)
        for degree in ALONG_DEGREES:
            turned, rest = _turned(z, y, turned, degree)
        found.append((turned, float(np.sqrt(rest / len(z)))))
    return min(found, key=lambda one: one[1])


def _ridge(study: Study, fitted: Fitted, way: Array, decay: Decay | None = None) -> Ridge:
    """Along this direction."""
    inputs, values = study.inputs, study.runs.values
    marginal: Marginal = Normal(0.0, 1.0) if inputs.unbounded.all() else combined(inputs, way)
    one = Inputs((UncertainParameter("along", marginal, {}),))
    places = (_standardised(inputs, study.runs.xi) @ way)[:, None]
    along = fitted(with_answers(study, one, places, values))
    if decay is None and along.left_out[0] > CONVERGED * values.std():
        decay = likeliest(one, places, values[:, 0])
    if decay is not None:
        held = regularised(one, places, values, decay)
        along = held if held.left_out[0] < along.left_out[0] else along
    return Ridge(inputs, way, along, decay)


def _turned(z: Array, y: Array, way: Array, degree: int) -> tuple[Array, float]:
    """The direction, and what polynomials along it leave of the answers, by Gauss-Newton steps."""
    rest, step = _rest(z, y, way, degree)
    for _ in range(TURNS):
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
    """Return the sum of squared residuals of polynomials along a direction, and the Gauss-Newton step."""
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


def _standardised(inputs: Inputs, xi: Array) -> Array:
    """Return variables of mean 0 and deviation 1, both (runs, parameters)."""
    return np.stack([inputs.polynomials(k, xi[:, k], 1)[:, 1] for k in range(len(inputs))], axis=1)


def ridges(study: Study, found: Expansion, wanted: IntArray, fitted: Fitted) -> Sequence[tuple[IntArray, Ridge]]:
    """Return ridge functions of one column each, the columns that the expansion predicts worst first."""
    inputs, runs = study.inputs, study.runs
    if len(inputs) == 1 or len(runs.xi) < 2 * (len(inputs) + ALONG_DEGREES[-1]):
        return []
    known = [fit(inputs, runs.xi, runs.values, total_degree(len(inputs), 1)), found]
    if size(len(inputs), 2) < len(runs.xi):
        known.append(fit(inputs, runs.xi, runs.values, total_degree(len(inputs), 2)))
    slopes, made, failures = [_slopes(one, runs.xi) for one in known], [], 0
    for column in wanted[np.argsort(-found.left_out[wanted], kind="stable")]:
        # The direction in which each of these expansions changes most (Constantine, Active Subspaces, 2015).
        ways = [np.linalg.eigh(one[:, :, column].T @ one[:, :, column])[1][:, -1] for one in slopes]
        columns, most = np.array([column]), CLEARLY * found.left_out[column]
        alone = columns_of(study, columns)
        way, rest = _turned_best(alone, ways)
        one = _ridge(alone, fitted, way) if rest < most else None
        if one is not None and one.along.left_out[0] < most:
            made.append((columns, one))
        else:
            failures += 1
        if failures == FAILURES:
            break
    return made


def _slopes(found: Expansion, xi: Array) -> Array:
    """Return slopes by every standardised variable, (runs, parameters, columns)."""
    inputs, h = found.inputs, 1e-5
    at, slopes = found(xi), []
    for k in range(len(inputs)):
        moved = xi.copy()
        moved[:, k] += h
        width = h * np.diff(inputs.polynomials(k, np.array([0.0, 1.0]), 1)[:, 1])[0]
        slopes.append((found(moved) - at) / width)
    return np.stack(slopes, axis=1)


FOLDS = 5
"""Parts of the runs that are left out in turn, beside the outermost ones."""
Kind = Callable[[Study, Expansion, IntArray, Fitted], Sequence[tuple[IntArray, Transformation]]]
KINDS: list[Kind] = [exponentials, ridges]
"""In which the answers are functions of something simpler."""


@dataclass(frozen=True)
class Transformed:
    """Expansion, and transformations that predict some columns better.

    links: the columns, (n,), and their transformations; left_out, squares: as those of `Expansion`
    """

    plain: Expansion
    links: tuple[tuple[IntArray, Transformation], ...]
    left_out: Array
    squares: Array

    @property
    def mean(self) -> Array:
        """Mean over all parameters, (columns,)."""
        found = self.plain.mean.copy()
        for columns, link in self.links:
            found[columns] = link.mean
        return found

    @property
    def variance(self) -> Array:
        """Variance over all parameters, (columns,)."""
        found = self.plain.variance.copy()
        for columns, link in self.links:
            found[columns] = link.variance
        return found

    def again(self, study: Study, fitted: Fitted, simply: Fitted) -> Transformed:
        """The same links for other runs; fitted: the expansion, simply: those within links."""
        links = tuple((columns, link.again(columns_of(study, columns), simply)) for columns, link in self.links)
        all_of_them = sum(len(columns) for columns, _ in links) == len(self.left_out)
        return replace(self, plain=(simply if all_of_them else fitted)(study), links=links)

    @property
    def why(self) -> str:
        """Description of the columns that are transformed."""
        texts = dict.fromkeys(link.text for _, link in self.links)
        counts = {text: sum(len(which) for which, link in self.links if link.text == text) for text in texts}
        return "".join(f"; {count} of {len(self.left_out)} answers by {text}" for text, count in counts.items())


def untransformed(found: Expansion) -> Transformed:
    """An expansion without links."""
    squares = found.left_out if found.squares is None else found.squares
    return Transformed(found, (), found.left_out, squares)


def transformed(study: Study, found: Expansion, wanted: BoolArray, fitted: Fitted) -> Transformed:
    """Transform those of the wanted columns, (columns,), that are predicted clearly better so."""
    plain_first = untransformed(found)
    for kind in KINDS:
        for columns, link in kind(study, found, np.flatnonzero(wanted), fitted):
            plain_first = _better(study, plain_first, columns, link, fitted)
    return plain_first


def compared(plain_first: Transformed, found: Expansion) -> Transformed:
    """The links where they are still clearly better than another expansion."""
    return _with(untransformed(found), plain_first.links, plain_first.left_out, plain_first.squares)


def _better(
    study: Study, plain_first: Transformed, columns: IntArray, link: Transformation, fitted: Fitted
) -> Transformed:
    """Apply a transformation in those of these columns in which it is clearly better."""
    part, left_out, squares = (
        columns_of(study, columns),
        np.full(len(plain_first.left_out), np.inf),
        plain_first.squares.copy(),
    )
    with np.errstate(all="ignore"):
        missed, outer = _missed(part, link, fitted)
        found, squares[columns] = unexplained(part.runs.values, missed)
        sound = np.isfinite(link.mean) & np.isfinite(link.variance)
        left_out[columns] = np.where(sound, np.maximum(np.maximum(found, outer), link.beyond), np.inf)
    return _with(plain_first, [(columns, link)], left_out, squares)


def _with(
    plain_first: Transformed, links: Iterable[tuple[IntArray, Transformation]], left_out: Array, squares: Array
) -> Transformed:
    """Apply transformations where their error, (columns,), is clearly smaller."""
    better = left_out < CLEARLY * plain_first.left_out
    kept = [*_columns_where(plain_first.links, ~better), *_columns_where(links, better)]
    left_out, squares = (
        np.where(better, *pair) for pair in ((left_out, plain_first.left_out), (squares, plain_first.squares))
    )
    return Transformed(plain_first.plain, tuple(kept), left_out, squares)


def _columns_where(
    links: Iterable[tuple[IntArray, Transformation]], wanted: BoolArray
) -> Iterator[tuple[IntArray, Transformation]]:
    """Yield transformations of those of their columns that are wanted, (columns,)."""
    for columns, link in links:
        which = wanted[columns]
        if which.any():
            yield columns[which], link.some(which)


def _missed(study: Study, link: Transformation, fitted: Fitted) -> tuple[Array, Array]:
    """Return leave-out errors of each run, (runs, columns), and the error of the outermost ones, (columns,)."""
    runs = study.runs
    missed = np.empty_like(runs.values)
    for left in np.array_split(np.arange(len(missed)), FOLDS):
        missed[left] = _prediction_errors(study, link, fitted, left)
    outer = np.flatnonzero(outermost(study.inputs, runs.xi))
    beyond = _prediction_errors(study, link, fitted, outer) if len(outer) else np.zeros((0, missed.shape[1]))
    return missed, np.sqrt((beyond**2).sum(axis=0) / len(missed))


def _prediction_errors(study: Study, link: Transformation, fitted: Fitted, left: IntArray) -> Array:
    """Return the errors of a fit without these runs in predicting them."""
    kept = np.ones(len(study.runs.xi), dtype=bool)
    kept[left] = False
    other = link.again(replace(study, runs=study.runs.part(kept)), fitted)
    return np.asarray(study.runs.values[left] - other(study.runs.xi[left]))
