"""The noise of a measured drive is in the intervals: the model follows it, so that no residual shows it."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from shoal.engines import get_engine
from shoal.identification import Measurement, Problem, identify, measure
from shoal.identification.design import design
from shoal.identification.evidence import evidence
from shoal.identification.forward import ForwardModel
from shoal.identification.uncertainty.uncertain_inputs import noisy_signals
from shoal.scene import Scene, load_scene

INERTIA, NOISE, ANGLE_NOISE = 0.1, 0.03, 1e-5
ROWS = np.linspace(0.0, 1.0, 26)
TIMES = np.linspace(0.02, 1.0, 50)


def rotor(folder: Path, torques: np.ndarray, noise: float | None) -> Problem:
    """A rotor about its centre whose torque [N m] was measured at ROWS; the inertia is sought by its angle."""
    np.savetxt(folder / "torque.csv", np.column_stack([ROWS, torques]), delimiter=",", header="t,motor", comments="")
    angles = swept(0.2 * np.sin(5.0 * ROWS)) / INERTIA
    angles = angles + ANGLE_NOISE * np.random.default_rng(5).standard_normal(len(angles))
    np.savetxt(folder / "run.csv", np.column_stack([TIMES, angles]), delimiter=",", header="t,angle", comments="")
    signal: dict[str, Any] = {"path": "torque.csv", "column": "motor", "smooth": False}
    signal |= {} if noise is None else {"noise": noise}
    body = {"kind": "rigid-body", "mass": 1.0, "inertia": INERTIA, "named_points": {"tip": [0.1, 0.0]}}
    scene = {
        "name": "rotor",
        "bodies": {"rotor": body},
        "joints": {"pivot": {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "rotor"}}},
        "loads": {"motor": {"kind": "torque", "at": {"body": "rotor"}, "torque": signal}},
        "markers": {"tip": {"body": "rotor", "point": "tip"}},
        "solver": {"duration": 1.0},
    }  # fmt: skip
    (folder / "rotor.yaml").write_text(yaml.safe_dump(scene))
    return Problem.parse(
        {
            "name": "rotor",
            "scene": str(folder / "rotor.yaml"),
            "parameters": {"inertia": {"path": "bodies.rotor.inertia", "lower": 0.02, "upper": 0.5, "start": 0.1}},
            "channels": [{"marker": "tip", "quantity": "angle", "column": "angle", "noise": ANGLE_NOISE}],
            "source": {"kind": "file", "path": str(folder / "run.csv"), "start": 0.0},
            "method": "least-squares",
        },
        "rotor",
    )


def swept(torques: np.ndarray) -> np.ndarray:
    """Two integrals over time of straight lines through ROWS, at TIMES, of (rows,) or (rows, k)."""
    fine = np.linspace(0.0, 1.0, 25 * 400 + 1)
    lines = np.stack([np.interp(fine, ROWS, column) for column in np.atleast_2d(torques.T)], axis=1)
    step = fine[1]
    once = np.concatenate([np.zeros((1, lines.shape[1])), np.cumsum((lines[1:] + lines[:-1]) / 2 * step, axis=0)])
    twice = np.concatenate([np.zeros((1, lines.shape[1])), np.cumsum((once[1:] + once[:-1]) / 2 * step, axis=0)])
    found = np.stack([np.interp(TIMES, fine, column) for column in twice.T], axis=1)
    return found[:, 0] if torques.ndim == 1 else found


def test_what_the_noise_of_a_torque_does_to_an_inertia_is_that_of_the_closed_form(tmp_path: Path) -> None:
    """The angle is the torque's two integrals over the inertia: both are linear in what each sample was off by."""
    problem = rotor(tmp_path, 0.2 * np.sin(5.0 * ROWS), NOISE)
    scene = problem.load_scene()
    assert {path: noise for path, (_, noise) in noisy_signals(scene).items()} == {"loads.motor.torque": NOISE}
    model = ForwardModel(problem, scene, get_engine("gauss"), measure(problem, scene))
    near = evidence(model, np.log([INERTIA]))
    effects = swept(np.eye(len(ROWS)) * NOISE) / INERTIA
    angles = swept(0.2 * np.sin(5.0 * ROWS)) / INERTIA
    # The logarithm of the inertia turns the angle by minus itself.
    variance = np.sum((angles @ effects / (angles @ angles)) ** 2)
    assert np.sqrt(near.at.parts[-1][0, 0]) == pytest.approx(np.sqrt(variance), rel=0.3)
    assert np.sqrt(near.at.covariance[0, 0]) > 10 * np.sqrt(near.at.parts[0][0, 0])
    planned = design(problem, duration=1.0, rate=50.0)
    assert planned.now.std[0] == pytest.approx(INERTIA * np.sqrt(variance), rel=0.3)
    assert planned.given[-1] == "the noise of loads.motor.torque (0.03 N m)"


def test_an_inertia_is_within_its_interval_though_its_drive_was_measured_with_noise(tmp_path: Path) -> None:
    torques = 0.2 * np.sin(5.0 * ROWS) + NOISE * np.random.default_rng(3).standard_normal(len(ROWS))
    found = identify(rotor(tmp_path, torques, NOISE))
    inertia = found.parameters["inertia"]
    assert found.verdict.trusted
    assert inertia.lower < INERTIA < inertia.upper
    assert "the noise of loads.motor.torque (0.03 N m) widens the interval of inertia" in found.message


@pytest.mark.parametrize(("stated", "size"), [({}, 1e-3), ({"noise": 2e-3}, 2e-3), ({"noise": 0.0}, None)])
def test_the_samples_of_a_drive_show_their_noise_and_those_of_a_force_may_be_meant(stated: Any, size: Any) -> None:
    times = np.linspace(0.0, 1.2, 240)
    drawn = np.random.default_rng(1).standard_normal((2, len(times)))
    angle = np.column_stack([times, 0.3 * np.sin(2.0 * times) + 1e-3 * drawn[0]]).tolist()
    torque = {
        "kind": "torque",
        "at": {"body": "crank"},
        "torque": {"table": np.column_stack([times, drawn[1]]).tolist()},
    }
    ground = {"body": "ground", "point": [0.0, 0.0]}
    motor = {"kind": "driven-angle", "first": ground, "second": {"body": "crank"}, "angle": {"table": angle, **stated}}
    scene = Scene.parse(
        {
            "name": "driven",
            "bodies": {"crank": {"kind": "rigid-body", "mass": 1.0, "inertia": 1.0}},
            "joints": {"pin": {"first": ground, "second": {"body": "crank"}}, "motor": motor},
            "loads": {"random": torque},
            "markers": {"tip": {"body": "crank"}},
        }
    )
    found = {path: noise for path, (_, noise) in noisy_signals(scene).items()}
    assert found == ({} if size is None else {"joints.motor.angle": pytest.approx(size, rel=0.1)})


def test_a_drive_without_noise_costs_nothing(tmp_path: Path) -> None:
    problem = rotor(tmp_path, 0.2 * np.sin(5.0 * ROWS), None)
    scene = load_scene(problem.scene)
    nothing = Measurement.single(TIMES, tuple(problem.channels), np.zeros((len(TIMES), 1)), "nothing", noise=1.0)
    near = evidence(ForwardModel(problem, scene, get_engine("gauss"), nothing), np.log([INERTIA]))
    assert len(near.at.parts) == len(near.blocks)
    assert near.given == []
