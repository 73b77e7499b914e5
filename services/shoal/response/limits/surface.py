"""Response surface of the margins near a limit: weighted least squares of polynomials, chosen by leave-one-out errors.

It takes no runs, so that design points and samples of the failure domain can be sought on it, and it serves as the
control variate of importance sampling.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy import special

from shoal.response.inputs import Inputs, IntArray
from shoal.response.limits.margins import FAR, Margins, least
from shoal.response.marginals import Normal
from shoal.response.runs import Answers
from shoal.trajectory import Array

INSTANTS = 24
"""Instants of the surface at most: the first, the last and those that decide runs near the limit, evenly by how often
they do."""
DECIDING = 2
"""Of these instants, so many choose the terms."""
NEAR = 0.3
"""Share of the runs that count as near the limit; the weight of others falls with the square of their margin."""
PER_TERM = 1.5
"""Runs for every term, at least."""
DEGREES = 1, 2, 3, 5, 8, 12
"""Of the polynomials of each parameter alone that are tried, each with and without products of two parameters.

exp(1.2 x), the heaviest tail of the sums of lognormal variables in the tests, takes degree 8 to 12 over eight standard
deviations; with degree 5 at most 16 of 120 of these sums were in doubt, now none is.
"""
HIGHEST = 3
"""Degree of polynomials in the values of parameters, which are not scaled to a normal distribution."""
RIDGE = 1e-9
"""Of least squares, relative to the norm of each term: what keeps terms that are alike from cancelling."""
NOTHING = 1e-9
"""Of the margins near the limit: the least error that a surface is taken to have."""
UNLIKELY = 0.05
"""Probabilities of exceedance below this count as none: far from the limit many small ones would have large weights."""
BLOCK = 10_000
"""Places that are evaluated at once."""


@dataclass(frozen=True)
class SurfaceTerms:
    """Terms of a response surface.

    degree: of the polynomials of one parameter; products: whether there are those of two; scales: medians and standard
    deviations of the parameters' values, whose polynomials they are, (2, parameters); None for polynomials in the
    standard normal variables
    """

    inputs: Inputs
    degree: int
    products: bool
    scales: Array | None = None

    def __len__(self) -> int:
        count = len(self.inputs)
        return 1 + self.degree * count + (count * (count - 1) // 2 if self.products else 0)

    def __call__(self, places: Array) -> Array:
        """Return the terms at places of the standard normal space, (places, terms)."""
        x = np.clip(places, -FAR, FAR)
        if self.scales is not None:
            x = (self.inputs.named(self.inputs.standard(x)) - self.scales[0]) / self.scales[1]
        found, power = [np.ones((len(x), 1)), x], x
        for _ in range(1, self.degree):
            power = power * x
            found.append(power)
        if self.products:
            one, other = np.triu_indices(x.shape[1], 1)
            found.append(x[:, one] * x[:, other])
        return np.concatenate(found, axis=1)


@dataclass(frozen=True)
class Surface:
    """Margins at the instants that decide, as functions of the place.

    coefficients: (terms, instants); spread: leave-one-out error near the limit, (instants,); error: the largest of them
    as a share of the margins there
    """

    terms: SurfaceTerms
    coefficients: Array
    spread: Array
    error: float

    def __call__(self, places: Array) -> Array:
        """Return the margins at these places, (places, instants)."""
        blocks = range(0, max(len(places), 1), BLOCK)
        return np.concatenate([self.terms(places[k : k + BLOCK]) @ self.coefficients for k in blocks])

    def chances(self, places: Array) -> Array:
        """Return the probabilities that runs there exceed the limit, according to the surface, (places,)."""
        found = special.ndtr(-(self(places) / self.spread).min(axis=1))
        return np.where(found < UNLIKELY, 0.0, found)

    @property
    def margins(self) -> Margins:
        """The surface in the place of the model: margins that take no runs."""
        return _Surfaces(_no_model, self.terms.inputs, np.iinfo(np.int64).max, surface=self)


@dataclass
class _Surfaces(Margins):
    surface: Surface | None = None

    def __call__(self, places: Array) -> Array:
        assert self.surface is not None
        self.evaluations += len(places)
        return self.surface(places)


def _no_model(values: object) -> Answers:
    raise NotImplementedError


def fit_surface(inputs: Inputs, places: Array, rows: Array) -> Surface | None:
    """The response surface of these runs, (runs, parameters) and (runs, instants); None where they are too few."""
    good = np.isfinite(rows).all(axis=1)
    places, rows = places[good], rows[good]
    tried = [terms for terms in _candidates(inputs, places) if len(places) >= PER_TERM * len(terms)]
    if not tried:
        return None
    instants = _deciding(rows)
    few = instants[np.linspace(0, len(instants) - 1, min(DECIDING, len(instants))).round().astype(int)]
    near = [_near(rows[:, k]) for k in few]

    def error(terms: SurfaceTerms) -> float:
        basis = terms(places)
        return sum((_fit(basis, rows[:, k])[1] / size) ** 2 for k, size in zip(few, near, strict=True))

    terms = min(tried, key=error)
    basis = terms(places)
    fits = [_fit(basis, rows[:, k]) for k in instants]
    sizes = np.array([_near(rows[:, k]) for k in instants])
    spread = np.maximum([left for _, left in fits], NOTHING * sizes)
    return Surface(terms, np.stack([found for found, _ in fits], axis=1), spread, float((spread / sizes).max()))


def _candidates(inputs: Inputs, places: Array) -> Iterator[SurfaceTerms]:
    scales = [None]
    if any(not isinstance(one.marginal, Normal) or one.marginal.logarithmic for one in inputs.parameters):
        values = inputs.named(inputs.standard(places))
        scales.append(np.stack([np.median(values, axis=0), np.maximum(values.std(axis=0), 1e-300)]))  # type: ignore[arg-type]
    for scale in scales:
        for degree in DEGREES:
            if scale is None or degree <= HIGHEST:
                yield from (SurfaceTerms(inputs, degree, products, scale) for products in (False, True))


def _deciding(rows: Array) -> IntArray:
    """Return the instants that decide runs near the limit, in order."""
    count = rows.shape[1]
    if count <= INSTANTS:
        return np.arange(count)
    order = np.argsort(least(rows))[: max(int(NEAR * len(rows)), 1)]
    decide = np.sort(rows[order].argmin(axis=1))
    evenly = decide[np.linspace(0, len(decide) - 1, INSTANTS - 2).round().astype(int)]
    return np.unique([0, *evenly, count - 1])


def _near(margin: Array) -> float:
    return max(float(np.quantile(np.abs(margin), NEAR)), 1e-300)


def _fit(basis: Array, margin: Array) -> tuple[Array, float]:
    """Coefficients, (terms,), and the leave-one-out error of runs near the limit (Allen's PRESS)."""
    root = 1 / np.sqrt(1 + (margin / _near(margin)) ** 2)
    weighted = root[:, None] * basis
    size = np.maximum(np.linalg.norm(weighted, axis=0), 1e-300)
    q, r = np.linalg.qr(np.concatenate([weighted / size, RIDGE * np.eye(len(size))]))
    q = q[: len(margin)]
    projected = q.T @ (root * margin)
    left = (root * margin - q @ projected) / np.maximum(1 - (q**2).sum(axis=1), 1e-3)
    return np.linalg.solve(r, projected) / size, float(np.sqrt(np.sum((root * left) ** 2) / np.sum(root**4)))
