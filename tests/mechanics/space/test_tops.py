"""Symmetric heavy tops on a point, against closed forms, and linkages that move by their geometry alone."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.special import ellipj, ellipk
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene
from shoal_validation.random_space import linkages
from shoal_validation.random_space.newton_euler import NewtonEuler

MASS, HEIGHT, ACROSS, ALONG = 1.3, 0.2, 0.02, 0.03
PIVOT = ACROSS + MASS * HEIGHT**2
"""About the point, across the axis [kg m^2]."""
PULL = MASS * 9.81 * HEIGHT


def top(tilt: float, spin: Any) -> dict[str, Any]:
    """Its axis is tilted from z towards -y; spin: along the axes of the ground."""
    body = {"kind": "rigid-body", "mass": MASS, "inertia": [ACROSS, ACROSS, ALONG], "centre_of_mass": [0, 0, HEIGHT],
            "named_points": {"tip": [0, 0, 1.0]}}  # fmt: skip
    foot = {"kind": "spherical", "first": {"body": "ground", "point": [0, 0, 0]}, "second": {"body": "top"}}
    return {
        "name": "top", "dimensions": 3, "gravity": [0, 0, -9.81], "bodies": {"top": body}, "joints": {"foot": foot},
        "markers": {"tip": {"body": "top", "point": "tip"}},
        "initial": {"top": {"rotation": [tilt, 0.0, 0.0], "position": [0.0, 0.0, 0.0], "spin": list(spin)}},
    }  # fmt: skip


def tip(data: dict[str, Any], *times: float) -> Any:
    found = simulate(Scene.parse(data), np.array(times))
    assert found.ok, found.message
    return found.marker("tip")


@pytest.mark.parametrize("fast", [False, True])
def test_a_top_precesses_steadily_at_both_of_its_rates(fast: bool) -> None:
    """A cos(tilt) Omega^2 - C s Omega + m g h = 0 for the spin s about the axis (Lagrange)."""
    tilt, s, t = 0.6, 60.0, 1.3
    root = math.sqrt((ALONG * s) ** 2 - 4 * PIVOT * math.cos(tilt) * PULL)
    rate = (ALONG * s + (root if fast else -root)) / (2 * PIVOT * math.cos(tilt))
    axis = np.array([0.0, -math.sin(tilt), math.cos(tilt)])
    spin = rate * np.array([0.0, 0.0, 1.0]) + (s - rate * math.cos(tilt)) * axis
    turned = [math.sin(tilt) * math.sin(rate * t), -math.sin(tilt) * math.cos(rate * t), math.cos(tilt)]
    assert tip(top(tilt, spin), t)[0] == pytest.approx(turned, abs=1e-8)


TILT = 0.8


def let_go(s: float) -> dict[str, Any]:
    """A top that spins about its axis alone."""
    return top(TILT, s * np.array([0.0, -math.sin(TILT), math.cos(TILT)]))


def nodding(s: float, times: Any) -> Any:
    """u = cos(tilt): u'^2 = b (u0 - u)(u - u1)(u2 - u), b = 2 m g h/A (Whittaker, Analytical Dynamics, 71)."""
    u0, a, b = math.cos(TILT), ALONG * s / PIVOT, 2 * PULL / PIVOT
    root = math.sqrt(a**4 - 4 * b * (a**2 * u0 - b))
    u1, u2 = (a**2 - root) / (2 * b), (a**2 + root) / (2 * b)
    k2 = (u0 - u1) / (u2 - u1)
    sn = ellipj(0.5 * math.sqrt(b * (u2 - u1)) * times + ellipk(k2), k2)[0]
    return u1 + (u0 - u1) * sn**2


@pytest.mark.parametrize("s", [5.0, 40.0, 300.0])
def test_a_top_that_is_let_go_nods_as_its_elliptic_function_says(s: float) -> None:
    times = np.array([0.05, 0.4, 1.0])
    assert tip(let_go(s), *times)[:, 2] == pytest.approx(nodding(s, times), abs=1e-8)


@pytest.mark.parametrize(
    ("integrator", "off", "order"),
    [
        ("rk4", 1e-7, 4),
        ("leapfrog", 2e-3, 2),
        # Its time loop in space is long to compile.
        pytest.param("energy-momentum", 1.5e-4, 2, marks=pytest.mark.slow),
        ("generalized-alpha", 3e-4, 2),
    ],
)
def test_it_nods_at_steps_of_a_millisecond_and_what_is_too_long_is_told(
    integrator: str, off: float, order: int
) -> None:
    """Some 150 steps a turn; fifty times longer ones are no motion any more."""
    times = np.linspace(0.1, 1.0, 10)
    half, whole, long = (
        simulate(Scene.parse(let_go(40.0) | {"solver": {"integrator": integrator, "step": step}}), times)
        for step in (5e-4, 1e-3, 5e-2)
    )
    fine, coarse = (np.abs(one.marker("tip")[:, 2] - nodding(40.0, times)).max() for one in (half, whole))
    assert half.ok and whole.ok  # noqa: PT018
    assert coarse < off
    assert coarse / fine > 0.9 * 2**order
    assert not long.ok
    assert long.message


def test_a_sleeping_top_wakes_below_its_critical_spin_only() -> None:
    """Upright it stays, slightly tilted it stays near above C s = 2 sqrt(A m g h) and falls below."""
    critical = 2 * math.sqrt(PIVOT * PULL) / ALONG
    for share, tilt in ((0.5, 0.0), (1.1, 1e-4), (0.9, 1e-4)):
        s = share * critical
        found = tip(top(tilt, s * np.array([0.0, -math.sin(tilt), math.cos(tilt)])), *np.linspace(0.5, 3.0, 6))
        away = float(np.hypot(found[:, 0], found[:, 1]).max())
        assert away == 0.0 if tilt == 0.0 else away < 5e-4 if share > 1 else away > 0.05


@pytest.mark.parametrize("seed", [4, 15])
def test_sarrus_linkages_lead_their_platform_along_a_straight_line(seed: int) -> None:
    """Six hinges in two parallel triples, at a right angle to both of which the platform moves without turning."""
    name, data = linkages.drawn(seed)
    assert name == "sarrus"
    found = simulate(Scene.parse(data), np.linspace(0.0, 0.5, 6))
    assert found.ok, found.message
    assert found.model["redundant_joints"]
    one, other = (np.array(data["joints"][joint]["axis"]) for joint in ("J0", "end"))
    line = np.cross(one, other) / np.linalg.norm(np.cross(one, other))
    way = found.marker("B2") - found.marker("B2")[0]
    assert np.abs(way @ line).max() > 0.02
    assert way == pytest.approx(np.outer(way @ line, line), abs=1e-10)
    assert found.marker("B1") - found.marker("B1")[0] == pytest.approx(way, abs=1e-10)


def test_newton_and_euler_judge_as_closed_forms_do() -> None:
    """The judge of random linkages, which shares no code with the mechanics."""
    tilt, s = 0.8, 40.0
    data = top(tilt, s * np.array([0.0, -math.sin(tilt), math.cos(tilt)]))
    assert NewtonEuler(data).markers([0.3])["tip"] == pytest.approx(tip(data, 0.3), abs=1e-8)
