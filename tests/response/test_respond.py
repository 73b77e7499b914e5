"""Bounds and statistics of functions whose answers are known in closed form."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np
import pytest
from scipy import stats
from shoal.errors import ComputationError, InputError
from shoal.response import respond
from shoal.response.extremes import IntArray, search_valleys
from shoal.response.inputs import Inputs, UncertainParameter
from shoal.response.marginals import Empirical, Frozen, Interval, Marginal, Normal, Uniform
from shoal.response.methods import methods
from shoal.response.runs import Answers, Model
from shoal.trajectory import Array

OSCILLATOR = np.array([5.0, 20.0, 50.0])
OSCILLATES = np.array([[0.16031344, 0.39960545], [-0.07348299, 0.79968089], [0.03927549, 1.0]])
"""cos(sqrt(k) t) for k in [0.95, 1.05]: at the ends, or where the argument is a multiple of pi."""


def model(function: Callable[[Mapping[str, Array]], Array]) -> Model:
    def answers(values: Mapping[str, Array]) -> Answers:
        found = function(values)
        return Answers(found, np.ones(len(found), dtype=bool))

    return answers


def inputs(**known: Marginal) -> Inputs:
    return Inputs(tuple(UncertainParameter(name, marginal, {name: 1.0}) for name, marginal in known.items()))


def oscillates(instants: Array) -> Model:
    return model(lambda v: np.cos(np.sqrt(v["k"])[:, None] * instants))


oscillator = oscillates(OSCILLATOR)


def test_bounds_of_an_oscillator() -> None:
    """To a millionth of their width, with a dozen runs; the true ones lie within the outer ones."""
    answer = respond(oscillator, inputs(k=Interval(0.95, 1.05)), 3)
    assert answer.bounds is not None
    width = np.diff(OSCILLATES, axis=1)[:, 0]
    assert np.all(np.abs(answer.bounds.lower - OSCILLATES[:, 0]) < 1e-6 * width + 1e-8)
    assert np.all(np.abs(answer.bounds.upper - OSCILLATES[:, 1]) < 1e-6 * width + 1e-8)
    assert np.all(answer.bounds.lower_outer <= OSCILLATES[:, 0] + 1e-8)
    assert np.all(answer.bounds.upper_outer >= OSCILLATES[:, 1] - 1e-8)
    assert answer.runs.own <= 20


@pytest.mark.parametrize("method", [name for name in methods() if name not in ("chaos", "maximum-entropy", "nested")])
def test_no_method_attains_what_is_not_there(method: str) -> None:
    """Attained bounds lie within the true ones; a gap that is told covers what is missing."""
    one = np.zeros(3, dtype=int)
    course = {"groups": one, "instants": OSCILLATOR, "over_time": oscillates}
    answer = respond(oscillator, inputs(k=Interval(0.95, 1.05)), 3, method=method, **course)
    found = answer.bounds
    assert found is not None
    assert np.all(found.lower >= OSCILLATES[:, 0] - 1e-8)
    assert np.all(found.upper <= OSCILLATES[:, 1] + 1e-8)
    if not math.isnan(found.gap) and math.isinf(found.horizon):
        assert np.all(found.upper_outer >= OSCILLATES[:, 1] - 1e-8)


@pytest.mark.parametrize("seed", [*range(3), *(pytest.param(k, marks=pytest.mark.slow) for k in range(3, 12))])
def test_no_random_run_lies_beyond_the_outer_bounds(seed: int) -> None:
    """Random smooth functions of one to four intervals, with maxima inside, at faces and at corners."""
    random = np.random.default_rng(seed)
    count = 1 + seed % 4
    slopes, waves = random.normal(size=(count, 5)), random.normal(size=(count, 5))
    shift, strength = random.uniform(0, 6, 5), random.uniform(0, 2, 5)

    def function(values: Mapping[str, Array]) -> Array:
        x = np.stack([values[f"p{k}"] for k in range(count)], axis=1)
        return np.asarray(x @ slopes + strength * np.sin(x @ waves + shift))

    known = inputs(**{f"p{k}": Interval(-1.0, 1.0) for k in range(count)})
    answer = respond(model(function), known, 5, seed=seed, gap=0.05)
    found = answer.bounds
    assert found is not None
    assert found.gap <= 0.05
    drawn = function({f"p{k}": random.uniform(-1, 1, 100_000) for k in range(count)})
    corners = function(known.values(random.choice([-1.0, 1.0], (64, count))))
    beyond = found.gap * (found.upper - found.lower)
    for values in (drawn, corners):
        assert np.all(values.min(axis=0) >= found.lower - beyond)
        assert np.all(values.max(axis=0) <= found.upper + beyond)


@pytest.mark.slow
def test_many_parameters_of_which_few_matter() -> None:
    """Twelve intervals: a third of the runs that a polynomial in all of them takes, and bounds that hold."""
    weights = 0.5 * 0.6 ** np.arange(12)

    def function(values: Mapping[str, Array]) -> Array:
        x = np.stack([values[f"x{k}"] for k in range(12)], axis=1)
        return np.asarray(np.sin(x @ weights + 0.3) + 0.1 * x[:, 0] * x[:, 1])[:, None]

    answer = respond(model(function), inputs(**{f"x{k}": Interval(-1.0, 1.0) for k in range(12)}), 1)
    assert "have little effect" in answer.found.why
    assert answer.runs.own < 1.35 * math.comb(16, 4) / 3
    corners = function({f"x{k}": np.array([-1.0, 1.0]) for k in range(12)})[:, 0]
    random = np.random.default_rng(2)
    drawn = random.uniform(-1, 1, (100_000, 12))
    found = function({f"x{k}": np.where(random.random(100_000) < 0.8, np.sign(x), x) for k, x in enumerate(drawn.T)})
    low, high = min(found.min(), corners.min()), max(found.max(), corners.max())
    assert answer.bounds is not None
    assert answer.bounds.lower_outer[0] <= low
    assert answer.bounds.upper_outer[0] >= high
    assert answer.bounds.lower[0] == pytest.approx(low, abs=1e-3)
    assert answer.bounds.upper[0] == pytest.approx(high, abs=1e-3)


def test_statistics_of_an_oscillator() -> None:
    """cos(sqrt(g / L) t), L normal: mean and variance by Gauss-Hermite quadrature of 200 points."""
    times = np.array([10.0, 100.0])
    nodes, weights = np.polynomial.hermite_e.hermegauss(200)
    exact = np.cos(np.sqrt(9.81 / (1 + 0.01 * nodes))[:, None] * times)
    mean = weights @ exact / weights.sum()
    deviation = np.sqrt(weights @ (exact - mean) ** 2 / weights.sum())
    swing = model(lambda v: np.cos(np.sqrt(9.81 / v["L"])[:, None] * times))
    answer = respond(swing, inputs(L=Normal(1.0, 0.01)), 2)
    assert answer.statistics is not None
    assert answer.statistics.mean == pytest.approx(mean, abs=1e-3)
    assert answer.statistics.std == pytest.approx(deviation, rel=5e-3)
    assert answer.runs.evaluations <= 300


@pytest.mark.slow
def test_few_terms_of_many() -> None:
    """Eight normal variables of which a few matter, in closed form: mean and deviation within 1e-3 with 300 runs."""
    function = model(
        lambda v: (v["x0"] ** 2 + v["x1"] * v["x2"] + np.exp(0.3 * v["x3"]) + 0.1 * v["x4"] ** 3 + v["x5"])[:, None]
    )
    answer = respond(function, inputs(**{f"x{k}": Normal(0.0, 1.0) for k in range(8)}), 1)
    growth = math.exp(0.09)
    variance = 2 + 1 + growth * (growth - 1) + 0.01 * 15 + 1
    assert answer.statistics is not None
    assert answer.statistics.mean[0] == pytest.approx(1 + math.exp(0.045), abs=1e-3 * math.sqrt(variance))
    assert answer.statistics.std[0] == pytest.approx(math.sqrt(variance), rel=1e-3)
    assert answer.runs.evaluations <= 300


@pytest.mark.slow
def test_polynomials_that_run_away_outside_of_all_runs_are_seen() -> None:
    """Three oscillators after ten cycles: 32 terms of degree 20 tell 300 runs to 1 %, a deviation 13 % too large."""
    speeds = 60 * np.array([1.0, 1.1, 1.2])
    function = model(lambda v: sum(np.cos(w * (1 + 0.02 * v[f"x{k}"]))[:, None] for k, w in enumerate(speeds)))
    answer = respond(function, inputs(**{f"x{k}": Normal(0.0, 1.0) for k in range(3)}), 1)
    fade = np.exp(-((0.02 * speeds) ** 2) / 2)
    mean = fade * np.cos(speeds)
    variance = 0.5 * (1 + fade**4 * np.cos(2 * speeds)) - mean**2
    assert answer.statistics is not None
    assert answer.statistics.mean[0] == pytest.approx(mean.sum(), abs=1e-3)
    assert answer.statistics.std[0] == pytest.approx(math.sqrt(variance.sum()), rel=1e-3)


@pytest.mark.slow
def test_indices_of_ishigamis_function() -> None:
    """S1 = .31390519, S2 = .44241114, ST1 = .55758886 (Ishigami and Homma, 1990, a = 7, b = 0.1)."""
    angle = Uniform(-math.pi, math.pi)
    ishigami = model(lambda v: (np.sin(v["a"]) + 7 * np.sin(v["b"]) ** 2 + 0.1 * v["c"] ** 4 * np.sin(v["a"]))[:, None])
    answer = respond(ishigami, inputs(a=angle, b=angle, c=angle), 1)
    assert answer.statistics is not None
    assert answer.statistics.first[:, 0] == pytest.approx([0.31390519, 0.44241114, 0.0], abs=1e-4)
    assert answer.statistics.total[0, 0] == pytest.approx(0.55758886, abs=1e-4)


@pytest.mark.parametrize(("method", "count"), [("sobol", 12288), pytest.param("auto", None, marks=pytest.mark.slow)])
def test_indices_where_polynomials_fail(method: str, count: int | None) -> None:
    """Sobol's g-function has kinks; sampling takes over. V_i = 1 / (3 (1 + a_i)^2)."""
    weights = np.array([0.0, 1.0, 4.5, 9.0])
    partial = 1 / (3 * (1 + weights) ** 2)
    first = partial / (np.prod(1 + partial) - 1)
    function = model(
        lambda v: np.prod([(np.abs(4 * v[f"x{k}"] - 2) + a) / (1 + a) for k, a in enumerate(weights)], axis=0)[:, None]
    )
    known = inputs(**{f"x{k}": Uniform(0.0, 1.0) for k in range(4)})
    answer = respond(function, known, 1, method=method, count=count)
    assert answer.statistics is not None
    assert answer.statistics.first[:, 0] == pytest.approx(first, abs=0.01)


@pytest.mark.parametrize(
    "known",
    [
        Uniform(1.0, 3.0),
        Normal(2.0, 0.3),
        Normal(0.5, 0.1, logarithmic=True),
        Frozen(stats.triang(0.3, 1.0, 2.0)),
        Frozen(stats.beta(2.0, 3.0, 1.0, 2.0)),
        Frozen(stats.truncnorm(-1.0, 2.0, 2.0, 0.5)),
        Empirical(np.array([1.0, 1.1, 1.4, 1.5, 1.9, 2.0, 2.2, 2.9, 3.0, 3.1])),
    ],
    ids=lambda known: type(known).__name__,
)
@pytest.mark.by_day(2)
def test_moments_of_a_square(known: Marginal) -> None:
    """Mean and deviation of x^2 from the moments that the distribution has in closed form or by quadrature."""
    answer = respond(model(lambda v: v["x"][:, None] ** 2), inputs(x=known), 1, method="chaos", degree=6)
    x = (np.arange(2_000_000) + 0.5) / 2_000_000
    exact = known.value(known.quantile(x)) ** 2
    assert answer.statistics is not None
    assert answer.statistics.mean[0] == pytest.approx(exact.mean(), rel=1e-5)
    assert answer.statistics.std[0] == pytest.approx(exact.std(), rel=1e-4)


def test_correlation_of_two_normal_parameters() -> None:
    """Var(x + y) = 1 + 4 + 2 * 2 * 0.5."""
    pair = (
        UncertainParameter("x", Normal(0.0, 1.0), {"x": 1.0}),
        UncertainParameter("y", Normal(0.0, 2.0), {"y": 1.0}),
    )
    known = Inputs(pair, {("x", "y"): 0.5})
    answer = respond(model(lambda v: (v["x"] + v["y"])[:, None]), known, 1)
    assert answer.statistics is not None
    assert answer.statistics.std[0] == pytest.approx(math.sqrt(7.0), rel=1e-9)
    assert np.isnan(answer.statistics.first).all()


def test_the_same_seed_gives_the_same_answer() -> None:
    one, other = (respond(oscillator, inputs(k=Interval(0.9, 1.1)), 3, seed=5) for _ in range(2))
    assert one.bounds is not None
    assert other.bounds is not None
    assert np.array_equal(one.bounds.upper_outer, other.bounds.upper_outer)


def test_failed_runs_are_told_of() -> None:
    """A model that fails on one side of the box: what succeeds is bounded, what failed is counted."""

    def half(values: Mapping[str, Array]) -> Answers:
        return Answers(values["x"][:, None] ** 2, values["x"] < 0.5, 0, "too large")

    answer = respond(half, inputs(x=Interval(-1.0, 1.0)), 1)
    assert answer.runs.failed > 0
    assert answer.runs.why == "too large"
    with pytest.raises(ComputationError, match="runs failed: too large"):
        respond(half, inputs(x=Interval(0.6, 1.0)), 1)


@pytest.mark.parametrize(("method", "known"), [("chaos", Interval(0.0, 1.0)), ("scan", Normal(0.0, 1.0))])
def test_methods_refuse_what_they_cannot(method: str, known: Marginal) -> None:
    with pytest.raises(InputError, match="vary: method"):
        respond(oscillator, inputs(k=known), 3, method=method)


def test_searches_reach_maxima_inside_and_at_corners() -> None:
    """Two hills of which the lower is the wider, a valley inside and a slope: extremes by hand."""

    def function(v: Mapping[str, Array]) -> Array:
        x, y = v["x"], v["y"]
        hills = np.exp(-30 * ((x - 0.6) ** 2 + (y + 0.5) ** 2)) + 0.8 * np.exp(-3 * ((x + 0.5) ** 2 + (y - 0.4) ** 2))
        return np.stack([hills, (x - 0.3) ** 2 + (y + 0.2) ** 2 + 0.5 * x * y, 2 * x - y], axis=1)

    answer = respond(model(function), inputs(x=Interval(-1.0, 1.0), y=Interval(-1.0, 1.0)), 3, method="optimise")
    found = answer.bounds
    assert found is not None
    # The gradient of the quadratic vanishes at [[2, 0.5], [0.5, 2]]^-1 [0.6, -0.4].
    inner = np.linalg.solve([[2, 0.5], [0.5, 2]], [0.6, -0.4])
    least = function({"x": inner[:1], "y": inner[1:]})[0, 1]
    assert found.lower[1] == pytest.approx(least, abs=1e-6)
    assert found.at_lower[1] == pytest.approx(inner, abs=2e-3)
    assert (found.lower[2], found.upper[2]) == pytest.approx((-3.0, 3.0))
    fine = np.linspace(0.5, 0.7, 401)
    x, y = np.meshgrid(fine, -fine)
    top = function({"x": x.ravel(), "y": y.ravel() + 0.1})[:, 0].max()
    assert found.upper[0] == pytest.approx(top, abs=1e-5)
    again = function({"x": found.at_upper[:, 0], "y": found.at_upper[:, 1]})
    assert np.diagonal(again) == pytest.approx(found.upper, abs=1e-14)


def test_of_two_valleys_along_an_axis_the_deeper_one_is_found() -> None:
    """Every 2 pi / 25 lies a valley; the deepest is that nearest to 0.3, which a search from another never meets."""

    def objective(at: Array, _: IntArray) -> Array:
        return np.asarray(1 - at[:, 0] - np.cos(25 * at[:, 1]) + 1e-4 * (at[:, 1] - 0.3) ** 2)

    at = np.array([[1.0, -1.0], [1.0, -6 * math.pi / 25]])
    best = objective(at, np.arange(2))
    search_valleys(objective, best, at)
    assert at[:, 0] == pytest.approx([1.0, 1.0])
    assert at[:, 1] == pytest.approx(2 * math.pi / 25, abs=1e-5)
    assert best == pytest.approx(objective(at, np.arange(2)), abs=1e-15)
