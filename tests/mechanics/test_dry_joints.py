"""Friction by the force of joints that sticks exactly: blocks on slopes, pins, a dry slider-crank, jamming guides."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from shoal.errors import InputError
from shoal.mechanics.analysis.reactions import reactions
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene

pytestmark = pytest.mark.compiles("kernels of contacts, which few machines need")
GROUND = {"body": "ground", "point": [0.0, 0.0]}
G = 9.81


def machine(bodies: dict[str, Any], joints: dict[str, Any], **more: Any) -> Scene:
    markers = {name: {"body": name, "point": [0.0, 0.0]} for name in bodies}
    return Scene.parse({"name": "dry", "bodies": bodies, "joints": joints, "markers": markers} | more)


def block(mu: float, slope: float, speed: float) -> Scene:
    """A block on a line that falls at an angle, with a speed along it."""
    body = {"kind": "rigid-body", "mass": 3.0, "inertia": 0.1}
    slider = {"kind": "slider", "first": GROUND, "second": {"body": "B", "point": [0.0, 0.0]}, "direction": -slope,
              "rotation": "locked", "mu": mu, "stick": "exact"}  # fmt: skip
    velocity = [speed * np.cos(slope), -speed * np.sin(slope)]
    return machine({"B": body}, {"S": slider}, initial={"B": {"position": [0.0, 0.0], "velocity": velocity}})


@pytest.mark.parametrize("integrator", ["dop853", "rk4", "leapfrog"])
def test_a_block_slides_to_a_stop_and_sticks_below_the_angle_of_friction(integrator: str) -> None:
    slope, mu, speed = 0.3, 0.5, 2.0
    scene = block(mu, slope, speed).with_values({"solver.integrator": integrator, "solver.step": 1e-3})
    slower = G * (mu * np.cos(slope) - np.sin(slope))
    stops = speed / slower
    run = simulate(scene, np.array([0.5 * stops, stops + 0.1, 100.0]))
    assert run.ok, run.message
    way = np.linalg.norm(run.marker("B"), axis=1)
    np.testing.assert_allclose(way[0], speed * 0.5 * stops - slower * (0.5 * stops) ** 2 / 2, rtol=1e-9)
    np.testing.assert_allclose(way[1:], speed**2 / (2 * slower), rtol=1e-9)
    assert abs(way[2] - way[1]) < 1e-12
    assert [event["kind"] for event in run.model["events"]] == ["sticks"]
    assert run.model["events"][0]["time"] == pytest.approx(stops, abs=1e-9)


@pytest.mark.parametrize("force", [5.0, 20.0])
def test_given_friction_takes_time_to_stop_a_block_without_another_load(force: float) -> None:
    """It has no impulse, however large it is beside the momentum, and a slip without a load ends once."""
    scene = block(0.0, 0.0, 2.0).with_values({"joints.S.coulomb": force})
    run = simulate(scene, np.array([0.1, 50.0]))
    assert run.ok, run.message
    way = [0.2 - force / 3.0 * 0.1**2 / 2, 2.0**2 / (2 * force / 3.0)]
    np.testing.assert_allclose(run.marker("B")[:, 0], way, rtol=1e-12)
    assert [event["kind"] for event in run.model["events"]] == ["sticks"]


def test_above_the_angle_of_friction_it_slides_off_from_rest() -> None:
    run = simulate(block(0.2, 0.3, 0.0), np.array([1.0]))
    way = G * (np.sin(0.3) - 0.2 * np.cos(0.3)) / 2
    assert np.linalg.norm(run.marker("B")[0]) == pytest.approx(way, rel=1e-9)


def pendulum(mu: float, angle: float) -> Scene:
    """A bar of 2 kg and 1 m on a pin of 50 mm."""
    bar = {"kind": "rigid-body", "mass": 2.0, "inertia": 2.0 / 12.0, "centre_of_mass": [0.5, 0.0]}
    pin = {"first": GROUND, "second": {"body": "A", "point": [0.0, 0.0]}, "mu": mu, "radius": 0.05, "stick": "exact"}
    return machine({"A": bar}, {"O": pin}, initial={"A": {"angle": angle}})


def test_a_pendulum_sticks_as_long_as_its_weight_passes_through_the_circle_of_friction() -> None:
    mu = 0.3
    most = np.arcsin(mu * 0.05 / 0.5)  # from hanging: the lever of the weight is the radius times mu
    for share, holds in ((0.999, True), (1.001, False)):
        run = simulate(pendulum(mu, -np.pi / 2 + share * most), np.array([5.0]))
        assert run.ok, run.message
        moved = abs(run.angle("A")[0] - (-np.pi / 2 + share * most))
        assert (moved < 1e-12) == holds


def test_a_swinging_pendulum_comes_to_rest_as_moments_about_its_pin_say() -> None:
    """Torque mu r N against the motion, N of the motion with that torque: a quadratic equation, integrated by scipy."""
    mu, radius, mass, arm, inertia = 0.8, 0.05, 2.0, 0.5, 2.0 / 3.0

    def bend(angle: float, rate: float, side: float) -> float:
        # a = b - s T / I, T^2 = (mu r)^2 (along^2 + (m g cos + m arm a)^2)
        along = mass * (G * np.sin(angle) - arm * rate**2)
        free = -mass * G * arm * np.cos(angle) / inertia
        p, q = mass * G * np.cos(angle) + mass * arm * free, -mass * arm * side / inertia
        k = (mu * radius) ** 2
        a, b, c = 1.0 - k * q * q, -2.0 * k * p * q, -k * (along**2 + p * p)
        torque = (-b + np.sqrt(b * b - 4.0 * a * c)) / (2.0 * a)
        return float(free - side * torque / inertia)

    scene = pendulum(mu, 0.2)
    times, angles, start, state = [], [], 0.0, [0.2, 0.0]
    for side in (-1.0, 1.0, -1.0, 1.0):

        def slopes(_: float, y: Any, side: float = side) -> list[float]:
            return [y[1], bend(y[0], y[1], side)]

        def turn(_: float, y: Any) -> float:
            return float(y[1])

        turn.terminal, turn.direction = True, -side  # type: ignore[attr-defined]
        found = solve_ivp(slopes, (start, 20.0), state, rtol=1e-12, atol=1e-13, events=turn)
        start, state = float(found.t[-1]), [float(found.y[0, -1]), 0.0]
        times.append(start)
        angles.append(state[0])
    run = simulate(scene, np.array(times))
    assert run.ok, run.message
    np.testing.assert_allclose(run.angle("A"), angles, atol=1e-8)
    late = simulate(scene, np.array([60.0, 1000.0]))
    assert late.ok, late.message
    assert late.model["events"][-1]["kind"] == "sticks"
    assert abs(late.angle("A")[1] - late.angle("A")[0]) < 1e-12


def test_the_reaction_bears_the_friction_up_to_its_limit() -> None:
    (slips,) = reactions(pendulum(0.3, 0.2), [0.4])
    joint = slips.joints["O"]
    assert slips.unbalanced < 1e-10
    assert abs(np.ravel(joint.torque)[0]) == pytest.approx(0.3 * 0.05 * np.linalg.norm(joint.force), rel=1e-9)
    angle = -np.pi / 2 + 0.01
    (sticks,) = reactions(pendulum(0.3, angle), [1.0])
    assert sticks.joints["O"].torque == pytest.approx(2.0 * G * 0.5 * np.sin(0.01), rel=1e-9)


def crank(mu: float) -> Scene:
    """A slider-crank at rest whose slider is pushed along its dry guide."""
    bar = {"kind": "rigid-body", "mass": 1.0, "inertia": 0.05, "centre_of_mass": [0.25, 0.0]}
    rod = {"kind": "rigid-body", "mass": 1.0, "inertia": 0.1, "centre_of_mass": [0.5, 0.0]}
    side = np.arcsin(0.5 * np.sin(1.0))
    joints = {
        "O": {"first": GROUND, "second": {"body": "c", "point": [0.0, 0.0]}},
        "A": {"first": {"body": "c", "point": [0.5, 0.0]}, "second": {"body": "r", "point": [0.0, 0.0]}},
        "S": {"kind": "slider", "first": GROUND, "second": {"body": "r", "point": [1.0, 0.0]}, "mu": mu,
              "stick": "exact"},
    }  # fmt: skip
    motor = {"kind": "torque", "at": {"body": "c", "point": [0.0, 0.0]}, "torque": -1.0}
    start = {"c": {"angle": 1.0}, "r": {"angle": -side}}
    return machine({"c": bar, "r": rod}, joints, gravity=[0.0, 0.0], initial=start, loads={"m": motor})


def test_energy_of_a_slider_crank_is_what_its_guide_takes_and_lanes_are_as_alone() -> None:
    times = np.array([0.2, 0.5, 1.0])
    run = simulate(crank(0.3), times)
    assert run.ok, run.message
    assert run.energy_drift[0] < 1e-9
    lanes = simulate(crank(0.3), times, {"joints.S.mu": np.array([0.0, 0.3])})
    np.testing.assert_allclose(lanes.angles[..., 1], run.angles[..., 0], atol=1e-12)


def jamming(mu: float) -> Scene:
    """A long arm pushes a slider: the force across the guide grows with the friction at its own lever."""
    arm = {"kind": "rigid-body", "mass": 1.0, "inertia": 0.01, "centre_of_mass": [0.0, 1.0]}
    guide = {
        "kind": "slider",
        "first": GROUND,
        "second": {"body": "a", "point": [0.1, 0.0]},
        "mu": mu,
        "stick": "exact",
    }
    start = {"a": {"position": [0.0, 0.0], "velocity": [1.0, 0.0]}}
    return machine({"a": arm}, {"S": guide}, initial=start)


def test_friction_that_jams_ends_the_run_and_names_the_joint() -> None:
    run = simulate(jamming(20.0), np.array([1.0]))
    assert not run.ok
    assert "joints.S.mu ends the motion" in run.message
    assert simulate(jamming(0.05), np.array([0.02])).ok


def test_what_it_does_not_know_is_refused_by_name() -> None:
    with pytest.raises(
        InputError, match=r"joints\.O\.stops: friction by the force of a joint \(joints\.O\.mu\) knows no"
    ):
        simulate(pendulum(0.3, 0.2).with_values({"joints.O.stops": {"min": -3.0}}), np.array([1.0]))
    with pytest.raises(InputError, match="stick: exact is of dry friction; state `coulomb` or `mu`"):
        machine(
            {"B": {"kind": "point-mass", "mass": 1.0}},
            {"O": {"first": GROUND, "second": {"body": "B"}, "stick": "exact"}},
        )
