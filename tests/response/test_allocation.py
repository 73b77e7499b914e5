"""Tolerances that keep a limit, against closed forms; the worst case as a scene."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from scipy import optimize, stats
from shoal.cli import main
from shoal.engines import get_engine
from shoal.errors import ComputationError, InputError
from shoal.notebook import uncertain
from shoal.response.allocate import Confirmed
from shoal.response.allocation import Allocation, Cut, cheapest, with_factors
from shoal.response.inputs import Inputs, UncertainParameter
from shoal.response.limits.estimate import ExceedanceEstimate
from shoal.response.marginals import Frozen, Interval, Normal, Scaled, Uniform
from shoal.response.worst import worst
from shoal.scene import Scene, load_scene
from thrown import ALONG, THROWN, UP

HEIGHT = "initial.P.position.1"


def test_the_cheapest_factors_of_planes() -> None:
    """Sum(c / s) under sum(b s) = 1, by a general optimiser."""
    weights, costs, most = np.array([0.5, 1.0, 2.0, 0.0]), np.array([1.0, 2.0, 1.0, 1.0]), np.full(4, 3.0)
    found = cheapest([Cut(weights, np.zeros((4, 4)), 1.0)], costs, 0.0, most)
    other = optimize.minimize(
        lambda s: float(costs @ (1 / s)),
        np.full(4, 0.2),
        bounds=[(1e-3, 3.0)] * 4,
        constraints={"type": "ineq", "fun": lambda s: 1 - weights @ s},
        options={"ftol": 1e-12},
    )
    assert found == pytest.approx(other.x, rel=1e-3)
    assert weights @ found == pytest.approx(1.0)


def test_tolerances_of_intervals() -> None:
    """A body thrown from -t to t m with 5 - u to 5 + u m/s stays below 1.5 m: t + (5 + u)^2 / 20 = 1.5."""
    found = uncertain(
        Scene.parse(THROWN),
        {UP: (4.8, 5.2), HEIGHT: (-0.2, 0.2), ALONG: (1.9, 2.1)},
        limit=["P.y > 1.5"],
        allocate=True,
        cost={UP: 2.0},
        verify=False,
    )
    assert found.ok
    allocation = found.allocation
    assert allocation is not None
    best = optimize.minimize_scalar(
        lambda s: 2 / s + 0.2 / (1.5 - (5 + 0.2 * s) ** 2 / 20), bounds=(0.1, 2.0), method="bounded"
    )
    assert allocation.factors == pytest.approx([best.x, (1.5 - (5 + 0.2 * best.x) ** 2 / 20) / 0.2, 3.0], rel=2e-2)
    assert 0 <= allocation.confirmed < 1e-3
    assert allocation.effects[1] == pytest.approx(0.01 * 0.2)
    assert allocation.to_json()["tighten_first"] == HEIGHT
    again = uncertain(
        Scene.parse(THROWN),
        list(allocation.allocated.parameters),
        limit=["P.y > 1.5"],
        method="vertices",
        verify=False,
    )
    assert again.limits[0].kept


@pytest.mark.slow
def test_deviations_of_distributions() -> None:
    """The probability that was asked for is kept, and FORM's effects are those of the closed form."""
    target = 1e-4
    found = uncertain(
        Scene.parse(THROWN),
        {UP: "normal(5,0.2)", HEIGHT: "normal(0,0.1)"},
        limit=["P.y > 1.75"],
        allocate=True,
        target=target,
        verify=False,
        count=32,
        method="sobol",
    )
    allocation = found.allocation
    assert allocation is not None
    assert found.ok

    def passed(factors: np.ndarray) -> float:
        heights = np.linspace(-8, 8, 20001)
        speed = np.sqrt(20 * np.maximum(1.75 - 0.1 * factors[1] * heights, 0.0))
        beyond = stats.norm.pdf(heights) * stats.norm.sf((speed - 5) / (0.2 * factors[0]))
        return float(np.sum(beyond) * (heights[1] - heights[0]))

    assert passed(allocation.factors) == pytest.approx(target, rel=0.1)
    assert allocation.stated == pytest.approx(passed(np.ones(2)), rel=0.1)
    for k in range(2):
        tight = np.ones(2)
        tight[k] = 0.99
        assert allocation.effects[k] == pytest.approx(1 - passed(tight) / passed(np.ones(2)), rel=0.15)


def allocated(vary: dict[str, Any], limit: str, target: float, **how: Any) -> Allocation:
    """Of a body thrown upwards that is at h + v / 2 - 1.25 m after half a second."""
    how = {"count": 16, "method": "sobol", **how}
    found = uncertain(
        Scene.parse(THROWN), vary, [0.5], limit=[limit], allocate=True, target=target, verify=False, **how
    )
    assert found.ok, found.message
    assert found.allocation is not None
    return found.allocation


@pytest.mark.parametrize(
    ("rho", "costs"),
    [
        pytest.param(0.8, (1.0, 3.0), marks=pytest.mark.slow),
        pytest.param(0.95, (1.0, 3.0), marks=pytest.mark.slow),
        (-0.9, (1.0, 1.0)),
    ],
)
def test_deviations_of_correlated_parameters(rho: float, costs: tuple[float, float]) -> None:
    """The deviation of h + v / 2 is sqrt(w' R w), w those of its parts: the cheapest ones by a general optimiser.

    If the parts counter each other, tightening one may do harm.
    """
    target, room, price = 1e-2, 0.12, np.array(costs)
    told = allocated(
        {HEIGHT: "normal(0,0.05)", UP: "normal(5,0.08)"},
        f"P.y > {1.25 + room}",
        target,
        correlations={(HEIGHT, UP): rho},
        costs={HEIGHT: costs[0], UP: costs[1]},
    )
    parts, matrix = np.array([0.05, 0.04]), np.array([[1.0, rho], [rho, 1.0]])

    def chance(factors: Any) -> float:
        return float(stats.norm.sf(room / np.sqrt(parts * factors @ matrix @ (parts * factors))))

    best = optimize.minimize(
        lambda s: float(price @ (1 / s)),
        np.full(2, 0.3),
        bounds=[(1e-2, 3.0)] * 2,
        constraints={"type": "ineq", "fun": lambda s: np.log(target / chance(s))},
        options={"ftol": 1e-12, "maxiter": 500},
    )
    assert best.success
    assert told.factors == pytest.approx(best.x, rel=1.5e-2)
    assert chance(told.factors) == pytest.approx(target, rel=0.1)
    effects = [1 - chance(1 - 0.01 * row) / chance(np.ones(2)) for row in np.eye(2)]
    assert told.effects == pytest.approx(effects, rel=5e-2, abs=3e-3)
    assert bool(told.effects[1] < 0) is (rho < -0.8)
    assert told.first == HEIGHT


@pytest.mark.parametrize(
    ("text", "law", "limit"),
    [
        ("uniform(-0.1,0.1)", stats.uniform(-0.1, 0.2), 0.09),
        ("uniform(-0.1,0.1)", stats.uniform(-0.1, 0.2), 0.12),
        ("triangular(-0.1,0,0.1)", stats.triang(0.5, -0.1, 0.2), 0.07),
        ("truncated-normal(0,0.1,-0.1,0.1)", stats.truncnorm(-1, 1, 0, 0.1), 0.09),
        ("lognormal(1,0.05)", stats.lognorm(np.sqrt(np.log1p(0.0025)), scale=1 / np.sqrt(1.0025)), 1.08),
    ],
)
@pytest.mark.by_day(1)
def test_the_tolerance_of_one_distribution(text: str, law: Any, limit: float) -> None:
    """The factor with which h passes the limit as often as is allowed, also where the stated one never does."""
    target = 1e-2
    told = allocated({HEIGHT: text}, f"P.y > {limit + 1.25}", target)

    def chance(factor: float) -> float:
        median = law.median()
        if "lognormal" in text:
            return float(law.sf(median * (limit / median) ** (1 / factor)))
        return float(law.sf(median + (limit - median) / factor))

    best = optimize.brentq(lambda factor: chance(factor) - target, 0.1, 3.0)
    assert told.factors == pytest.approx([best], rel=1e-2)
    assert chance(told.factors[0]) == pytest.approx(target, rel=0.1)
    assert told.interval is not None
    assert told.interval[0] < told.confirmed < told.interval[1]
    one = told.to_json()["parameters"][HEIGHT]
    assert one["tolerance_stated"] == pytest.approx(law.std(), rel=1e-6)
    if chance(1.0):
        assert told.effects == pytest.approx([1 - chance(0.99) / chance(1.0)], rel=0.1)


@pytest.mark.slow
def test_the_tolerances_of_two_uniform_parameters() -> None:
    """P(h + v / 2 > b) = (a + c - b)^2 / 8 a c for half widths a, c: a limit that bends in the space of FORM."""
    target, room, halves = 1e-2, 0.12, np.array([0.1, 0.06])
    told = allocated({HEIGHT: "uniform(-0.1,0.1)", UP: "uniform(4.88,5.12)"}, f"P.y > {1.25 + room}", target)

    def chance(factors: Any) -> float:
        wide = halves * factors
        return float(max(wide.sum() - room, 0.0) ** 2 / (8 * wide.prod()))

    best = optimize.minimize(
        lambda s: float((1 / s).sum()),
        np.full(2, 0.9),
        bounds=[(1e-2, 3.0)] * 2,
        constraints={"type": "ineq", "fun": lambda s: 100 * (target - chance(s))},
        options={"ftol": 1e-12},
    )
    assert best.success
    assert told.cost == pytest.approx(best.fun / 2, rel=5e-3)
    assert told.factors == pytest.approx(best.x, rel=3e-2)
    assert chance(told.factors) == pytest.approx(target, rel=0.1)
    effects = [1 - chance(1 - 0.01 * row) / chance(np.ones(2)) for row in np.eye(2)]
    assert told.effects == pytest.approx(effects, rel=0.1)


@pytest.mark.slow
def test_a_uniform_parameter_beside_an_interval() -> None:
    """P(h > b - w) = (a - b + w) / 2 a for half widths a of h, w of v / 2: only near the upper end it is not 0."""
    target, room = 1e-2, 0.1
    told = allocated(
        {HEIGHT: "uniform(-0.1,0.1)", UP: (4.92, 5.08)}, f"P.y > {1.25 + room}", target, method="auto", count=None
    )
    best = optimize.minimize_scalar(
        lambda w: 1 / w + 0.1 * (1 - 2 * target) / (room - 0.04 * w), bounds=(0.1, 2.4), method="bounded"
    )
    deviation, width = told.factors
    assert told.cost == pytest.approx(best.fun / 2, rel=5e-3)
    assert (0.1 * deviation - room + 0.04 * width) / (0.2 * deviation) == pytest.approx(target, rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("target", [1e-3, pytest.param(1e-5, marks=pytest.mark.slow)])
def test_an_interval_and_a_deviation_together(target: float) -> None:
    """h + v / 2 - 1.25 at 0.5 s, v normal(5, 0.3 s), h in 0.025 -+ 0.075 w: P(> 1.9) = Phi(-(0.625 - 0.075 w) / 0.15 s)
    at the upper end, which is the target where 0.15 beta s + 0.075 w = 0.625: costs decide the shares.
    """
    found = uncertain(
        *(Scene.parse(THROWN), {UP: "normal(5,0.3)", HEIGHT: (-0.05, 0.1), ALONG: (1.9, 2.1)}, [0.5]),
        **dict[str, Any](limit=["P.y > 1.9"], limit_runs=2000, verify=False),
        **dict[str, Any](allocate=True, target=target, costs={HEIGHT: 1.5}),
    )
    assert found.ok, found.message
    allocation, room = found.allocation, 0.625
    assert allocation is not None
    weights, costs = np.array([-0.15 * stats.norm.ppf(target), 0.075]), np.array([1.0, 1.5])
    best = room * np.sqrt(costs / weights) / np.sqrt(costs * weights).sum()
    assert np.all(best < 3.0)
    # A tenth of the probability is a hundredth of the index; what is not in the limit is as wide as it may be.
    assert allocation.factors == pytest.approx([*best, 3.0], rel=2e-2)
    assert target * 0.8 < allocation.confirmed <= target

    def passed(deviation: float, width: float) -> float:
        return float(stats.norm.sf((room - 0.075 * width) / (0.15 * deviation)))

    assert allocation.stated == pytest.approx(passed(1, 1), rel=0.1)
    effects = [1 - passed(0.99, 1) / passed(1, 1), 1 - passed(1, 0.99) / passed(1, 1), 0.0]
    assert allocation.effects == pytest.approx(effects, rel=0.1, abs=1e-9)
    told = allocation.to_json()
    assert told["tighten_first"] == UP
    assert told["probability_allocated"] == allocation.confirmed


def test_the_cheapest_factors_within_cones() -> None:
    """Sum(c / s) under pull @ s + beta |spread @ s| <= room for two corners, by a general optimiser."""
    cuts = [
        Cut(np.array([0.5, 0.0, 0.0, 0.0]), np.diag([0.0, 1.0, 0.3, 0.0]), 3.0),
        Cut(np.array([1.5, 0.0, 0.0, 0.0]), np.diag([0.0, 0.2, 0.6, 0.0]), 3.5),
    ]
    costs, most, beta = np.array([1.0, 2.0, 1.0, 1.0]), np.full(4, 3.0), 3.0
    found = cheapest(cuts, costs, beta, most)
    random = np.random.default_rng(1)
    others = [
        optimize.minimize(
            lambda s: float(costs @ (1 / s)),
            random.uniform(0.1, 0.6, 4),
            bounds=[(1e-3, 3.0)] * 4,
            method="trust-constr",
            constraints=[
                optimize.NonlinearConstraint(lambda s, one=one: one.used(s, beta), -np.inf, one.room) for one in cuts
            ],
            options={"xtol": 1e-10, "gtol": 1e-8, "maxiter": 3000},
        )
        for _ in range(2)
    ]
    assert float(costs @ (1 / found)) == pytest.approx(min(other.fun for other in others), rel=1e-4)
    assert max(one.used(found, beta) - one.room for one in cuts) < 1e-6


@pytest.mark.slow
def test_an_interval_that_reaches_beyond_the_limit() -> None:
    """The stated upper end passes it half of the times and more; narrower ones keep it."""
    found = uncertain(
        *(Scene.parse(THROWN), {UP: "normal(5,0.2)", HEIGHT: (-0.5, 0.5)}, [0.5]),
        **dict[str, Any](limit=["P.y > 1.7"], limit_runs=600, verify=False, allocate=True, target=1e-2),
    )
    assert found.ok, found.message
    assert found.allocation is not None
    deviation, width = found.allocation.factors
    assert -stats.norm.ppf(1e-2) * 0.1 * deviation + 0.5 * width == pytest.approx(0.45, rel=1e-2)
    with pytest.raises(ComputationError, match="does not hold at the middle values"):
        uncertain(
            *(Scene.parse(THROWN), {UP: "normal(5,0.2)", HEIGHT: (-0.5, 0.5)}, [0.5]),
            **dict[str, Any](limit=["P.y > 1.2"], limit_runs=600, verify=False, allocate=True, target=1e-2),
        )


def test_a_probability_of_nothing_is_not_near_the_target() -> None:
    """Few runs that none passes leave room for the target, and say nothing of how wide tolerances may be."""

    def confirmed(chance: float, unseen: float) -> Confirmed:
        return Confirmed(np.ones(1), ExceedanceEstimate(np.array([chance]), np.array([0.02]), "", unseen), [])

    assert confirmed(9.8e-3, 0.0).near(1e-2)
    assert not confirmed(1.01e-2, 0.0).near(1e-2)
    assert not confirmed(0.0, 0.1).near(1e-2)
    assert [one.code for one in confirmed(0.0, 0.1).findings(1e-2, np.full(1, 3.0))] == ["allocation-too-tight"]
    assert not confirmed(0.0, 0.1).findings(1e-2, np.ones(1))


def test_what_cannot_be_allocated_is_refused() -> None:
    scene, vary = Scene.parse(THROWN), {UP: (4.8, 5.2)}
    with pytest.raises(ComputationError, match="middle values"):
        uncertain(scene, vary, limit=["P.y > 1.0"], allocate=True, verify=False)
    with pytest.raises(InputError, match="needs one limit"):
        uncertain(scene, vary, allocate=True, verify=False)
    with pytest.raises(InputError, match="cost: 'x' is not varied"):
        uncertain(scene, vary, limit=["P.y > 2"], allocate=True, cost={"x": 1.0}, verify=False)


@pytest.mark.parametrize(
    "marginal", [Interval(1.0, 3.0), Uniform(1.0, 3.0), Normal(2.0, 0.3), Frozen(stats.norm(2.0, 0.5))]
)
def test_scaled_tolerances(marginal: Interval | Normal | Frozen) -> None:
    """Half the width about the same middle."""
    inputs = Inputs((UncertainParameter("x", marginal, {"x": 1.0}),))
    half = with_factors(inputs, np.array([0.5])).parameters[0].marginal
    assert isinstance(half, Scaled) is isinstance(marginal, Frozen)
    x = np.array([0.1, 0.5, 0.9])
    assert half.value(half.quantile(x)) - 2 == pytest.approx(0.5 * (marginal.value(marginal.quantile(x)) - 2))


def test_the_worst_case_as_a_scene(tmp_path: Path) -> None:
    """Its own run passes the limit by what the study says, or attains the bound."""
    found = uncertain(Scene.parse(THROWN), {UP: (4.7, 5.3), ALONG: (1.7, 2.3)}, limit=["P.y > 1.3", "P.speed > 9"])
    one, other = worst(found)
    assert (one.of, other.of) == ("P.y > 1.3", "P.speed > 9")
    file = tmp_path / "worst.yaml"
    one.save(file)
    motion = get_engine("gauss").simulate(load_scene(str(file)))
    assert motion.marker("P")[:, 1].max() == pytest.approx(1.3 - one.shown.margin, abs=1e-12)
    assert one.shown.margin == pytest.approx(1.3 - 5.3**2 / 20, abs=1e-3)
    (bound,) = worst(found, "P.x.upper")
    assert bound.shown.margin == pytest.approx(2.3)
    assert bound.scene.value(ALONG) == pytest.approx(2.3)
    with pytest.raises(InputError, match="neither a limit of the study"):
        worst(found, "P.z.upper")


@pytest.mark.parametrize("of", ["", "A.x > 9"])
def test_a_limit_that_no_run_comes_near_costs_no_answer(of: str, tmp_path: Path) -> None:
    """The answer is complete, and the worst case is the run that comes nearest: A.x grows with the angle."""
    file = tmp_path / "worst.yaml"
    words = ["uncertain", "single-pendulum", "--vary", "initial.OA.angle~normal(-1.3,0.01)", "--at", "0.5", "--json"]
    words += ["--limit", "A.x > 9", "--limit-runs", "200", "--no-verify", "--worst", str(file), "--worst-of", of]
    run = CliRunner().invoke(main, words)
    assert run.exit_code == 0
    (limit,) = json.loads(run.stdout)["limits"]
    assert limit["probability"] == 0
    assert 0 < limit["upper"] < 1e-6
    assert load_scene(str(file)).value("initial.OA.angle") > -1.3 + 4 * 0.01


def test_the_command_writes_the_worst_case(tmp_path: Path) -> None:
    file = tmp_path / "worst.yaml"
    words = ["uncertain", "single-pendulum", "--vary", "initial.OA.angle=-1.3:-1.2", "--at", "0.5,1,1.5", "--json"]
    run = CliRunner().invoke(main, [*words, "--worst", str(file), "--worst-of", "A.y.upper", "--no-verify"])
    assert run.exit_code == 0, run.output
    assert math.isclose(load_scene(str(file)).value("initial.OA.angle"), -1.2)
