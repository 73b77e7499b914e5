"""Statistics beside those of chaospy and SALib, which share no code with them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import chaospy
import numpy as np
import pytest
from SALib.analyze import sobol as indices
from SALib.sample import sobol as saltelli
from scipy import stats
from shoal.response import respond
from shoal.response.inputs import Inputs, UncertainParameter
from shoal.response.marginals import Empirical, Frozen, Interval, Marginal, Normal, Uniform
from shoal.response.runs import Answers
from shoal.trajectory import Array

Function = Callable[[Array, Array, Array], Array]


def model(function: Function) -> Callable[[Mapping[str, Array]], Answers]:
    def answers(values: Mapping[str, Array]) -> Answers:
        found = function(values["a"], values["b"], values["c"])[:, None]
        return Answers(found, np.ones(len(found), dtype=bool))

    return answers


def inputs(*known: Marginal) -> Inputs:
    return Inputs(tuple(UncertainParameter(name, one, {name: 1.0}) for name, one in zip("abc", known, strict=True)))


def function(a: Array, b: Array, c: Array) -> Array:
    return np.asarray(np.exp(0.4 * a) + a * b**2 + np.sin(2 * c) * b)


@pytest.mark.slow
def test_chaos_beside_chaospys_pseudo_spectral_one() -> None:
    """Normal, uniform and beta parameters: moments and indices, by quadrature of order 9 there."""
    known = inputs(Normal(0.2, 0.8), Uniform(-1.0, 2.0), Frozen(stats.beta(2, 3, 0.5, 1.5)))
    theirs = chaospy.J(chaospy.Normal(0.2, 0.8), chaospy.Uniform(-1, 2), chaospy.Beta(2, 3, 0.5, 2.0))
    nodes, weights = chaospy.generate_quadrature(9, theirs, rule="gaussian")
    expansion = chaospy.generate_expansion(5, theirs)
    fitted = chaospy.fit_quadrature(expansion, nodes, weights, function(*nodes))
    found = respond(model(function), known, 1).statistics
    assert found is not None
    assert found.mean[0] == pytest.approx(float(chaospy.E(fitted, theirs)), abs=1e-4)
    assert found.std[0] == pytest.approx(float(chaospy.Std(fitted, theirs)), rel=2e-3)
    assert found.first[:, 0] == pytest.approx(chaospy.Sens_m(fitted, theirs), abs=2e-3)
    assert found.total[:, 0] == pytest.approx(chaospy.Sens_t(fitted, theirs), abs=2e-3)


@pytest.mark.parametrize("known", ["beta", "triangular", "truncated", "data"])
def test_bases_beside_chaospys(known: str) -> None:
    """Polynomials orthonormal under a measure: those of chaospy, by discretised Stieltjes there, but for their sign."""
    data = np.random.default_rng(4).gamma(3.0, 1.0, 400)
    pair: dict[str, tuple[Any, Any]] = {
        "beta": (Frozen(stats.beta(2, 3, 0.5, 1.5)), chaospy.Beta(2, 3, 0.5, 2.0)),
        "triangular": (Frozen(stats.triang(0.3, 1.0, 2.0)), chaospy.Triangle(1.0, 1.6, 3.0)),
        "truncated": (Frozen(stats.truncnorm(-1.0, 2.0, 2.0, 0.5)), chaospy.TruncNormal(1.5, 3.0, 2.0, 0.5)),
        "data": (Empirical(data), None),
    }
    ours, theirs = pair[known]
    x = ours.value(ours.quantile(np.linspace(0.05, 0.95, 7)))
    if theirs is None:
        # Of observations: Cholesky's factor of their moments (arbitrary polynomial chaos by its definition).
        middle, size = data.mean(), data.std()
        powers = np.vander((data - middle) / size, 5, increasing=True)
        factor = np.linalg.cholesky(powers.T @ powers / len(data))
        expected = np.linalg.solve(factor, np.vander((x - middle) / size, 5, increasing=True).T)
    else:
        expansion = chaospy.generate_expansion(4, theirs, normed=True)
        expected = np.array(expansion(x))
    found = ours.basis((x - ours._scale[0]) / ours._scale[1], 4).T
    assert np.abs(found) == pytest.approx(np.abs(expected), rel=2e-4, abs=2e-4)


def test_indices_beside_salibs() -> None:
    """Ishigami's function: SALib's estimates from 2^13 of its own samples, within the intervals that it states."""

    def ishigami(a: Array, b: Array, c: Array) -> Array:
        return np.asarray(np.sin(a) + 7 * np.sin(b) ** 2 + 0.1 * c**4 * np.sin(a))

    problem = {"num_vars": 3, "names": ["a", "b", "c"], "bounds": [[-np.pi, np.pi]] * 3}
    places = saltelli.sample(problem, 2**12, seed=1)
    theirs = indices.analyze(problem, ishigami(*places.T), seed=1)
    known = inputs(*[Uniform(-np.pi, np.pi)] * 3)
    found = respond(model(ishigami), known, 1, method="sobol", count=2**14).statistics
    assert found is not None
    for ours, name in ((found.first[:, 0], "S1"), (found.total[:, 0], "ST")):
        assert np.all(np.abs(ours - theirs[name]) < theirs[f"{name}_conf"] + 0.01)


def test_probability_boxes_beside_chaospys_quadrature() -> None:
    """Mean and deviation for 201 values of the interval, each by quadrature of order 20 there."""
    known = inputs(Interval(-1.0, 1.5), Uniform(-1.0, 2.0), Normal(0.3, 0.2))
    theirs = chaospy.J(chaospy.Uniform(-1, 2), chaospy.Normal(0.3, 0.2))
    nodes, weights = chaospy.generate_quadrature(20, theirs, rule="gaussian")
    values = np.array([function(np.full(nodes.shape[1], a), *nodes) for a in np.linspace(-1.0, 1.5, 201)])
    mean = values @ weights
    deviation = np.sqrt((values - mean[:, None]) ** 2 @ weights)
    found = respond(model(function), known, 1).boxes
    assert found is not None
    assert (found.mean.lower[0], found.mean.upper[0]) == pytest.approx((mean.min(), mean.max()), abs=1e-4)
    assert (found.std.lower[0], found.std.upper[0]) == pytest.approx((deviation.min(), deviation.max()), abs=1e-3)
