"""Gauss quadrature of smooth answers of one or two random parameters, against closed forms."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping

import numpy as np
import pytest
from scipy import integrate, stats
from shoal.response import respond
from shoal.response.inputs import Inputs, UncertainParameter
from shoal.response.marginals import Frozen, Marginal, Normal, Uniform
from shoal.response.methods.quadrature import gauss, quadrature
from shoal.response.polynomials import HERMITE
from shoal.response.respond import ModelResponse
from shoal.response.runs import Answers, CachedModel
from shoal.response.study import Study
from shoal.trajectory import Array


def asked(function: Callable[..., Array], *known: Marginal, limit: float = np.inf) -> ModelResponse:
    names = "xy"[: len(known)]

    def model(values: Mapping[str, Array]) -> Answers:
        given = [values[name] for name in names]
        good = np.all(np.abs(given) < limit, axis=0)
        return Answers(function(*given)[:, None], good)

    inputs = Inputs(tuple(UncertainParameter(name, one, {name: 1.0}) for name, one in zip(names, known, strict=True)))
    return respond(model, inputs, 1)


def moments(function: Callable[[float], float], density: Callable[[float], float]) -> tuple[float, float]:
    edges = (-9.0, -1.0, 0.0, 1.0, 1.5, 9.0)
    first, second = (
        sum(
            integrate.quad(lambda x, k=k: function(x) ** k * density(x), *ends)[0] for ends in itertools.pairwise(edges)
        )
        for k in (1, 2)
    )
    return first, float(np.sqrt(second - first**2))


def test_the_rule_is_that_of_numpy() -> None:
    nodes, weights = gauss(HERMITE, 40)
    expected, others = np.polynomial.hermite_e.hermegauss(40)
    assert nodes == pytest.approx(expected, abs=1e-11)
    assert weights == pytest.approx(others / others.sum(), abs=1e-14)


@pytest.mark.parametrize("phase", [0.3, 1.0, 6.0, 6.26, 15.0])
def test_a_turning_rod_takes_few_runs(phase: float) -> None:
    """E cos(a + s z) = cos a exp(-s^2 / 2) for a rate that is normal."""
    answer = asked(lambda x: np.cos(0.7 + phase * x), Normal(0.0, 1.0))
    told = answer.statistics
    assert told is not None
    mean = np.cos(0.7) * np.exp(-(phase**2) / 2)
    square = 0.5 * (1 + np.cos(1.4) * np.exp(-2 * phase**2))
    assert told.mean[0] == pytest.approx(mean, abs=1e-6)
    assert told.std[0] == pytest.approx(np.sqrt(square - mean**2), rel=1e-5)
    assert "Gauss quadrature" in answer.found.why
    assert answer.runs.evaluations <= 520


@pytest.mark.parametrize("seed", range(6))
def test_random_smooth_functions(seed: int) -> None:
    random = np.random.default_rng(seed)
    a, b, c = random.uniform(0.2, 1.5, 3)

    def function(x: Array) -> Array:
        return np.asarray(np.exp(a * np.tanh(x)) * np.sin(b * x + c))

    known: list[tuple[Marginal, Callable[[float], float]]] = [
        (Normal(0.0, 1.0), lambda x: float(stats.norm.pdf(x))),
        (Uniform(-1.0, 1.5), lambda x: 0.4 if -1 <= x <= 1.5 else 0.0),
        (Frozen(stats.beta(2, 3)), lambda x: float(stats.beta(2, 3).pdf(x))),
    ]
    marginal, density = known[seed % 3]
    told = asked(function, marginal).statistics
    mean, std = moments(lambda x: float(function(np.array(x))), density)
    assert told is not None
    assert abs(told.mean[0] - mean) <= told.error[0] + 1e-4 * std
    assert abs(told.std[0] - std) <= told.std_error[0] + 1e-4 * std


def test_two_parameters() -> None:
    """E x^2 y for independent ones, and Sobol's indices of a sum of squares."""
    told = asked(lambda x, y: x**2 * np.exp(y / 2), Normal(0.5, 1.0), Normal(0.0, 1.0)).statistics
    assert told is not None
    assert told.mean[0] == pytest.approx(1.25 * np.exp(1 / 8), rel=1e-6)
    both = asked(lambda x, y: x**2 + 2 * y, Normal(0.0, 1.0), Normal(0.0, 1.0)).statistics
    assert both is not None
    assert both.first[:, 0] == pytest.approx([2 / 6, 4 / 6], rel=1e-6)


def test_what_is_not_smooth_is_left_to_others() -> None:
    """A step, and a band that few points meet: drawn runs see both."""
    inputs = Inputs((UncertainParameter("x", Normal(0.0, 1.0), {"x": 1.0}),))
    for function in (lambda x: 1.0 * (x > 0.4), lambda x: x + 1.0 * (np.abs(x - 0.31) < 0.08)):

        def model(values: Mapping[str, Array], function: Callable[[Array], Array] = function) -> Answers:
            return Answers(function(values["x"])[:, None], np.ones(len(values["x"]), dtype=bool))

        runs = CachedModel(model, inputs, 20_000)
        assert quadrature(Study(runs, np.zeros(1, dtype=np.int64), np.zeros(1))) is None
        assert runs.evaluations == runs.aside > 0


def test_points_that_are_impossible_are_left_to_others() -> None:
    """Far points of the rule fail, which drawn runs do not meet."""
    answer = asked(lambda x: x**3, Normal(0.0, 1.0), limit=3.9)
    assert "Gauss" not in answer.found.why
    assert answer.runs.failed == 0
    assert answer.statistics is not None
    assert answer.statistics.std[0] == pytest.approx(np.sqrt(15.0), rel=1e-2)
