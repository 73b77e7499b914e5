"""Recovered numbers against the truth of data that other engines computed, and against published ones."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from shoal.errors import InputError
from shoal.identification import METHODS, Estimate, Measurement, Problem, Verdict, identify, load_problem, measure

RECORDINGS = Path(__file__).parents[3] / "shared" / "data" / "multiarm_kaheman"


@cache
def data(name: str) -> tuple[Problem, Measurement]:
    problem = load_problem(name)
    return problem, measure(problem, problem.load_scene())


def run(name: str, method: str, **options: object) -> Estimate:
    problem, measurement = data(name)
    return identify(problem, method=method, measurement=measurement, **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["paper-case-1-same-mesh", "paper-case-2-same-mesh"])
def test_least_squares_on_casadi_data_of_the_same_mesh_is_exact(name: str) -> None:
    estimate = run(name, "least-squares")
    assert estimate.verdict is Verdict.IDENTIFIED
    assert estimate.evaluations <= 30
    assert estimate.fitness < 1e-16
    for parameter, true in estimate.truth.items():
        assert estimate.parameters[parameter].value == pytest.approx(true, abs=1e-8)


@pytest.mark.parametrize("name", ["paper-case-1", "paper-case-2"])
@pytest.mark.by_day(1)
def test_data_from_exudyns_fine_mesh_lie_within_the_intervals(name: str) -> None:
    estimate = run(name, "least-squares")
    assert estimate.verdict is Verdict.IDENTIFIED
    assert "mesh-error" in estimate.codes
    for parameter, true in estimate.truth.items():
        found = estimate.parameters[parameter]
        assert found.value == pytest.approx(true, abs=1e-3)
        assert found.lower <= true <= found.upper
        # The finer mesh predicts where the coarser one leads astray.
        assert found.correction is not None
        assert found.value + found.correction == pytest.approx(true, abs=1e-4)


def test_where_nothing_can_be_simulated_the_reason_is_told() -> None:
    problem, measurement = data("paper-case-1")
    strict = problem.model_copy(update={"values": {**problem.values, "solver.energy_tolerance": 1e-12}})
    estimate = identify(strict, method="least-squares", measurement=measurement)
    assert estimate.verdict is Verdict.FAILED
    assert estimate.codes[0] == "not-simulated"
    assert "(energy is off by" in estimate.message
    # There is no residual, and nothing is said of its size.
    assert estimate.residual_tests.sentences() == []
    assert set(estimate.to_json()["residual_tests"].values()) == {None}
    assert estimate.to_json()["residual_autocorrelation"] is None


def test_both_elbow_branches_are_looked_at() -> None:
    estimate = run("paper-case-1", "least-squares")
    assert len(estimate.minima) == 1
    assert estimate.minima[0]["fitness"] > 100 * estimate.fitness


# The multiple shooting is for rigid chains: test_multiple_shooting.py.
OTHERS = ("auto", "casadi", "casadi-multiple", "multiple-shooting", "afsa")


# By day test_methods.py finds parameters by every method.
DAILY = ("least-squares", "iafsa")


@pytest.mark.by_day(1)
@pytest.mark.parametrize(
    "method",
    [pytest.param(name, marks=[pytest.mark.slow] * (name not in DAILY)) for name in METHODS if name not in OTHERS],
)
def test_every_native_method_finds_the_angles(method: str) -> None:
    estimate = run("paper-case-1", method, seed=1)
    for parameter, true in estimate.truth.items():
        assert estimate.parameters[parameter].value == pytest.approx(true, abs=1e-3)
    best = np.array([row[1] for row in estimate.iterations])
    assert np.all(np.diff(best) <= 0)
    assert estimate.fitness == pytest.approx(best[-1])
    assert estimate.history[0][-1] == estimate.evaluations


@pytest.mark.slow
def test_the_published_swarm_comes_near_and_says_what_it_cost() -> None:
    estimate = run("paper-case-1", "afsa", seed=1)
    assert estimate.evaluations > 4000
    assert estimate.fitness < 1e-3


@pytest.mark.slow
def test_the_same_seed_gives_the_same_answer() -> None:
    one, other = (run("paper-case-1", "iafsa-unseeded", seed=3) for _ in range(2))
    assert one.parameters == other.parameters
    assert one.evaluations == other.evaluations < 4040


@pytest.mark.slow
def test_a_rigid_model_of_a_flexible_machine_is_not_passed_off_as_exact() -> None:
    values = {"bodies.OA.element": "rigid", "bodies.AB.element": "rigid", "solver.integrator": "rk4"}
    estimate = run("paper-case-1", "least-squares", values=values)
    wrong = max(abs(estimate.parameters[name].value - true) for name, true in estimate.truth.items())
    assert wrong > 0.02
    assert estimate.fitness > 1e-4


def test_one_instant_tells_a_pose_but_not_how_certain_it_is(tmp_path: Path) -> None:
    (tmp_path / "one.csv").write_text("t,x,y\n0.0,0.50,-0.866\n0.1,,\n0.2,,\n")
    angle = {"path": "initial.OA.angle", "lower": -3.0, "upper": 3.0}
    channels = [{"marker": "A", "quantity": "x", "column": "x"}, {"marker": "A", "quantity": "y", "column": "y"}]
    source = {"kind": "file", "path": str(tmp_path / "one.csv")}
    fields = {"name": "one", "scene": "single-pendulum", "parameters": {"angle": angle}, "channels": channels}
    estimate = identify(Problem.model_validate({**fields, "source": source}))
    assert estimate.verdict is Verdict.FAILED
    assert estimate.codes[0] == "too-few-samples"
    assert estimate.findings[0].numbers == {"rows": 2, "parameters": 1}
    assert not estimate.parameters["angle"].identifiable
    assert estimate.parameters["angle"].value == pytest.approx(-np.pi / 3, abs=1e-3)
    noisy = [{**channel, "noise": 1e-3} for channel in channels]
    stated = identify(Problem.model_validate({**fields, "channels": noisy, "source": source}))
    assert stated.verdict is Verdict.IDENTIFIED
    assert 1e-4 < stated.parameters["angle"].std < 1e-2


@pytest.mark.parametrize("method", ["auto", "least-squares", pytest.param("iafsa", marks=pytest.mark.slow)])
def test_a_step_that_no_lane_can_take_is_refused_with_its_limit(method: str) -> None:
    with pytest.raises(InputError, match=r"solver\.step: 0\.01 s is beyond the stability limit"):
        run("paper-case-1", method, values={"solver.step": 0.01})


def test_unknown_method_is_refused() -> None:
    with pytest.raises(InputError, match="no method 'magic'"):
        run("paper-case-1", "magic")


@pytest.mark.skipif(not RECORDINGS.is_dir(), reason="the recordings are not here")
@pytest.mark.slow
def test_real_double_pendulum_gives_the_published_ratios() -> None:
    """Kaheman et al. 2022, arXiv:2205.06231: J2/J1 .5568, C/J1 .4913, G1/J1 58.96, G2/J1 27.90."""
    estimate = identify(load_problem("kaheman-double"), data=str(RECORDINGS / "double_1kHz.csv.gz"))
    assert estimate.verdict is Verdict.COMBINATION
    assert estimate.rms < 2e-3
    published = {"J2/J1": 0.5568, "C/J1": 0.4913, "G1/J1": 58.96, "G2/J1": 27.90}
    for name, value in published.items():
        assert estimate.quantities[name].value == pytest.approx(value, rel=0.03)
        assert estimate.quantities[name].identifiable
    assert not any(estimate.parameters[name].identifiable for name in ("a1", "I1", "m2", "a2", "I2"))
    assert len(estimate.combinations) == 2


@pytest.mark.slow
@pytest.mark.skipif(not RECORDINGS.is_dir(), reason="the recordings are not here")
def test_real_single_pendulum() -> None:
    """Authors' numbers give G/J = m a g / (I + m a^2) = 64.2 with their own arm inertia."""
    estimate = identify(load_problem("kaheman-single"), data=str(RECORDINGS / "single_1kHz.csv.gz"))
    assert estimate.rms < 2e-3
    assert estimate.quantities["G/J"].value == pytest.approx(64.2, rel=0.01)
