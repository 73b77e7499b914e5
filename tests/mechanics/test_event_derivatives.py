"""Derivatives through nine impacts by lanes that differ a little: of a ball that bounces and slides, in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene

pytestmark = pytest.mark.compiles("kernels of contacts, which few machines need")
G = 9.81
E, MU, FAST = 0.8, 0.1, 20.0
STEP = 1e-5
"""Of central differences: their error is the square of it, and that of the runs over it."""


def place(e: float, mu: float, t: float) -> tuple[float, float]:
    """Where a ball is that falls from 1 m with a horizontal speed, and slips at each impact."""
    now, x, vx, vy = 0.0, 0.0, FAST, 0.0
    y, flight = 1.0, np.sqrt(2.0 / G)
    while now + flight < t:
        now, x = now + flight, x + vx * flight
        hit = G * flight if now == flight else vy
        vx, vy, y = vx - mu * (1.0 + e) * hit, e * hit, 0.0
        flight = 2.0 * vy / G
    rest = t - now
    return float(x + vx * rest), float(y + vy * rest - 0.5 * G * rest**2)


@pytest.mark.parametrize("path", ["restitution", "mu"])
def test_derivatives_through_nine_impacts_are_those_of_the_closed_form(path: str) -> None:
    floor = {"first": {"body": "b"}, "second": {"body": "ground", "line": 0.0}, "restitution": E, "mu": MU}
    scene = Scene.parse({"name": "ball", "gravity": [0.0, -G], "bodies": {"b": {"kind": "point-mass", "mass": 1.0}},
                         "contacts": {"floor": floor}, "markers": {"b": {"body": "b"}},
                         "initial": {"b": {"position": [0.0, 1.0], "velocity": [FAST, 0.0]}}})  # fmt: skip
    t = 3.5
    middle = E if path == "restitution" else MU
    run = simulate(scene, np.array([t]), {f"contacts.floor.{path}": middle + STEP * np.array([-1.0, 0.0, 1.0])})
    assert run.ok, run.message
    assert all(len(letters) == 9 for letters in run.words)
    found = (run.points[0, 0, :, 2] - run.points[0, 0, :, 0]) / (2.0 * STEP)
    step = 1e-4  # of a difference of fourth order
    weights = {-2: 1.0, -1: -8.0, 1: 8.0, 2: -1.0}
    shifted = {k: place(*((E + k * step, MU) if path == "restitution" else (E, MU + k * step)), t) for k in weights}
    exact = np.array([np.array(shifted[k]) * weight for k, weight in weights.items()]).sum(axis=0) / (12.0 * step)
    known = np.abs(exact) > 1e-3  # the height does not depend on mu
    np.testing.assert_allclose(found[known], exact[known], rtol=1e-6)
    np.testing.assert_allclose(found[~known], exact[~known], atol=1e-7)
