"""Methods of the literature, each against what it is known for."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from scipy import stats
from shoal.response import respond
from shoal.response.inputs import Inputs, UncertainParameter
from shoal.response.marginals import Interval, Normal
from shoal.response.methods import get_method
from shoal.response.runs import Answers, CachedModel
from shoal.response.statistics import QUANTILES
from shoal.response.study import Found, Study
from shoal.trajectory import Array
from shoal_validation.methods.maximum_entropy import entropic_quantiles
from shoal_validation.methods.polynomial_fits import sparse_grid


def made(method: str, function: object, parameters: int, **wanted: int | None) -> tuple[Found, CachedModel]:
    """What a method leaves of a function of so many intervals [-1, 1]."""
    names = [f"x{k}" for k in range(parameters)]

    def model(values: Mapping[str, Array]) -> Answers:
        found = function(np.stack([values[name] for name in names], axis=1))[:, None]  # type: ignore[operator]
        return Answers(found, np.ones(len(found), dtype=bool))

    inputs = Inputs(tuple(UncertainParameter(name, Interval(-1.0, 1.0), {name: 1.0}) for name in names))
    runs = CachedModel(model, inputs, 20_000)
    found = get_method(method)(Study(runs, np.zeros(1, dtype=np.int64), np.zeros(1), **wanted))  # type: ignore[arg-type]
    return found, runs


def error(found: Found, function: object, parameters: int) -> float:
    """The largest at random places."""
    places = np.random.default_rng(1).uniform(-1, 1, (2000, parameters))
    assert found.surrogate is not None
    return float(np.abs(found.surrogate(places)[:, 0] - function(places)).max())  # type: ignore[operator]


def quadratic(x: Array) -> Array:
    return np.asarray(1 + x @ [1.0, -2.0] + 3 * x[:, 0] * x[:, 1] + x[:, 1] ** 2)


def wave(x: Array) -> Array:
    return np.asarray(np.sin(x @ [1.3, 0.7] + 0.4))


def test_taylors_series_of_second_order_is_exact_for_quadratics() -> None:
    found, runs = made("taylor", quadratic, 2, degree=2)
    assert runs.evaluations == 6
    assert error(found, quadratic, 2) < 1e-10
    first, runs = made("taylor", quadratic, 2)
    assert runs.evaluations == 5
    assert error(first, quadratic, 2) > 1.0


@pytest.mark.parametrize(("order", "least"), [(1, 3.5), (2, 7.0)])
def test_halved_subintervals_divide_the_rest(order: int, least: float) -> None:
    """By four for first order, by eight for second order; each is continued from its own centre."""
    cell = 5 if order == 1 else 6
    errors = []
    for cut in (4, 8):
        found, runs = made("taylor", wave, 2, degree=order, count=cell * cut**2)
        assert runs.evaluations == cell * cut**2
        errors.append(error(found, wave, 2))
        assert found.surrogate is not None
        places = np.random.default_rng(2).uniform(-1, 1, (50, 2))
        assert found.surrogate.each(places, np.zeros(50, dtype=int)) == pytest.approx(found.surrogate(places)[:, 0])
    assert errors[0] / errors[1] > least


@pytest.mark.parametrize(
    ("parameters", "level", "count"),
    [(1, 3, 9), (2, 1, 5), (2, 2, 13), (2, 3, 29), (3, 2, 25), (3, 3, 69), (10, 2, 221)],
)
def test_sparse_grids_have_the_places_that_they_are_known_for(parameters: int, level: int, count: int) -> None:
    """Counts of nested Clenshaw-Curtis grids (Gerstner and Griebel, Numerical Algorithms 18, 1998)."""
    places, terms = sparse_grid(parameters, level)
    assert len(np.unique(np.round(places, 12), axis=0)) == count
    assert len(np.unique(terms, axis=0)) == count


def test_sparse_grids_interpolate_what_they_span() -> None:
    """x^4 y is of level 2 + 1, x^8 of level 3: exact with level 3, not with level 2; polynomials of total degree 3
    are exact with level 3 whatever their products.
    """

    def far(x: Array) -> Array:
        return np.asarray(x[:, 0] ** 4 * x[:, 1] + x[:, 1] ** 8)

    assert error(made("chebyshev-sparse", far, 2, degree=3)[0], far, 2) < 1e-12
    assert error(made("chebyshev-sparse", far, 2, degree=2)[0], far, 2) > 1e-2

    def cubic(x: Array) -> Array:
        return np.asarray((x @ [0.3, -1.0, 0.5, 0.7]) ** 3)

    found, runs = made("chebyshev-sparse", cubic, 4, degree=3)
    assert error(found, cubic, 4) < 1e-11
    assert runs.evaluations == 137


def test_total_degree_takes_few_of_the_zeros() -> None:
    """Exact for what it spans, with a share of the tensor's (degree + 1)^p runs."""

    def cubic(x: Array) -> Array:
        return np.asarray((x @ [0.3, -1.0, 0.5, 0.7]) ** 3)

    found, runs = made("chebyshev-total", cubic, 4, degree=3)
    assert error(found, cubic, 4) < 1e-11
    assert runs.evaluations == 53
    zeros = np.cos((np.arange(4) + 0.5) * np.pi / 4)
    assert np.abs(runs.xi[..., None] - zeros).min(axis=-1).max() < 1e-14


def test_density_of_greatest_entropy_with_two_moments_is_normal() -> None:
    x = stats.norm(3.0, 0.2).ppf((np.arange(20_000) + 0.5) / 20_000)
    found, missed = entropic_quantiles(x[:, None], 2)
    assert not missed.any()
    assert found[:, 0] == pytest.approx(stats.norm(3.0, 0.2).ppf(QUANTILES), abs=2e-4)


def test_density_of_greatest_entropy_with_two_hills() -> None:
    """Of exp(x^2 - x^4 / 4), which has the greatest entropy for its four moments: quantiles by quadrature."""
    grid = np.linspace(-5, 5, 200_001)
    density = np.exp(grid**2 - grid**4 / 4)
    passed = np.cumsum(density) / density.sum()
    x = np.interp((np.arange(20_000) + 0.5) / 20_000, passed, grid)
    found, missed = entropic_quantiles(x[:, None], 4)
    assert not missed.any()
    assert found[:, 0] == pytest.approx(np.interp(QUANTILES, passed, grid), abs=5e-3)
    # Two moments alone cannot tell of them.
    assert abs(entropic_quantiles(x[:, None], 2)[0][2, 0] - found[2, 0]) > 0.2


def test_the_method_of_greatest_entropy_tells_statistics() -> None:
    """exp(0.2 u), u normal: quantiles of a lognormal variable, with few runs."""

    def model(values: Mapping[str, Array]) -> Answers:
        found = np.exp(0.2 * values["u"])[:, None] * np.array([1.0, 0.0])
        return Answers(found, np.ones(len(found), dtype=bool))

    known = Inputs((UncertainParameter("u", Normal(0.0, 1.0), {"u": 1.0}),))
    found = respond(model, known, 2, method="maximum-entropy", count=512).statistics
    assert found is not None
    assert found.quantiles[:, 0] == pytest.approx(stats.lognorm(0.2).ppf(QUANTILES), rel=0.03)
    assert found.quantiles[:, 1] == pytest.approx(0.0)
