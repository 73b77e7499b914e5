"""Channels at time zero by their coefficients: against the closed form of a chain, and only where they hold."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.identification import Problem
from shoal.identification.forward import ForwardModel
from shoal.identification.recording.measurement import Measurement
from shoal.identification.recording.source import Channel

TIP = [{"marker": "B", "quantity": "x"}, {"marker": "B", "quantity": "y"}, {"marker": "A", "quantity": "angle"}]


def model(channels: list[dict[str, Any]], **source: Any) -> ForwardModel:
    problem = Problem.parse(
        {
            "name": "placed",
            "scene": "rigid-double-pendulum",
            "parameters": {
                "first": {"path": "initial.OA.angle", "lower": -3.0, "upper": 3.0},
                "second": {"path": "initial.AB.angle", "lower": -3.0, "upper": 3.0},
                "speed": {"path": "initial.AB.rate", "lower": -3.0, "upper": 3.0},
                "length": {"path": "bodies.AB.length", "lower": 0.5, "upper": 3.0, "scale": "linear"},
                "delay": {"path": "measurement.delay", "lower": -0.1, "upper": 0.1},
                "tilt": {"path": "measurement.tilt", "lower": -0.5, "upper": 0.5},
            },
            "channels": channels,
            "source": {"kind": "engine", "engine": "gauss", "stop": 1.0, "count": 50},
        },
        "placed",
    )
    parts = tuple(Channel(**channel) for channel in channels)
    data = Measurement.single(np.linspace(0.02, 1.0, 50), parts, np.zeros((50, len(parts))), "none")
    return ForwardModel(problem, problem.load_scene(), get_engine("gauss"), data)


def points(delay: float) -> np.ndarray[Any, np.dtype[np.float64]]:
    rng = np.random.default_rng(3)
    angles, speeds = rng.uniform(-4.0, 4.0, (20, 2)), np.full((20, 1), 0.7)
    return np.hstack([angles, speeds, np.full((20, 3), (1.7, delay, 0.3))])


@pytest.mark.parametrize("delay", [0.0, -0.05])
def test_a_chain_stands_where_trigonometry_says(delay: float) -> None:
    forward, at = model(TIP), points(delay)
    first = float(forward.scene.bodies["OA"].length)
    x = first * np.cos(at[:, 0]) + 1.7 * np.cos(at[:, 1])
    y = first * np.sin(at[:, 0]) + 1.7 * np.sin(at[:, 1])
    c, s = np.cos(0.3), np.sin(0.3)
    wanted = np.stack([c * x + s * y, c * y - s * x, at[:, 0] - 0.3], axis=1)
    for _ in range(2):
        np.testing.assert_allclose(forward.poses(at), wanted, atol=4e-15)
    at[:, 3] = 2.0
    assert np.max(np.abs(forward.poses(at)[:, :2] - wanted[:, :2])) > 0.1


@pytest.mark.parametrize(
    ("channels", "delay"),
    [
        (TIP, 0.05),
        ([*TIP, {"marker": "A", "quantity": "rate"}], 0.0),
        ([{"marker": "B", "quantity": "angle", "to": "A"}], 0.0),
    ],
)
def test_what_is_not_linear_in_the_pose_is_placed(channels: list[dict[str, Any]], delay: float) -> None:
    forward, at = model(channels), points(delay)
    seen = forward.observe(at, times=np.zeros(1))[:, 0]
    np.testing.assert_array_equal(forward.poses(at), seen)


def test_points_that_differ_in_more_than_angles_are_placed() -> None:
    forward, at = model(TIP), points(0.0)
    at[:, 3] = np.linspace(1.0, 2.0, 20)
    np.testing.assert_array_equal(forward.poses(at), forward.observe(at, times=np.zeros(1))[:, 0])
