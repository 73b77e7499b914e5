"""Friction by the force of joints in space: an oblique rail, a tilted pin that also bears along its axis."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from shoal.errors import InputError
from shoal.mechanics.analysis.joint_reactions import reactions_of
from shoal.mechanics.analysis.reactions import states
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene

GROUND = {"body": "ground", "point": [0.0, 0.0, 0.0]}
G = 9.81


def machine(bodies: dict[str, Any], joints: dict[str, Any], markers: dict[str, Any], **more: Any) -> Scene:
    return Scene.parse({"name": "dry", "dimensions": 3, "bodies": bodies, "joints": joints, "markers": markers} | more)


@pytest.mark.parametrize("integrator", ["dop853", pytest.param("radau5", marks=pytest.mark.slow), "rk4", "leapfrog"])
def test_a_block_slides_down_an_oblique_rail(integrator: str) -> None:
    """s'' = g (sin a - mu cos a) on a rail that falls by the angle a."""
    mu, rail = 0.3, np.array([1.0, 0.5, -0.9])
    rail /= np.linalg.norm(rail)
    body = {"kind": "rigid-body", "mass": 3.0, "inertia": [0.1, 0.2, 0.3]}
    slider = {"kind": "slider", "first": GROUND, "second": {"body": "B"}, "axis": rail.tolist(), "rotation": "locked",
              "mu": mu, "coulomb_speed": 1e-4}  # fmt: skip
    solver = {"integrator": integrator, "step": 1e-4, "relative_tolerance": 1e-10, "absolute_tolerance": 1e-12}
    start = {"B": {"position": [0.0, 0.0, 0.0], "velocity": (0.5 * rail).tolist()}}
    scene = machine({"B": body}, {"S": slider}, {"B": {"body": "B"}}, initial=start, gravity=[0.0, 0.0, -G],
                    solver=solver)  # fmt: skip
    run = simulate(scene, np.array([0.5, 1.0]))
    assert run.ok, run.message
    fall = -rail[2]
    way = 0.5 * run.times + G * (fall - mu * np.sqrt(1.0 - fall**2)) * run.times**2 / 2
    np.testing.assert_allclose(run.marker("B"), way[:, None] * rail, rtol=1e-7, atol=1e-12)


def pendulum(mu: float, radius: float) -> Scene:
    """A body whose pin is tilted, so that its weight also pushes along the pin."""
    body = {"kind": "rigid-body", "mass": 2.0, "inertia": [0.1, 0.1, 0.1], "centre_of_mass": [0.5, 0.0, 0.0]}
    pin = {"first": GROUND, "second": {"body": "A"}, "axis": [0.0, 0.6, 0.8], "mu": mu, "radius": radius,
           "coulomb_speed": 0.05}  # fmt: skip
    return machine({"A": body}, {"O": pin}, {"A": {"body": "A", "point": [1.0, 0.0, 0.0]}}, gravity=[0.0, -G, 0.0])


@pytest.mark.slow
def test_a_tilted_pin_brakes_with_all_that_it_bears() -> None:
    """Its force from the motion of the centre of mass: integrated by scipy."""
    mu, radius, mass = 0.3, 0.05, 2.0
    axis, weight = np.array([0.0, 0.6, 0.8]), np.array([0.0, -mass * G, 0.0])
    inertia = 0.1 + mass * 0.25

    def slopes(_: float, y: Any) -> list[float]:
        angle, rate = y
        arm = 0.5 * (np.array([np.cos(angle), 0, 0]) + np.sin(angle) * np.cross(axis, [1.0, 0.0, 0.0]))
        pull = axis @ np.cross(arm, weight)
        bend = pull / inertia
        for _ in range(100):
            force = mass * (bend * np.cross(axis, arm) - rate**2 * arm) - weight
            bend = (pull - mu * radius * np.linalg.norm(force) * np.tanh(rate / 0.05)) / inertia
        return [rate, bend]

    times = np.linspace(0.25, 1.5, 6)
    angles = solve_ivp(slopes, (0, 1.5), [0.0, 0.0], rtol=1e-11, atol=1e-12, t_eval=times).y[0]
    exact = np.cos(angles)[:, None] * [1.0, 0.0, 0.0] + np.sin(angles)[:, None] * np.cross(axis, [1.0, 0.0, 0.0])
    run = simulate(pendulum(mu, radius), times)
    assert run.ok, run.message
    np.testing.assert_allclose(run.marker("A"), exact, atol=1e-8)
    lanes = simulate(pendulum(mu, radius), times, {"joints.O.mu": np.array([0.0, mu])})
    np.testing.assert_allclose(lanes.points[:, 0, :, 1], exact, atol=1e-8)


def test_the_reaction_has_the_friction_that_its_own_force_makes() -> None:
    evaluator, (state,) = states(pendulum(0.3, 0.05), [0.4])
    (joint,) = reactions_of(evaluator, state.q, state.v, state.a, state.time).joints.values()
    about = abs(np.dot(joint.torque, [0.0, 0.6, 0.8]))
    assert about == pytest.approx(0.3 * 0.05 * np.linalg.norm(joint.force), rel=1e-6)


def test_pins_of_the_plane_brake_alike_in_space() -> None:
    """The chain that tests/mechanics/test_rubbing.py holds to Newton's and Euler's equations."""
    rod = {"kind": "rod", "height": 0.02, "width": 0.04, "density": 2500.0}
    bodies = {"A": rod | {"length": 1.0}, "B": rod | {"length": 0.7}}
    joints = {"O": {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "A"}, "mu": 0.2,
                    "radius": 0.05},
              "P": {"first": {"body": "A", "point": "end"}, "second": {"body": "B"}, "mu": 0.3,
                    "radius": 0.03}}  # fmt: skip
    start = {"A": {"angle": 0.2}, "B": {"angle": -0.5, "rate": 2.0}}
    flat = machine(bodies, joints, {"B": {"body": "B", "point": "end"}}, initial=start, dimensions=2)
    times = np.linspace(0.25, 1.5, 6)
    expected = simulate(flat, times).marker("B")
    found = simulate(machine(bodies, joints, {"B": {"body": "B", "point": "end"}}, initial=start), times)
    assert found.ok, found.message
    np.testing.assert_allclose(found.marker("B")[:, :2], expected, atol=1e-9)
    assert np.all(np.abs(found.marker("B")[:, 2]) < 1e-12)


def four_bar(*middle: dict[str, Any]) -> Scene:
    """On hinges at the ground, with two other joints."""
    rod = {"kind": "rod", "length": 1.0, "height": 0.02, "width": 0.04, "density": 2500.0}
    joints = {
        "O": {"first": GROUND, "second": {"body": "L"}, "mu": 0.3, "radius": 0.05},
        "P": {"first": {"body": "L", "point": "end"}, "second": {"body": "C"}} | middle[0],
        "Q": {"first": {"body": "R", "point": "end"}, "second": {"body": "C", "point": "end"}} | middle[1],
        "E": {"first": {"body": "ground", "point": [2.0, 0.0, 0.0]}, "second": {"body": "R"}},
    }
    start = {"L": {"angle": 1.0}, "R": {"angle": 1.0}, "C": {"angle": 0.0}}
    bodies = {"L": rod, "R": rod, "C": rod | {"length": 2.0}}
    return machine(bodies, joints, {"C": {"body": "C"}}, initial=start, gravity=[0.0, -G, 0.0])


def test_a_pin_whose_force_others_share_is_refused() -> None:
    with pytest.raises(InputError, match=r"joints\.O\.mu: the force of O is not unique, as dry holds itself"):
        simulate(four_bar({}, {}), np.array([0.1]))
    free = four_bar({"kind": "spherical"}, {"kind": "cylindrical", "axis": [0.0, 0.0, 1.0]})
    run, smooth = (simulate(one, np.array([0.5])) for one in (free, free.with_values({"joints.O.mu": 0.0})))
    assert run.ok, run.message
    assert run.distance(smooth) > 1e-3
