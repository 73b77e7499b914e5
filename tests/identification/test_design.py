"""What a design promises beforehand is what fits to noisy data of another engine show afterwards."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from shoal.cli import main
from shoal.engines import get_engine
from shoal.errors import InputError
from shoal.identification import Measurement, Problem
from shoal.identification.design import Design, Sensor, design
from shoal.identification.design.precision import precision
from shoal.identification.forward import ForwardModel
from shoal.identification.methods.least_squares import descend
from shoal.identification.recording.observation import observe
from shoal.trajectory import Array

NOISE = 2e-3
DRAWS = 50
TRUTH = {"theta1": np.pi / 4, "theta2": np.pi / 6, "density": 1000.0}


def problem(**changes: Any) -> Problem:
    """Both angles of the rigid double pendulum and the density of its second rod, from the elbow."""
    angle = {"lower": -np.pi, "upper": np.pi}
    data: dict[str, Any] = {
        "name": "elbow",
        "scene": "rigid-double-pendulum",
        "parameters": {
            "theta1": {"path": "initial.OA.angle", **angle, "start": TRUTH["theta1"]},
            "theta2": {"path": "initial.AB.angle", **angle, "start": TRUTH["theta2"]},
            "density": {"path": "bodies.AB.density", "lower": 200.0, "upper": 5000.0, "start": 1000.0},
        },
        "channels": [{"marker": "A", "quantity": "x"}, {"marker": "A", "quantity": "y"}],
        "source": {"kind": "engine", "engine": "exudyn", "stop": 1.0, "count": 50},
        "noise": NOISE,
    }
    return Problem.parse({**data, **changes}, "elbow")


@cache
def designed() -> Design:
    return design(problem(), angle_noise=NOISE)


@cache
def scatter(candidate: Sensor) -> Array:
    """Standard deviations of the parameters over fits to data of Exudyn, each with its own noise, (parameters,)."""
    stated = problem()
    scene = stated.load_scene()
    times = np.arange(1, 51) / 50.0
    exact = observe(get_engine("exudyn").simulate(scene, times), candidate.channels)[0]
    rng = np.random.default_rng(4)
    found = []
    for _ in range(DRAWS):
        noisy = exact + NOISE * rng.standard_normal(exact.shape)
        measurement = Measurement.single(times, candidate.channels, noisy, "exudyn", TRUTH, NOISE)
        model = ForwardModel(stated, scene, get_engine("gauss"), measurement)
        descent = descend(model, model.parameters.to_vector(np.array(list(TRUTH.values()))), lambda *_: None)
        assert descent.converged
        found.append(model.parameters.to_values(descent.point))
    return np.std(found, axis=0, ddof=1)


def on_markers_of_the_scene() -> list[Sensor]:
    return [candidate for candidate, _ in designed().ranked if candidate.name in ("A", "B")]


@pytest.mark.parametrize("place", [0, *(pytest.param(one, marks=pytest.mark.slow) for one in range(1, 5))])
@pytest.mark.slow
def test_predicted_deviation_is_the_scatter_of_fits(place: int) -> None:
    # 50 draws know a standard deviation to 10 %, so that 30 % is three of its own.
    candidate = on_markers_of_the_scene()[place]
    predicted = next(found.std for other, found in designed().ranked if other == candidate)
    assert scatter(candidate) == pytest.approx(predicted, rel=0.3)


def test_the_encoder_of_the_joint_between_two_bodies_is_a_candidate() -> None:
    (encoder,) = [candidate for candidate, _ in designed().ranked if candidate.to is not None]
    assert encoder.label == "B against A, angle"
    assert "A" in [row["to"] for row in designed().to_json()["ranked"]]


@pytest.mark.slow
def test_the_recommended_marker_really_scatters_less() -> None:
    found = design(problem(), angle_noise=NOISE, parameter="theta2")
    best, k = found.ranked[0][0], found.aim.names.index("theta2")
    # It is another than the one measured now, or there would have been nothing to recommend.
    assert best.name == "B"
    (measured_now,) = [c for c in on_markers_of_the_scene() if c.name == "A" and c.quantity == "position"]
    assert scatter(best)[k] < 0.5 * scatter(measured_now)[k]


def test_more_tells_more() -> None:
    found = designed()
    assert np.all(np.diff(found.table, axis=0) < 0)
    assert np.all(np.diff(found.table, axis=1) < 0)
    # Each added instant adds information, whatever the marker.
    told = found.course[:, np.all(np.isfinite(found.course), axis=0)]
    assert told.shape[1] > 20
    assert np.all(np.diff(told, axis=1) <= 1e-9 * told[:, :-1])
    best = found.aim.score(found.ranked[0][1])
    assert all(found.aim.score(both) <= best * (1 + 1e-9) for _, both in found.second)


def test_twice_the_noise_is_twice_the_deviation() -> None:
    doubled = design(problem(), noise=2 * NOISE, angle_noise=2 * NOISE)
    assert doubled.now.std == pytest.approx(2 * designed().now.std, rel=1e-6)


def test_the_parameter_asked_for_decides() -> None:
    found = design(problem(), angle_noise=NOISE, parameter="theta1")
    k = found.aim.names.index("theta1")
    deviations = [one.std[k] for _, one in found.ranked]
    assert deviations == sorted(deviations)


def test_information_by_hand() -> None:
    # y = a + b t at t = 0, 1, 2 with unit noise: the covariance is the textbook's inverse of [[3, 3], [3, 5]].
    jacobian = np.array([[1.0, 0.0], [1.0, 1.0], [1.0, 2.0]])
    found = precision(jacobian, np.array([2.0, 10.0]))
    covariance = np.linalg.inv(jacobian.T @ jacobian)
    assert found.std == pytest.approx(np.sqrt(np.diag(covariance)))
    relative = np.diag([0.5, 0.1]) @ covariance @ np.diag([0.5, 0.1])
    assert found.a == pytest.approx(np.sqrt(np.trace(relative) / 2))
    assert found.d == pytest.approx(np.linalg.det(relative) ** 0.25)


def test_what_is_taken_as_known_by_hand() -> None:
    # y = a + b t + c t^2 at t = 0, 1, 2, where c is taken as 0 and is known with a standard deviation of 3.
    jacobian, c = np.array([[1.0, 0.0], [1.0, 1.0], [1.0, 2.0]]), 3 * np.array([[0.0, 1.0, 4.0]])
    found = precision(jacobian, np.array([2.0, 10.0]), moved=c)
    shift = np.linalg.lstsq(jacobian, c[0], rcond=None)[0]
    covariance = np.linalg.inv(jacobian.T @ jacobian) + np.outer(shift, shift)
    assert found.std == pytest.approx(np.sqrt(np.diag(covariance)))
    relative = np.diag([0.5, 0.1]) @ covariance @ np.diag([0.5, 0.1])
    assert found.a == pytest.approx(np.sqrt(np.trace(relative) / 2))
    assert found.d == pytest.approx(np.linalg.det(relative) ** 0.25)


def test_what_no_data_tell_is_infinite_and_null_in_json() -> None:
    # Both densities scale out of a free swing.
    both = {**problem().model_dump(mode="json")["parameters"]}
    both["density1"] = {"path": "bodies.OA.density", "lower": 200.0, "upper": 5000.0, "start": 1000.0}
    found = design(problem(parameters=both), angle_noise=NOISE)
    assert not found.ok
    assert np.isinf(found.now.std[found.aim.names.index("density")])
    assert np.isfinite(found.now.std[found.aim.names.index("theta1")])
    assert found.now.unknown == 1
    text = json.loads(json.dumps(found.to_json(), allow_nan=False))
    assert text["now"]["std"]["density"] is None
    assert text["status"] == "failed"
    assert text["message"].startswith("no sensor alone tells what is to be sharpened")


@pytest.mark.slow
def test_a_chaotic_motion_is_no_ground_for_a_design() -> None:
    found = design(problem(), duration=60.0, rate=5.0)
    assert not found.ok
    assert "the motion is chaotic" in found.message


def test_a_prior_counts() -> None:
    parameters = problem().model_dump(mode="json")["parameters"]
    parameters["density"]["prior"] = {"mean": 1000.0, "std": 1e-3}
    found = design(problem(parameters=parameters), angle_noise=NOISE)
    assert found.now.std[found.aim.names.index("density")] == pytest.approx(1e-3, rel=1e-3)


@pytest.mark.parametrize(
    ("changes", "options", "word"),
    [
        ({"noise": None}, {}, "noise: elbow states none"),
        ({}, {"noise": -1.0}, "noise: -1.0 is no standard deviation"),
        ({}, {"parameter": "mass"}, "parameter: no parameter 'mass'"),
        ({}, {"duration": 1e5}, "at most 1000 in all"),
        ({}, {"at": {"theta1": 0.0}}, "at: no value for theta2"),
        (
            {"source": {"kind": "file"}, "channels": [{"marker": "A", "quantity": "x", "column": "x"}]},
            {},
            "duration: need",
        ),
    ],
)
def test_bad_wishes_are_refused_in_one_line(changes: dict[str, Any], options: dict[str, Any], word: str) -> None:
    with pytest.raises(InputError, match=word) as refusal:
        design(problem(**changes), **options)
    assert "\n" not in str(refusal.value)


@pytest.mark.slow
def test_the_command_designs_about_the_answer_and_draws(tmp_path: Path) -> None:
    picture = tmp_path / "design.png"
    options = ["design", "paper-case-1", "--noise", "0.002", "--json", "--out", str(picture)]
    ran = CliRunner().invoke(main, options)
    assert ran.exit_code == 0, ran.output
    found = json.loads(ran.stdout)
    # The answer, not the middle of the bounds, which is zero.
    assert found["values"]["theta1"] == pytest.approx(np.pi / 4, abs=2e-3)
    assert (found["duration"], found["rate"]) == (0.5, 100.0)
    assert {one["quantity"] for one in found["ranked"]} == {"position"}
    assert picture.read_bytes().startswith(b"\x89PNG")
