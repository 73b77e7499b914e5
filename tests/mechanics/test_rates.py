"""Velocities of markers and rates of their angles: the derivatives of what is sampled, on and between steps."""

from __future__ import annotations

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.scene import load_scene

SMALL = 1e-5


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("rigid-double-pendulum", {}),
        ("rigid-double-pendulum", {"solver.integrator": "rk4", "solver.step": 1e-3}),
        ("flexible-double-pendulum", {"solver.integrator": "leapfrog", "solver.step": 1e-4}),
        ("andrews-squeezer", {}),
    ],
)
@pytest.mark.parametrize("time", [0.01, 0.0123456])
def test_rates_are_derivatives_of_the_samples(name: str, values: dict[str, object], time: float) -> None:
    scene = load_scene(name).with_values(values)
    run = get_engine("gauss").simulate(scene, np.array([time - SMALL, time, time + SMALL]))
    assert run.velocities is not None
    assert run.rates is not None
    velocity = (run.points[2] - run.points[0]) / (2 * SMALL)
    rate = (run.angles[2] - run.angles[0]) / (2 * SMALL)
    assert run.velocities[1] == pytest.approx(velocity, rel=1e-4, abs=1e-4 * np.max(np.abs(velocity)))
    assert run.rates[1] == pytest.approx(rate, rel=1e-4, abs=1e-4 * np.max(np.abs(rate)))
