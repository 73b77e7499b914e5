"""Deviations that are small compared with the spread of the mean, against Gauss-Hermite rules of numpy on a grid."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import pytest
from numpy.polynomial.hermite_e import hermegauss
from scipy import stats
from scipy.stats import qmc
from shoal.response import respond
from shoal.response.inputs import Inputs, UncertainParameter
from shoal.response.marginals import Interval, Normal
from shoal.response.respond import ModelResponse
from shoal.response.runs import Answers
from shoal.response.statistics import QUANTILES
from shoal.trajectory import Array

Values = Mapping[str, Array]
NOMINAL = {"k1": 1.0, "k2": 1.0, "m1": 1.0, "m2": 0.8}


def chain(values: Values, t: Array) -> Array:
    """Second mass of two on two springs, pulled out by 0.3 and 0.5 m, by its modes, (runs, instants)."""
    count = len(next(iter(values.values())))
    k1, k2, m1, m2 = (values.get(name, np.full(count, nominal)) for name, nominal in NOMINAL.items())
    first, last, between = (k1 + k2) / m1, k2 / m2, -k2 / np.sqrt(m1 * m2)
    matrix = np.stack([first, between, between, last], axis=-1).reshape(-1, 2, 2)
    squares, modes = np.linalg.eigh(matrix)
    start = np.stack([0.3 * np.sqrt(m1), 0.5 * np.sqrt(m2)], axis=-1)
    amplitudes = np.einsum("rij,ri->rj", modes, start) * modes[:, 1] / np.sqrt(m2)[:, None]
    return np.asarray(np.einsum("rj,rjt->rt", amplitudes, np.cos(np.sqrt(squares)[..., None] * t)))


def told(function: Callable[[Values], Array], known: Mapping[str, Interval | Normal], **limits: int) -> ModelResponse:
    def model(values: Values) -> Answers:
        found = function(values)
        return Answers(found, np.ones(len(found), dtype=bool))

    inputs = Inputs(tuple(UncertainParameter(name, one, {name: 1.0}) for name, one in known.items()))
    columns = function({name: np.ones(1) for name in known}).shape[1]
    when = np.arange(1.0, columns + 1)
    return respond(model, inputs, columns, groups=np.zeros(columns, dtype=int), instants=when, **limits)


def moments(
    function: Callable[[Values], Array], known: Mapping[str, Interval | Normal], points: int
) -> tuple[Array, Array]:
    """Means and deviations on a grid of the intervals, (places, columns) each."""
    intervals = {name: one for name, one in known.items() if isinstance(one, Interval)}
    random = {name: one for name, one in known.items() if isinstance(one, Normal)}
    axes = [np.linspace(one.low, one.high, points) for one in intervals.values()]
    grid = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, len(axes))
    nodes, weights = hermegauss(8)
    places = np.stack(np.meshgrid(*[nodes] * len(random)), axis=-1).reshape(-1, len(random))
    weight = np.prod(np.stack(np.meshgrid(*[weights / weights.sum()] * len(random)), axis=-1), axis=-1).ravel()
    values = {name: np.repeat(grid[:, k], len(places)) for k, name in enumerate(intervals)}
    for k, (name, one) in enumerate(random.items()):
        values[name] = np.tile(one.mean + one.deviation * places[:, k], len(grid))
    answers = function(values).reshape(len(grid), len(places), -1)
    mean = np.einsum("j,ijk->ik", weight, answers)
    return mean, np.sqrt(np.einsum("j,ijk->ik", weight, (answers - mean[:, None]) ** 2))


def judge(answer: ModelResponse, mean: Array, deviation: Array) -> None:
    """Attained extremes within a few per cent of the largest at each instant, true ones within outer bounds."""
    found, grid = answer.boxes, 2e-3
    assert found is not None
    largest = deviation.max(axis=0)
    assert answer.horizon == np.inf
    assert found.std_gap < 0.1
    assert np.all(np.abs(found.std.upper - largest) < 0.03 * largest.max())
    assert np.all(np.abs(found.std.lower - deviation.min(axis=0)) < 0.05 * largest.max())
    for of, exact in ((found.mean, mean), (found.std, deviation)):
        off = grid * np.ptp(exact, axis=0).max()
        assert np.all(of.lower_outer < exact.min(axis=0) + off)
        assert np.all(of.upper_outer > exact.max(axis=0) - off)


@pytest.mark.parametrize("seed", [*range(6), *(pytest.param(k, marks=pytest.mark.slow) for k in range(6, 60))])
@pytest.mark.by_day(1)
def test_random_chains(seed: int) -> None:
    """Stiffnesses within intervals move the mean through cycles; masses scatter by 0.01 to 0.5 %."""
    random = np.random.default_rng(seed)
    t = np.linspace(0, random.uniform(15, 60), 7)[1:]
    widths, deviation = random.uniform(0.03, 0.15, 2), 10 ** random.uniform(-4, -2.3)
    known: dict[str, Interval | Normal] = {"k1": Interval(1 - widths[0], 1 + widths[0]), "m1": Normal(1.0, deviation)}
    if random.random() < 0.5:
        known["k2"] = Interval(1 - widths[1], 1 + widths[1])
    if random.random() < 0.5:
        known["m2"] = Normal(0.8, deviation)
    judge(told(lambda v: chain(v, t), known), *moments(lambda v: chain(v, t), known, 401 if "k2" not in known else 41))


@pytest.mark.parametrize("seed", [7, *(pytest.param(k, marks=pytest.mark.slow) for k in (5, *range(8, 40)))])
def test_outer_bounds_of_quantiles_hold_those_of_a_double_loop(seed: int) -> None:
    """Draws of the masses at each stiffness of a grid; the quantiles of 8192 are known to 2 % of the deviation."""
    random = np.random.default_rng(seed)
    t = np.linspace(0, random.uniform(15, 60), 7)[1:]
    widths, deviation = random.uniform(0.03, 0.15, 2), 10 ** random.uniform(-4, -2.3)
    stiff: dict[str, Interval | Normal] = {
        f"k{k + 1}": Interval(1 - widths[k], 1 + widths[k]) for k in range(int(random.integers(1, 3)))
    }
    masses: dict[str, Interval | Normal] = {"m1": Normal(1.0, deviation), "m2": Normal(0.8, deviation)}
    answer = told(lambda v: chain(v, t), stiff | masses)
    assert answer.boxes is not None
    draws = stats.norm.ppf(qmc.Sobol(2, seed=seed).random(8192))
    drawn = {"m1": 1.0 + deviation * draws[:, 0], "m2": 0.8 + deviation * draws[:, 1]}
    axes = [np.linspace(1 - half, 1 + half, 33 if len(stiff) == 1 else 7) for half in widths[: len(stiff)]]
    grid = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, len(stiff))
    for values in grid:
        at = {name: np.full(len(draws), value) for name, value in zip(stiff, values, strict=True)}
        told_here = chain(at | drawn, t)
        off = 0.02 * told_here.std(axis=0)
        for found, exact in zip(answer.boxes.quantiles, np.quantile(told_here, QUANTILES, axis=0), strict=True):
            low, high = found.widest
            assert np.all(low <= exact + off)
            assert np.all(exact <= high + off)


@pytest.mark.slow
def test_three_random_parameters() -> None:
    """Three of them, which take an expansion, with a deviation of a thousandth of what the mean differs by."""

    def function(v: Values) -> Array:
        small = (1 + v["k"] ** 2) * v["a"] + v["k"] * v["b"] + 0.5 * v["c"] + 0.2 * v["a"] * v["c"]
        return (np.sin(4 * v["k"] + 0.3) + 5e-4 * small)[:, None]

    known = {"k": Interval(-1.0, 1.0), **dict.fromkeys("abc", Normal(0.0, 1.0))}
    judge(told(function, known), *moments(function, known, 401))


def test_a_deviation_that_takes_more_runs_is_in_doubt() -> None:
    def function(v: Values) -> Array:
        return chain(v, np.array([60.0, 120.0]))

    known = {"k1": Interval(0.95, 1.05), "k2": Interval(0.95, 1.05), "m1": Normal(1.0, 1e-4)}
    answer = told(function, known, most=400)
    assert answer.boxes is not None
    _, deviation = moments(function, known, 81)
    within = answer.boxes.std.upper_outer[: int(min(answer.horizon, 2))]
    assert np.all(within > deviation.max(axis=0)[: len(within)])
    assert answer.boxes.std_gap > 0.1 or np.isfinite(answer.horizon)


@pytest.mark.slow
def test_runs_are_left_for_what_lies_beyond_the_horizon() -> None:
    """A deviation that takes an inner study, and the logistic map, which no polynomial tells."""

    def function(v: Values) -> Array:
        x = 0.3 + 0.1 * v["k"] + 1e-3 * v["a"]
        for _ in range(40):
            x = 4 * x * (1 - x)
        return np.stack([np.sin(5 * v["k"]) + 1e-4 * v["a"] * (2 + v["k"]), x], axis=1)

    answer = told(function, {"k": Interval(-1.0, 1.0), "a": Normal(0.0, 1.0)}, most=4000)
    found = answer.boxes
    assert found is not None
    assert answer.horizon == 1.0
    assert found.places >= 3
    assert (found.std.lower[0], found.std.upper[0]) == pytest.approx((1e-4, 3e-4), rel=0.02)
