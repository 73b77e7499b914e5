"""Probabilities of passing a limit, against closed forms and quadrature."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from click.testing import CliRunner
from scipy import stats
from shoal.cli import main
from shoal.errors import InputError
from shoal.notebook import uncertain
from shoal.response.inputs import Inputs, UncertainParameter
from shoal.response.limits.choice import WAYS, probability
from shoal.response.limits.estimate import weighted
from shoal.response.limits.form import design_points
from shoal.response.limits.importance import Outside
from shoal.response.limits.limit import limit
from shoal.response.limits.margins import Margins
from shoal.response.marginals import Frozen, Uniform
from shoal.response.read import parameters
from shoal.response.runs import Answers
from shoal.scene import Scene, load_scene
from shoal.trajectory import Array
from shoal_validation.uncertain.limits import MOST, STATES, cube, margins, plane, repeated
from shoal_validation.uncertain.reached import REPETITIONS
from thrown import ALONG, THROWN, UP


@pytest.mark.slow
@pytest.mark.parametrize(
    "state",
    [
        "a plane, 1e-7",
        *(
            pytest.param(name, marks=pytest.mark.slow)
            for name in ("four branches", "curved away", "two unequal design points")
        ),
    ],
)
def test_probabilities_of_closed_forms(state: str) -> None:
    told = repeated(state, "auto", 20)
    assert told.held >= 0.9
    assert told.ratios.mean() == pytest.approx(1.0, abs=0.02)
    assert told.within >= 0.9


@pytest.mark.slow
@pytest.mark.parametrize(
    "state",
    ["a sphere, 1e-6, eight parameters", "two rods in line, 1e-6"],
)
def test_limits_that_surround_the_mean(state: str) -> None:
    """Between any few design points lies most of the probability; it was left out, and nothing told."""
    told = repeated(state, "auto", 8)
    assert told.held >= 0.75
    assert told.doubted == 0
    assert np.abs(told.ratios - 1).max() < 0.1


@pytest.mark.slow
def test_more_design_points_than_are_found_are_a_doubt() -> None:
    """Sixteen sides of a cube: some are missed, and what is told is then too low."""
    function, exact = cube(4.0, 8)
    for seed in range(6):
        found = probability(margins(function, 8), "auto", seed)
        assert found.findings or exact <= found.estimate.interval[1][-1], seed


@pytest.mark.parametrize("way", ["auto", "importance"])
def test_a_design_point_around_which_no_run_passes_is_a_doubt(way: str) -> None:
    """Three rods in line, turned at random by up to a turn and more: P = 9e-6, and first order says a third."""
    run = margins(lambda x: 2.995 - np.cos(15 * stats.norm.cdf(x) - 6).sum(axis=1), 3)
    found = probability(run, way, 0)
    assert found.estimate.probability == 0
    assert found.estimate.described.startswith("below 0.00")
    assert "none-exceeds-at-design-point" in [one.code for one in found.findings]


def test_runs_drawn_all_around_are_those_that_lie_there() -> None:
    """Beyond a distance in two of three directions: of the normal distribution given that, by the chi-squared one."""
    axes = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0][:2]
    outside = Outside(axes, 3.0)
    assert outside.probability == pytest.approx(math.exp(-4.5))
    places = outside.draw(4000, np.random.default_rng(1))
    assert outside.reaches(places).all()
    squares = np.sum((places @ axes.T) ** 2, axis=1)
    assert stats.kstest(squares - 9, stats.chi2(2).cdf).pvalue > 0.01
    assert stats.kstest(places @ np.cross(*axes), stats.norm.cdf).pvalue > 0.01


@pytest.mark.slow
@pytest.mark.parametrize("state", STATES)
def test_intervals_hold_as_often_as_they_say(state: str) -> None:
    """95 % of many repetitions, within what these can tell."""
    told = repeated(state, "auto", REPETITIONS)
    assert 0.92 <= told.held <= 0.98
    assert told.doubted <= 0.02
    assert told.runs <= MOST
    assert told.ratios.mean() == pytest.approx(1.0, abs=0.02)
    assert told.within >= 0.95


@pytest.mark.slow
@pytest.mark.parametrize("state", STATES)
def test_subset_simulation_holds_as_often_as_it_says(state: str) -> None:
    told = repeated(state, "subset", 100)
    assert told.held >= 0.92
    assert told.ratios.mean() == pytest.approx(1.0, abs=0.2)


def test_a_plain_half_space_by_every_way() -> None:
    """Phi(-2.5): FORM to the last digits, the others within their intervals."""
    for way in WAYS:
        function, exact = plane(2.5, 3)
        found = probability(margins(function, 3), way, 1)
        if way == "form":
            assert found.estimate.probability == pytest.approx(exact, rel=1e-6)
        else:
            lower, upper = found.estimate.interval
            assert lower[-1] <= exact <= upper[-1], way


def test_design_points_of_a_limit_more_curved_than_the_sphere() -> None:
    """Where HL-RF alone goes to and fro: 5 + 0.2 s^2 = t, nearest at (0, 5)."""
    run = margins(lambda x: 5 + 0.2 * x[:, 0] ** 2 - x[:, 1], 2)
    (found,) = design_points(run, np.array([[1.0, 5.5], [-2.0, 6.0]]))
    assert found.converged
    assert found.beta == pytest.approx(5.0, abs=1e-3)
    assert found.place == pytest.approx([0.0, 5.0], abs=1e-2)


def test_a_limit_that_is_never_passed() -> None:
    found = probability(margins(lambda x: 1 + x[:, 0] ** 2, 2), "auto", 0)
    lower, upper = found.estimate.interval
    assert found.estimate.probability == 0.0
    assert 0 <= lower[-1] < upper[-1] < 1e-3
    assert "none has passed" in found.why


def test_a_quantity_that_does_not_vary_is_told() -> None:
    """With random numbers of the size of round-off on it, and what it is below as the probability has it."""
    found = probability(margins(lambda x: 1 + 1e-14 * x[:, 0], 2), "auto", 0)
    assert found.estimate.probability == 0.0
    assert "all stay 1 away from the limit: nothing that varies seems to change its quantity" in found.why
    varies = probability(margins(lambda x: 1 + x[:, 0] ** 2, 2), "auto", 0)
    assert f"whose probability is {varies.estimate.described} or" in varies.why


def test_where_all_runs_pass_the_limit_some_others_may_not() -> None:
    """As many as may hide from n runs: 1 - 0.025^(1 / n) of all (Clopper and Pearson)."""
    found = weighted(np.full((1000, 1), -1.0), np.ones(1000), "")
    assert found.interval[0][0] == pytest.approx(0.025 ** (1 / 1000), rel=1e-9)
    assert found.interval[1][0] == 1.0


def test_failed_runs_widen_the_interval() -> None:
    run = margins(lambda x: 2.0 - x[:, 0], 1)
    healthy = run.model

    def sick(values: dict[str, Array]) -> Answers:
        told = healthy(values)
        return Answers(told.values, values["x0"] < 2.5, 0, "too far")

    run.model = sick  # type: ignore[assignment]
    found = probability(run, "monte-carlo", 0)
    assert run.failed > 0
    assert found.estimate.interval[1][-1] > stats.norm.sf(2.0)


def test_other_distributions_are_brought_to_normal_ones() -> None:
    """x uniform, y exponential: P(x + y > 12), x in [0, 1], mean of y 1, is (e - 1) exp(-12)."""
    pair = (
        UncertainParameter("x", Uniform(0.0, 1.0), {"x": 1.0}),
        UncertainParameter("y", Frozen(stats.expon()), {"y": 1.0}),
    )

    def model(values: dict[str, Array]) -> Answers:
        return Answers(12 - values["x"][:, None] - values["y"][:, None], np.ones(len(values["x"]), dtype=bool))

    found = probability(Margins(model, Inputs(pair), MOST), "auto", 0)  # type: ignore[arg-type]
    assert found.estimate.probability == pytest.approx((math.e - 1) * math.exp(-12), rel=0.1)


def test_a_thrown_body() -> None:
    """P(v^2 / 20 > h), v normal, and the distribution of the first passage: both in closed form."""
    height = 2.0
    found = uncertain(Scene.parse(THROWN), [f"{UP}~normal(5,0.3)", f"{ALONG}~normal(2,0.3)"], limit=[f"P.y > {height}"])
    assert found.ok
    (told,) = found.to_json()["limits"]
    passage = told["first_passage"]
    times = np.maximum(passage["t"], 1e-9)
    # The least speed that passes the height at one of the instants up to each.
    expected = stats.norm.sf((np.minimum.accumulate(height / times + 5 * times) - 5) / 0.3)
    assert expected[-1] == pytest.approx(stats.norm.sf((math.sqrt(20 * height) - 5) / 0.3), rel=0.05)
    assert told["probability"] == pytest.approx(expected[-1], rel=0.1)
    assert told["lower"] <= expected[-1] <= told["upper"]
    assert told["evaluations"] <= 5000
    lower, upper = (np.array(passage[side][20:]) for side in ("lower", "upper"))
    assert np.mean((lower <= expected[20:]) & (expected[20:] <= upper)) > 0.85
    (point,) = told["design_points"]
    assert point["parameters"][UP] == pytest.approx(math.sqrt(20 * height), rel=1e-3)
    assert point["sensitivity"][ALONG] == pytest.approx(0.0, abs=1e-6)
    assert told["shown_by"]["margin"] == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize(
    ("text", "passed"), [("P.y > 1.3", True), ("P.y > 1.5", False), ("P.speed > 5.7", True), ("P.vy < -5.9", False)]
)
def test_limits_of_intervals(text: str, passed: bool) -> None:
    """Heights up to 5.3^2 / 20 = 1.4045; speeds up to sqrt(28.09 + 5.29); falling at most at 10 - 4.7."""
    found = uncertain(Scene.parse(THROWN), {UP: (4.7, 5.3), ALONG: (1.7, 2.3)}, limit=[text])
    (judged,) = found.limits
    assert judged.kept is not passed
    shown = judged.shown
    assert shown is not None
    assert (shown.margin < 0) is passed
    if text != "P.speed > 5.7":  # attained at the start of the fast one and at the end of the slow one
        assert shown.parameters[UP] == pytest.approx(4.7 if text.startswith("P.vy") else 5.3)


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("P.y", "is not"),
        ("P.y < low", "no finite number"),
        ("Q.y < 1", "no marker 'Q'"),
        ("P.weight < 1", "no quantity 'weight'"),
        ("P < 1", "no quantity 'P'"),
        ("abs(P.y < 1", "is not"),
    ],
)
def test_wrong_limits_are_named(text: str, names: str) -> None:
    with pytest.raises(InputError, match=names):
        limit(text, Scene.parse(THROWN))


def test_the_command_tells_of_limits() -> None:
    words = ["uncertain", "single-pendulum", "--vary", "initial.OA.angle=-1.3:-1.2", "--at", "0.5,1,1.5", "--json"]
    run = CliRunner().invoke(main, [*words, "--limit", "A.y > -0.95", "--limit", "abs(A.angle) > 4"])
    assert run.exit_code == 0, run.output
    one, other = json.loads(run.stdout)["limits"]
    assert one["kept"] is False
    assert other["kept"] is True
    wrong = CliRunner().invoke(main, [*words, "--limit", "A.y > -0.95", "--limit-method", "luck", "--seed", "1"])
    assert wrong.exit_code == 2
    assert "there are auto, form" in wrong.output


@pytest.mark.slow
def test_a_double_pendulum_against_plain_sampling() -> None:
    """First passage over all instants: importance sampling within the intervals of 20 000 plain runs."""
    scene = load_scene("rigid-double-pendulum")
    vary = [f"initial.{body}.angle~normal({mean},0.02)" for body, mean in (("OA", 0.785), ("AB", 0.524))]
    vary.append("bodies.AB.length~normal(2,0.02)")
    known, text = parameters(vary, scene), "B.speed > 14.5"
    auto, plain = (
        uncertain(scene, known, limit=[text], limit_method=way, limit_runs=runs, method="sobol", count=64, verify=False)
        .limits[0]
        .exceedance
        for way, runs in (("auto", 5000), ("monte-carlo", 20_000))
    )
    assert auto is not None
    assert plain is not None
    lower, upper = auto.estimate.interval
    low, high = plain.estimate.interval
    assert max(lower[-1], low[-1]) <= min(upper[-1], high[-1])
