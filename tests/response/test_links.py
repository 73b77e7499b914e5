"""Answers that are a function of something simpler, against closed forms: 1e-3 of the deviation with 300 runs."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import pytest
from scipy import stats
from shoal.response import respond
from shoal.response.inputs import Inputs, UncertainParameter
from shoal.response.marginals import Marginal, Normal, Uniform
from shoal.response.respond import ModelResponse
from shoal.response.runs import Answers
from shoal.response.statistics import QUANTILES
from shoal.trajectory import Array

COUNT = 8


def answered(marginal: Marginal, *functions: object, seed: int = 0) -> ModelResponse:
    """Of functions of eight parameters, (parameters, runs) to (runs,)."""
    names = [f"x{k}" for k in range(COUNT)]
    inputs = Inputs(tuple(UncertainParameter(name, marginal, {name: 1.0}) for name in names))

    def model(values: Mapping[str, Array]) -> Answers:
        x = np.stack([values[name] for name in names])
        found = np.stack([of(x) for of in functions], axis=1)  # type: ignore[operator]
        return Answers(found, np.ones(len(found), dtype=bool))

    return respond(model, inputs, len(functions), seed=seed)


def holds(answer: ModelResponse, column: int, mean: float, std: float) -> None:
    """Within 1e-3 and within what is told, with 300 runs."""
    found = answer.statistics
    assert found is not None
    off = abs(found.mean[column] - mean), abs(found.std[column] - std)
    assert max(off) < 1e-3 * std
    assert off[0] <= found.error[column] + 1e-9 * std
    assert off[1] <= found.std_error[column] + 1e-9 * std
    assert answer.runs.evaluations <= 300


@pytest.mark.slow
def test_products_of_lognormal_variables() -> None:
    """A positive one, a negative one that is shared by two, and a sum, which is told as before."""
    answer = answered(
        Normal(0.0, 0.3, logarithmic=True),
        lambda x: np.prod(x, axis=0),
        lambda x: -(x[0] ** 2) / x[1],
        lambda x: np.sum(np.log(x), axis=0),
    )
    spread = 0.72
    mean = math.exp(spread / 2)
    holds(answer, 0, mean, mean * math.sqrt(math.expm1(spread)))
    mean = math.exp(0.225)
    holds(answer, 1, -mean, mean * math.sqrt(math.expm1(0.45)))
    holds(answer, 2, 0.0, math.sqrt(spread))
    found = answer.statistics
    assert found is not None
    assert found.first[:, 0] == pytest.approx(math.expm1(0.09) / math.expm1(spread), abs=1e-6)
    assert found.total[0, 0] == pytest.approx(1 - math.expm1(0.63) / math.expm1(spread), abs=1e-6)
    levels = np.exp(math.sqrt(spread) * stats.norm.ppf(QUANTILES))
    assert found.quantiles[:, 0] == pytest.approx(levels, rel=3e-2)


@pytest.mark.by_day(1)
@pytest.mark.parametrize("size", [1 / math.sqrt(COUNT), 0.5, pytest.param(0.8, marks=pytest.mark.slow)])
def test_the_cosine_of_a_sum(size: float) -> None:
    """E cos(s) = exp(-v / 2) with the variance v of s, and so of its double."""
    answer = answered(Normal(0.0, 1.0), lambda x: np.cos(size * x.sum(axis=0)))
    mean, double = math.exp(-0.5 * COUNT * size**2), math.exp(-2 * COUNT * size**2)
    holds(answer, 0, mean, math.sqrt(0.5 * (1 + double) - mean**2))
    found = answer.statistics
    assert found is not None
    # Of the cosine of s given one of its parts, the mean is exp(-7 size^2 / 2) cos of that part.
    part = math.exp(-7 * size**2) * (0.5 * (1 + math.exp(-2 * size**2)) - math.exp(-(size**2)))
    assert found.first[:, 0] == pytest.approx(part / (0.5 * (1 + double) - mean**2), rel=1e-2)


def test_the_cosine_of_a_sum_of_uniform_variables() -> None:
    """E cos(s) is a product of sin(1) / 1."""
    answer = answered(Uniform(-1.0, 1.0), lambda x: np.cos(x.sum(axis=0)))
    mean, double = math.sin(1) ** COUNT, (math.sin(2) / 2) ** COUNT
    holds(answer, 0, mean, math.sqrt(0.5 * (1 + double) - mean**2))


@pytest.mark.parametrize("power", [0.0, 0.05])
def test_the_exponential_of_what_is_no_sum_of_functions(power: float) -> None:
    """E exp(q) of a quadratic form q in normal variables is in closed form."""
    form = np.diag(np.full(COUNT - 1, 0.5 * power), 1)
    form = 0.5 * (form + form.T)
    slope = np.full(COUNT, 0.2)
    answer = answered(Normal(0.0, 1.0), lambda x: np.exp(slope @ x + np.einsum("ir,ij,jr->r", x, form, x)))

    def moment(order: int) -> float:
        middle = np.eye(COUNT) - 2 * order * form
        exponent = 0.5 * order**2 * slope @ np.linalg.solve(middle, slope)
        return float(np.exp(exponent) / np.sqrt(np.linalg.det(middle)))

    mean = moment(1)
    holds(answer, 0, mean, math.sqrt(moment(2) - mean**2))
