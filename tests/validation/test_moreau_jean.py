"""Moreau's and Jean's time stepping against closed forms and against ours: of first order, and the same laws."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.scene import Scene
from shoal_validation.contacts.moreau_jean import MoreauJean
from shoal_validation.random_contacts.machines import drawn

G = 9.81


def floor(body: dict[str, Any], start: dict[str, Any], line: float = 0.0, **law: Any) -> dict[str, Any]:
    second = {"body": "ground", "point": [0.0, 0.0], "line": line}
    return {"bodies": {"B": {"mass": 1.0, "inertia": 0.005, **body}}, "initial": {"B": start},
            "contacts": {"floor": {"first": {"body": "B", "radius": 0.1}, "second": second, **law}}}  # fmt: skip


def test_a_bouncing_ball_has_an_error_of_first_order() -> None:
    """Height after one impact at 1 s: closed form. The instant of the impact within a step scatters the ratios."""
    fall, kept = np.sqrt(2.0 / G), 0.8
    exact = kept * G * fall * (1.0 - fall) - 0.5 * G * (1.0 - fall) ** 2
    machine = floor({}, {"position": [0.0, 1.1]}, restitution=kept)
    errors = [abs(MoreauJean(machine).run([1.0], step)[0, 0, 1] - 0.1 - exact) for step in (1e-3, 1.25e-4)]
    assert errors[1] < 0.25 * errors[0]
    assert errors[1] < 3e-4


@pytest.mark.parametrize(("mu", "acceleration"), [(0.1, np.sin(0.3) - 0.1 * np.cos(0.3)), (0.3, np.sin(0.3) * 2 / 3)])
def test_a_disc_slips_or_rolls_down_a_slope(mu: float, acceleration: float) -> None:
    """It rolls where tan(slope) <= 3 mu; what sticks does not creep."""
    start = {"position": [0.1 * np.sin(0.3), 0.1 * np.cos(0.3)]}
    machine = floor({}, start, -0.3, mu=mu)
    moved = MoreauJean(machine).run([1.0], 1e-3)[0, 0, :2] - machine["initial"]["B"]["position"]
    np.testing.assert_allclose(np.linalg.norm(moved), 0.5 * G * acceleration, rtol=3e-3)


@pytest.mark.compiles("kernels of contacts, which few machines need")
@pytest.mark.parametrize("seed", [0, pytest.param(2, marks=pytest.mark.slow), pytest.param(3, marks=pytest.mark.slow)])
def test_machines_drawn_at_random_come_nearer_to_ours_with_the_step(seed: int) -> None:
    """Balls, a chain of links and a drum, through their first impacts with friction."""
    machine, times = drawn(seed)[1], np.array([0.2, 0.4, 0.6])
    ours = get_engine("gauss").simulate(Scene.parse(machine), times)
    assert any(event["kind"] == "impact" for event in ours.model["events"])
    errors = [np.max(np.abs(MoreauJean(machine).run(times, step)[..., :2] - ours.points[..., 0]))
              for step in (2e-3, 5e-4)]  # fmt: skip
    assert errors[1] < 0.5 * errors[0]
    assert errors[1] < 2e-3
