"""Of several recordings of one pendulum the one that is wrong is named, and what of it; scipy makes the recordings."""

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from shoal.identification import Measurement, Problem, Verdict, identify
from shoal.identification.recording.measurement import Recording
from shoal.identification.recording.source import Clocked

TIMES = np.arange(1, 76) * 0.02
NOISE = 1e-3
INERTIA = 0.2
"""Beside 1 kg at 1 m, of the library's single-pendulum."""


def swing(angle: float, times: np.ndarray = TIMES, seed: int = 0) -> np.ndarray:
    """The tip (samples, 2) of the pendulum as it swings from rest, with noise."""

    def slope(_: float, state: np.ndarray) -> list[float]:
        return [state[1], -9.81 * np.cos(state[0]) / (1.0 + INERTIA)]

    run = solve_ivp(slope, (0.0, 3.0), [angle, 0.0], t_eval=times, rtol=1e-10, atol=1e-12)
    tip = np.column_stack([np.cos(run.y[0]), np.sin(run.y[0])])
    return np.asarray(tip + NOISE * np.random.default_rng(seed).standard_normal(tip.shape))


def answer(known: bool = False, **samples: np.ndarray) -> Any:
    """The estimate of the start of each recording, where it is not known, and of the inertia that they share."""
    channels = [{"marker": "A", "quantity": q, "column": q} for q in ("x", "y")]
    angles = {"angle": {"path": "initial.OA.angle", "lower": -2.5, "upper": 1.0, "start": -0.5, "own": True}}
    data = {
        "name": "pendulums",
        "scene": "single-pendulum",
        "parameters": {
            "inertia": {"path": "bodies.OA.inertia", "lower": 0.05, "upper": 0.8},
            **({} if known else angles),
        },
        "channels": channels,
        "noise": NOISE,
        "recordings": {name: {"kind": "file"} for name in samples},
        "method": "multi-start",
    }
    problem = Problem.parse(data, "pendulums")
    starts = {"a": -0.4, "b": -0.9, "c": -1.2}
    runs = {
        name: Recording(
            TIMES,
            tuple(problem.channels),
            values,
            name,
            np.full(2, NOISE),
            Clocked(known={"initial.OA.angle": starts[name]} if known else {}),
        )
        for name, values in samples.items()
    }
    return identify(problem, measurement=Measurement(runs))


@pytest.mark.slow
def test_the_clock_of_one_of_three_recordings() -> None:
    found = answer(a=swing(-0.4), b=swing(-0.9, seed=1), c=swing(-1.2, TIMES / 1.02, seed=2))
    assert found.verdict is Verdict.REJECTED
    assert found.suspects[0].name == "clock of recording c"
    assert found.suspects[0].value == pytest.approx(1.02, rel=2e-3)
    assert "odd-recording" in found.codes


@pytest.mark.slow
def test_a_recording_of_noise_is_the_one_to_look_at() -> None:
    nothing = np.random.default_rng(3).standard_normal((len(TIMES), 2))
    found = answer(a=swing(-0.4), b=swing(-0.9, seed=1), c=nothing)
    assert found.verdict is Verdict.REJECTED
    assert "odd-recording" in found.codes
    assert found.advice[0] == "check the recording c"


@pytest.mark.slow
def test_files_that_are_exchanged() -> None:
    found = answer(known=True, a=swing(-0.9), b=swing(-0.4, seed=1), c=swing(-1.2, seed=2))
    assert found.verdict is Verdict.REJECTED
    assert found.suspects[0].name == "files of recordings a and b"


@pytest.mark.slow
def test_two_that_contradict_each_other_and_right_ones() -> None:
    found = answer(a=swing(-0.4), b=0.97 * swing(-0.9, TIMES * 0.99, seed=1))
    assert found.verdict is Verdict.REJECTED
    assert answer(a=swing(-0.4), b=swing(-0.9, seed=1)).verdict is Verdict.IDENTIFIED


@pytest.mark.slow
def test_a_prior_that_the_data_contradict_is_named() -> None:
    """The start is known to a milliradian, and stated a tenth of a radian off."""
    prior = {"mean": -0.5, "std": 1e-3}
    angle = {"path": "initial.OA.angle", "lower": -2.5, "upper": 1.0, "start": -0.5, "prior": prior}
    data = {
        "name": "pendulum",
        "scene": "single-pendulum",
        "values": {"bodies.OA.inertia": INERTIA},
        "parameters": {"angle": angle},
        "channels": [{"marker": "A", "quantity": q, "column": q} for q in ("x", "y")],
        "noise": 10 * NOISE,
        "source": {"kind": "file"},
        "method": "least-squares",
    }
    problem = Problem.parse(data, "pendulum")
    noise = 9 * NOISE * np.random.default_rng(1).standard_normal((len(TIMES), 2))
    found = identify(
        problem,
        measurement=Measurement.single(TIMES, tuple(problem.channels), swing(-0.4) + noise, "scipy", noise=1e-2),
    )
    assert found.verdict is Verdict.REJECTED
    assert "prior-contradicted" in found.codes
    assert found.advice[0] == "check the prior of angle"
