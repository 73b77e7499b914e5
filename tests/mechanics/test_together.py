"""Constrained machines eight at a time: each moves as it would alone, and as the motion in one angle says."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.scene import load_scene
from shoal_validation.problems import one_angle

LANES = 11
"""Two groups of eight, the second of which repeats its last lane."""


@pytest.mark.parametrize(
    "name",
    [
        *["andrews-squeezer", "equal-slider-crank", "n-four-bar-2", "parallelogram"],
        pytest.param("bricard", marks=pytest.mark.slow),
    ],
)
@pytest.mark.by_day(2)
def test_lanes_move_as_they_would_alone(name: str) -> None:
    """With steps of their own, which lanes share otherwise; Bricard's mechanism has a condition too many."""
    scene = load_scene(name)
    step = 5e-5 if name == "andrews-squeezer" else 2e-3
    scene = scene.with_values({"solver.integrator": "rk4", "solver.step": step, "solver.duration": 250 * step})
    path = "gravity.1"
    values = (scene.gravity[1] or -9.81) * np.linspace(0.9, 1.1, LANES)
    together = get_engine("gauss").simulate_many(scene, {path: values})
    assert together.ok, together.message
    for lane, value in enumerate(values):
        alone = get_engine("gauss").simulate(scene.with_values({path: float(value)}))
        np.testing.assert_allclose(together.points[..., lane], alone.points[..., 0], rtol=0, atol=1e-11)


def test_lanes_pass_a_singular_position_at_different_times() -> None:
    """So that some of a group are near it while others are not."""
    rates, times = -np.linspace(1.0, 3.0, LANES), np.linspace(0.2, 3.0, 15)
    values: dict[str, Any] = {f"initial.{bar}.rate": rates for bar in ("left", "right")}
    found = get_engine("gauss").simulate_many(load_scene("parallelogram"), values, times)
    assert found.ok, found.message
    for lane, rate in enumerate(rates):
        expected = one_angle.parallelogram(np.pi / 2, float(rate))(times).points
        np.testing.assert_allclose(found.marker("A", lane), expected, atol=1e-8)
