"""A camera [m] beside an IMU [m/s², rad/s] and an encoder [rad] whose noise nobody states: recordings by scipy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from shoal.engines import get_engine
from shoal.identification import Estimate, Measurement, Problem, Verdict
from shoal.identification.conclude import conclude
from shoal.identification.deadline import TimeIsUp
from shoal.identification.diagnostics.suspects import search
from shoal.identification.forward import ForwardModel
from shoal.identification.methods import get_method
from shoal.identification.recording.measurement import differences
from shoal.scene import Scene
from shoal.trajectory import Array

MASS, REACH, FELT, LENGTH, WEIGHT = 1.0, 0.25, 0.4, 0.5, 9.81
TRUTH = {"angle": -0.5, "rate": 0.5, "inertia": 0.02, "friction": 0.01}
NOISE = {"x": 1e-3, "y": 1e-3, "ax": 0.05, "ay": 0.05, "rate": 0.01, "angle": 3e-3}


def recorded(times: Any, tilt: float, spring: float, rng: np.random.Generator) -> dict[str, Array]:
    """What all sensors show of a pendulum; tilt [rad] of gravity, spring [N m/rad] that is at rest hanging."""
    down = -np.pi / 2 + tilt

    def bend(angle: Any, rate: Any) -> Any:
        torque = MASS * WEIGHT * REACH * np.sin(down - angle) - TRUTH["friction"] * rate
        return (torque - spring * (angle + np.pi / 2)) / (TRUTH["inertia"] + MASS * REACH**2)

    start = [TRUTH["angle"], TRUTH["rate"]]
    angle, rate = solve_ivp(lambda _, y: [y[1], bend(*y)], (0.0, times[-1]), start, "DOP853", times, rtol=1e-10,
                            atol=1e-11).y  # fmt: skip
    # An accelerometer feels the acceleration less that of gravity, along the arm and across it.
    felt = {
        "ax": -FELT * rate**2 - WEIGHT * np.cos(down - angle),
        "ay": FELT * bend(angle, rate) - WEIGHT * np.sin(down - angle),
    }
    seen = {"x": LENGTH * np.cos(angle), "y": LENGTH * np.sin(angle), **felt, "rate": rate, "angle": angle}
    return {name: signal + NOISE[name] * rng.standard_normal(len(times)) for name, signal in seen.items()}


def identified(names: list[str], seed: int, tilt: float = 0.0, spring: float = 0.0, stated: bool = False) -> Estimate:
    times: Any = np.arange(1, 201) * 0.01
    seen = recorded(times, tilt, spring, np.random.default_rng(seed))
    scene = Scene.parse({
        "name": "pendulum",
        "bodies": {"A": {"kind": "rigid-body", "mass": MASS, "inertia": 0.02, "centre_of_mass": [REACH, 0.0],
                         "named_points": {"end": [LENGTH, 0.0], "imu": [FELT, 0.0]}}},
        "joints": {"O": {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "A"}, "friction": 0.01}},
        "markers": {"e": {"body": "A", "point": "end"}, "i": {"body": "A", "point": "imu"}},
        "initial": {"A": {"angle": -0.8, "rate": 0.5}},
    })  # fmt: skip
    problem = Problem.parse({
        "name": "mixed", "scene": "pendulum",
        "parameters": {"angle": {"path": "initial.A.angle", "lower": -3.5, "upper": 0.0},
                       "rate": {"path": "initial.A.rate", "lower": -5.0, "upper": 5.0},
                       "inertia": {"path": "bodies.A.inertia", "lower": 0.005, "upper": 0.08},
                       "friction": {"path": "joints.O.friction", "lower": 0.001, "upper": 0.1}},
        "channels": [{"marker": "e" if name in ("x", "y", "angle") else "i", "quantity": name,
                      **({"noise": NOISE[name]} if stated else {})} for name in names],
        "source": {"kind": "engine", "stop": 2.0, "count": 200},
    }, "mixed")  # fmt: skip
    values = np.stack([seen[name] for name in names], axis=1)
    measurement = Measurement.single(times, tuple(problem.channels), values, "scipy")
    if stated:
        measurement = measurement.changed(lambda r: type(r)(r.times, r.channels, r.values, r.origin,
                                                            np.array([NOISE[name] for name in names])))  # fmt: skip
    model = ForwardModel(problem, scene, get_engine("gauss"), measurement)
    outcome = get_method("least-squares")(model, np.random.default_rng(seed), lambda *_: None)
    return conclude(model, outcome, "least-squares", seed)


CAMERA_AND_IMU, ENCODER_AND_IMU = ["x", "y", "ax", "ay", "rate"], ["ax", "ay", "rate", "angle"]


@pytest.mark.slow
def test_channels_count_by_the_noise_that_they_show() -> None:
    """The intervals are as if it were stated; a metre beside a metre per second squared did not count."""
    told, known = (identified(CAMERA_AND_IMU, 1, stated=stated) for stated in (False, True))
    assert told.verdict is known.verdict is Verdict.IDENTIFIED
    for name, value in told.parameters.items():
        assert value.lower < TRUTH[name] < value.upper
        width, wanted = (one.parameters[name].upper - one.parameters[name].lower for one in (told, known))
        assert width == pytest.approx(wanted, rel=0.25)


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.by_day(1)
def test_what_one_sensor_contradicts_is_seen(seed: int) -> None:
    """Gravity two degrees off against the camera, by ten times its noise: trusted before, with a wrong angle."""
    found = identified(CAMERA_AND_IMU, seed, tilt=np.radians(2.0))
    assert found.verdict is Verdict.REJECTED
    assert "tilt" in found.message


@pytest.mark.slow
@pytest.mark.parametrize("spring", [0.4, 0.8])
def test_a_spring_that_was_left_out_is_a_suspect(spring: float) -> None:
    """The inertia takes most of it, and was trusted at half or a quarter of the truth."""
    found = identified(ENCODER_AND_IMU, 2, spring=spring)
    inertia = found.parameters["inertia"]
    assert not found.verdict.trusted or inertia.lower < TRUTH["inertia"] < inertia.upper
    (suspect,) = (one for one in found.suspects if one.name == "torsion spring in O")
    assert suspect.value == pytest.approx(spring, rel=0.1)
    assert "at rest at -1.5" in suspect.change


def test_a_search_for_the_cause_that_is_cut_ends_the_trust(monkeypatch: pytest.MonkeyPatch) -> None:
    """What it would have found would have widened the intervals."""

    def late(*_: Any) -> None:
        raise TimeIsUp

    monkeypatch.setattr(search._FaultSearch, "run", late)
    found = identified(ENCODER_AND_IMU, 2, spring=0.4)
    assert found.verdict is Verdict.FAILED
    assert found.codes[0] == "no-time-to-judge"


def test_rounded_samples_show_the_noise_of_rounding() -> None:
    """A slow encoder shows the same number for many samples; its noise is not nothing."""
    slow = np.round(np.linspace(0.0, 0.05, 400), 2)
    assert differences(slow) == pytest.approx(0.01 / np.sqrt(12))
