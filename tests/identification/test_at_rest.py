"""Recordings without noise and without motion: numbers that overflow nothing, and sizes of noise that can be."""

import numpy as np
import pytest
from shoal.errors import InputError
from shoal.identification import Measurement, Problem, Verdict, identify, measure
from shoal.trajectory import Array

TIMES = np.arange(1, 41) / 40


def hanging() -> tuple[Problem, Array]:
    """The start of a pendulum that hangs at rest, and where its end is."""
    problem = Problem.parse(
        {
            "name": "at-rest",
            "scene": "single-pendulum",
            "values": {"initial.OA.angle": -np.pi / 2, "initial.OA.rate": 0.0},
            "parameters": {"theta": {"path": "initial.OA.angle", "lower": -2.0, "upper": -1.0}},
            "channels": [{"marker": "A", "quantity": axis, "column": axis} for axis in ("x", "y")],
            "source": {"kind": "file"},
            "method": "least-squares",
        },
        "at-rest",
    )
    length = problem.load_scene().bodies["OA"].points["end"][0]
    return problem, np.tile([0.0, -length], (len(TIMES), 1))


@pytest.mark.parametrize("offset", [0.0, 1e-9, 1e-3])
@pytest.mark.by_day(1)
def test_a_noise_free_recording_at_rest(offset: float) -> None:
    """A residual that is infinitely many times a noise of zero has chance zero; the square raised OverflowError."""
    problem, points = hanging()
    estimate = identify(problem, measurement=Measurement.single(TIMES, tuple(problem.channels), points + offset, ""))
    assert 0.0 <= estimate.residual_tests.chance_of_size <= 1.0
    # What is left at rest is round-off of the solver, which refutes nothing; a nanometre is more than that.
    assert estimate.residual_tests.wrong_model is (offset > 0)
    assert (estimate.verdict is Verdict.IDENTIFIED) is (offset == 0)
    assert estimate.parameters["theta"].value == pytest.approx(-np.pi / 2, abs=10 * offset + 1e-6)


@pytest.mark.parametrize("noise", [0.0, -1e-3, np.nan, np.inf])
def test_a_stated_noise_is_positive(noise: float) -> None:
    problem, points = hanging()
    with pytest.raises(InputError, match=r"noise: a standard deviation above 0.* found"):
        Measurement.single(TIMES, tuple(problem.channels), points, "", noise=noise)


def test_how_to_give_a_recording_in_both_ways() -> None:
    """The line is read by those who call `identify` from Python too."""
    problem, _ = hanging()
    with pytest.raises(InputError, match=r"data=FILE .*--data FILE"):
        measure(problem, problem.load_scene())
