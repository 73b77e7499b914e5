"""Parameters of machines in space from the places of markers, computed in other coordinates than the solver's."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from scipy.integrate import solve_ivp
from shoal.errors import InputError
from shoal.identification import Estimate, Problem, identify, measure
from shoal.identification.design import design
from shoal.trajectory import Array

NOISE = 1e-3
FINE = {"integrator": "dop853", "relative_tolerance": 1e-9, "absolute_tolerance": 1e-10, "duration": 2.0}
TRUTH = {"azimuth": 1.1, "length": 0.8}


def spherical(length: float, azimuth: float, times: Array) -> Array:
    """A thin rod on a ball joint, released level along x with an azimuth rate [rad/s]: its tip [m], (times, 3).

    In polar angles: the angle from below by Lagrange's equation, the azimuth by its integral.
    """
    moment = azimuth  # sin^2(theta) phi' at the start

    def rate(_: float, state: Any) -> Any:
        theta, speed, _ = state
        turning = moment / np.sin(theta) ** 2
        return [speed, np.sin(theta) * np.cos(theta) * turning**2 - 1.5 * 9.81 / length * np.sin(theta), turning]

    found = solve_ivp(
        rate, (0, times[-1]), [np.pi / 2, 0.0, 0.0], t_eval=times, rtol=1e-11, atol=1e-12, method="DOP853"
    )
    theta, _, phi = found.y
    return length * np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), -np.cos(theta)], axis=1)


@pytest.fixture
def problem(tmp_path: Path) -> Problem:
    """The length of a rod and how it was spun, from a recording of its tip with noise of 1 mm."""
    scene = {
        "name": "rod", "dimensions": 3, "gravity": [0, 0, -9.81], "solver": FINE,
        "bodies": {"R": {"kind": "rod", "length": 1.0, "height": 0.01, "width": 0.01, "density": 1000.0}},
        "joints": {"O": {"kind": "spherical", "first": {"body": "ground", "point": [0, 0, 0]},
                         "second": {"body": "R"}}},
        "markers": {"tip": {"body": "R", "point": "end"}},
        "initial": {"R": {"rotation": [0, 0, 0], "spin": [0, 0, 0.5]}},
    }  # fmt: skip
    (tmp_path / "rod.yaml").write_text(yaml.safe_dump(scene), encoding="utf-8")
    times = np.linspace(0.0, 1.5, 76)
    tip = spherical(TRUTH["length"], TRUTH["azimuth"], times)
    tip += NOISE * np.random.default_rng(5).normal(size=tip.shape)
    table = np.column_stack([times, tip])
    np.savetxt(tmp_path / "tip.csv", table, delimiter=",", header="t,x,y,z", comments="")
    channels = [{"marker": "tip", "quantity": axis, "column": axis} for axis in "xyz"]
    return Problem.parse({
        "name": "rod", "scene": str(tmp_path / "rod.yaml"), "channels": channels, "noise": NOISE,
        "source": {"kind": "file", "path": str(tmp_path / "tip.csv")},
        "parameters": {"azimuth": {"path": "initial.R.spin.2", "lower": -3.0, "upper": 3.0},
                       "length": {"path": "bodies.R.length", "lower": 0.3, "upper": 2.0}},
    }, "rod")  # fmt: skip


def found_by(problem: Problem, **options: Any) -> Estimate:
    return identify(problem, measurement=measure(problem, problem.load_scene()), **options)


def test_length_and_spin_are_found_with_intervals_that_hold_them(problem: Problem) -> None:
    found = found_by(problem, method="least-squares")
    assert found.verdict == "identified", found.message
    for name, true in TRUTH.items():
        value = found.parameters[name]
        assert value.lower < true < value.upper
        assert value.upper - value.lower < 0.02
    assert found.fitness == pytest.approx(3 * NOISE**2, rel=0.25)


@pytest.mark.slow
def test_a_model_with_another_gravity_is_rejected_and_gravity_named(problem: Problem) -> None:
    found = found_by(problem, method="least-squares", values={"gravity": [0.0, 0.0, -12.0]})
    assert found.verdict == "model rejected"
    assert "gravity" in found.message


@pytest.mark.parametrize("quantity", ["angle", "rate"])
def test_angles_are_refused_in_space_and_z_in_the_plane(problem: Problem, quantity: str) -> None:
    angle = problem.model_copy(update={"channels": [problem.channels[0].model_copy(update={"quantity": quantity})]})
    with pytest.raises(InputError, match="is measured in the plane"):
        angle.load_scene()
    plane = problem.model_copy(update={"scene": "rigid-double-pendulum", "parameters": {}, "channels": [
        problem.channels[2].model_copy(update={"marker": "B"})]})  # fmt: skip
    with pytest.raises(InputError, match="z is measured in space"):
        plane.load_scene()


def test_experiments_are_designed_in_space(problem: Problem) -> None:
    found = design(problem, duration=1.0, rate=50.0, sensor_noise={"acceleration": 0.05, "rate": 0.005, "force": 0.05})
    assert found.ok
    assert {"imu", "force"} <= {sensor.quantity for sensor, _ in found.ranked}
