"""Noise as large as the motion: where the misfit is no parabola, intervals are those of the profile likelihood."""

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.identification import Estimate, Measurement, Problem, identify
from shoal.identification.forward import ForwardModel
from shoal.identification.methods.lanes import descend_many
from shoal.identification.uncertainty.covariance import blocks_of
from shoal.identification.uncertainty.linearisation import linearise
from shoal.identification.uncertainty.profiles import bent
from shoal.identification.uncertainty.sensitivity import sensitivity
from shoal_validation.coverage.cases import tip

TRUTH = {"theta1": np.pi / 4, "theta2": np.pi / 6}
TIMES = np.arange(1, 51) / 100
LOUD = 0.3


def problem(noise: float) -> Problem:
    """A double pendulum of 1 m and 2 m whose tip moves by 0.5 m; its arms are nearly in one line."""
    angle = {"lower": -np.pi / 2, "upper": np.pi / 2}
    stated = {
        "name": "loud",
        "scene": "rigid-double-pendulum",
        "parameters": {
            "theta1": {"path": "initial.OA.angle", **angle},
            "theta2": {"path": "initial.AB.angle", **angle},
        },
        "channels": [{"marker": "B", "quantity": quantity, "column": quantity} for quantity in ("x", "y")],
        "source": {"kind": "file"},
        "noise": noise,
    }
    return Problem.parse(stated, "loud")


def recorded(noise: float, seed: int) -> Measurement:
    """Lagrange's equations by scipy, with white noise [m]."""
    points = tip(TIMES, **TRUTH)
    points = points + noise * np.random.default_rng(seed).standard_normal(points.shape)
    return Measurement.single(TIMES, tuple(problem(noise).channels), points, "scipy DOP853", TRUTH, noise)


def found(noise: float, seed: int) -> Estimate:
    return identify(problem(noise), measurement=recorded(noise, seed))


def which_bend(noise: float, seed: int) -> list[int]:
    stated = problem(noise)
    model = ForwardModel(stated, stated.load_scene(), get_engine("gauss"), recorded(noise, seed))
    end = descend_many(model, np.array([list(TRUTH.values())]))[0]
    seen = sensitivity(model, end.point)
    blocks = blocks_of(model, len(seen.residual))
    return bent(model, end.point, linearise(seen.jacobian, seen.residual, model.sizes(end.point), blocks), seen)


def test_only_a_loud_noise_bends_the_misfit() -> None:
    assert which_bend(1e-3, 0) == []
    assert which_bend(LOUD, 0)


def test_the_profile_gives_the_interval_and_that_is_said() -> None:
    estimate = found(LOUD, 0)
    assert estimate.profiles
    assert "curved-misfit" in estimate.codes
    for name, seen in estimate.profiles.items():
        known = estimate.parameters[name]
        assert known.lower <= seen.lower < known.value < seen.upper <= known.upper


@pytest.mark.slow
def test_intervals_beside_a_loud_noise_hold_the_truth() -> None:
    """At 95 % fewer than 36 of 40 happen once in 20."""
    estimates = [found(LOUD, seed) for seed in range(40)]
    for name, true in TRUTH.items():
        assert sum(e.parameters[name].lower <= true <= e.parameters[name].upper for e in estimates) >= 36
