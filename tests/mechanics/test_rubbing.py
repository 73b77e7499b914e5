"""Friction by the force of joints: a block on a slope, a pin that bears weight, a pendulum, a dry slider-crank."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from shoal.errors import InputError
from shoal.mechanics.analysis.joint_reactions import reactions_of
from shoal.mechanics.analysis.reactions import states
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene, load_scene

GROUND = {"body": "ground", "point": [0.0, 0.0]}
G = 9.81


def machine(bodies: dict[str, Any], joints: dict[str, Any], markers: dict[str, Any], **more: Any) -> Scene:
    return Scene.parse({"name": "dry", "bodies": bodies, "joints": joints, "markers": markers} | more)


def block(mu: float, slope: float, speed: float, **more: Any) -> Scene:
    """A block on a line that falls at an angle, with a speed along it."""
    body = {"kind": "rigid-body", "mass": 3.0, "inertia": 0.1}
    slider = {"kind": "slider", "first": GROUND, "second": {"body": "B"}, "direction": -slope, "rotation": "locked",
              "mu": mu, "coulomb_speed": 1e-4}  # fmt: skip
    velocity = [speed * np.cos(slope), -speed * np.sin(slope)]
    return machine({"B": body}, {"S": slider}, {"B": {"body": "B"}},
                   initial={"B": {"position": [0.0, 0.0], "velocity": velocity}}, **more)  # fmt: skip


@pytest.mark.parametrize("integrator", ["dop853", "radau5", "rk4", "leapfrog"])
def test_a_block_slides_with_the_weight_less_the_friction_of_what_presses_it(integrator: str) -> None:
    """x'' = g (sin a - mu cos a)."""
    slope, mu, speed = 0.6, 0.4, 0.5
    solver = {"integrator": integrator, "step": 1e-4, "relative_tolerance": 1e-10, "absolute_tolerance": 1e-12}
    run = simulate(block(mu, slope, speed, solver=solver), np.array([0.5, 1.0]))
    assert run.ok, run.message
    way = speed * run.times + G * (np.sin(slope) - mu * np.cos(slope)) * run.times**2 / 2
    np.testing.assert_allclose(np.linalg.norm(run.marker("B"), axis=1), way, rtol=1e-7)


def rotor(mu: float, radius: float, rate: float) -> Scene:
    """A balanced wheel on a pin."""
    return machine({"W": {"kind": "rigid-body", "mass": 5.0, "inertia": 0.2}},
                   {"O": {"first": GROUND, "second": {"body": "W"}, "mu": mu, "radius": radius, "coulomb_speed": 1e-4}},
                   {"W": {"body": "W"}}, initial={"W": {"rate": rate}})  # fmt: skip


def test_a_wheel_slows_down_evenly_by_the_weight_on_its_pin() -> None:
    mu, radius, rate = 0.1, 0.02, 3.0
    run = simulate(rotor(mu, radius, rate), np.array([1.0, 4.0]))
    assert run.ok, run.message
    slower = mu * radius * 5.0 * G / 0.2
    np.testing.assert_allclose(run.angle("W"), rate * run.times - slower * run.times**2 / 2, rtol=1e-9)


ROD = {"kind": "rod", "length": 1.0, "height": 0.02, "width": 0.04, "density": 2500.0}
BOB = {"kind": "rigid-body", "mass": 2.0, "inertia": 0.0, "centre_of_mass": [1.0, 0.0], "named_points": {"end": [1, 0]}}


def pendulum(mu: float, radius: float, body: dict[str, Any] = ROD, **more: Any) -> Scene:
    return machine({"A": body}, {"O": {"first": GROUND, "second": {"body": "A"}, "mu": mu, "radius": radius,
                                      "coulomb_speed": 0.05}},
                   {"A": {"body": "A", "point": "end"}}, initial={"A": {"angle": 0.2}}, **more)  # fmt: skip


@pytest.mark.parametrize(("body", "arm", "inertia"), [(ROD, 0.5, 2.0 / 3.0), (BOB, 1.0, 2.0)])
@pytest.mark.by_day(1)
def test_a_pendulum_loses_what_its_pin_bears_times_the_way_it_slides(
    body: dict[str, Any], arm: float, inertia: float
) -> None:
    """Moments about the pin, with its force from the motion of the centre of mass: integrated by scipy.

    arm: of the centre of mass [m]; inertia: about the pin [kg m^2]. A bob has none about its own centre.
    """
    mu, radius, mass = 0.3, 0.05, 2.0

    def slopes(_: float, y: Any) -> list[float]:
        angle, rate = y
        bend = -mass * G * arm * np.cos(angle) / inertia
        for _ in range(200):
            along = mass * (G * np.sin(angle) - arm * rate**2)
            across = mass * (G * np.cos(angle) + arm * bend)
            torque = mu * radius * np.hypot(along, across) * np.tanh(rate / 0.05)
            bend = (-mass * G * arm * np.cos(angle) - torque) / inertia
        return [rate, bend]

    times = np.linspace(0.5, 4.0, 8)
    exact = solve_ivp(slopes, (0, 4), [0.2, 0.0], rtol=1e-11, atol=1e-12, t_eval=times).y[0]
    run = simulate(pendulum(mu, radius, body), times)
    assert run.ok, run.message
    np.testing.assert_allclose(run.angle("A"), exact, atol=1e-8)
    lanes = simulate(pendulum(mu, radius, body), times, {"joints.O.mu": np.array([0.0, mu, 0.5])})
    np.testing.assert_allclose(lanes.angles[:, 0, 1], exact, atol=1e-8)


def test_the_reaction_has_the_friction_that_its_own_force_makes() -> None:
    scene = pendulum(0.3, 0.05)
    evaluator, found = states(scene, [0.4])
    (state,) = found
    (joint,) = reactions_of(evaluator, state.q, state.v, state.a, state.time).joints.values()
    assert abs(joint.torque) == pytest.approx(0.3 * 0.05 * np.linalg.norm(joint.force), rel=1e-6)


@pytest.mark.slow
def test_two_dry_pins_brake_a_double_pendulum_as_newton_and_euler_say() -> None:
    """All forces of both pins as unknowns, beside the accelerations; integrated by scipy."""
    lengths, masses, mu, radius, speed = (1.0, 0.7), (2.0, 1.4), (0.2, 0.3), (0.05, 0.03), 0.05
    inertias = [m * one**2 / 12 for m, one in zip(masses, lengths, strict=True)]

    def slopes(_: float, y: Any) -> Any:
        angles, rates = y[:2], y[2:]
        along = np.array([np.cos(angles), np.sin(angles)]).T
        across = np.array([-np.sin(angles), np.cos(angles)]).T
        # Unknown: both angular accelerations, then the force of the ground on the first and of the first on the second.
        left, right = np.zeros((6, 6)), np.zeros(6)
        half = [one / 2 for one in lengths]
        for k in range(2):  # m r'' = forces + weight
            rows = slice(2 * k, 2 * k + 2)
            left[rows, k] = masses[k] * half[k] * across[k]
            right[rows] = masses[k] * (half[k] * rates[k] ** 2 * along[k] - [0.0, G])
        left[2:4, 0] = masses[1] * lengths[0] * across[0]
        right[2:4] += masses[1] * lengths[0] * rates[0] ** 2 * along[0]
        left[0:2, 2:4], left[0:2, 4:6], left[2:4, 4:6] = -np.eye(2), np.eye(2), -np.eye(2)
        left[4, 0], left[5, 1] = inertias
        left[4, 2:4], left[4, 4:6], left[5, 4:6] = half[0] * across[0], half[0] * across[0], half[1] * across[1]
        slips = rates[0], rates[1] - rates[0]
        found = np.linalg.solve(left, right)
        for _ in range(60):
            first, second = (
                -mu[k] * radius[k] * np.hypot(*found[2 + 2 * k : 4 + 2 * k]) * np.tanh(slips[k] / speed)
                for k in range(2)
            )
            right[4:] = first - second, second
            found = np.linalg.solve(left, right)
        return [*rates, *found[:2]]

    rod = {"kind": "rod", "height": 0.02, "width": 0.04, "density": 2500.0}
    pins = [{"mu": mu[k], "radius": radius[k], "coulomb_speed": speed} for k in range(2)]
    joints = {"O": {"first": GROUND, "second": {"body": "A"}} | pins[0],
              "P": {"first": {"body": "A", "point": "end"}, "second": {"body": "B"}} | pins[1]}  # fmt: skip
    start = {"A": {"angle": 0.2}, "B": {"angle": -0.5, "rate": 2.0}}
    scene = machine({"A": rod | {"length": 1.0}, "B": rod | {"length": 0.7}}, joints,
                    {"B": {"body": "B", "point": "end"}}, initial=start)  # fmt: skip
    times = np.linspace(0.25, 1.5, 6)
    exact = solve_ivp(slopes, (0, 1.5), [0.2, -0.5, 0.0, 2.0], rtol=1e-10, atol=1e-12, t_eval=times).y[1]
    run = simulate(scene, times)
    assert run.ok, run.message
    np.testing.assert_allclose(run.angle("B"), exact, atol=1e-7)


def crank(mu: float, **more: Any) -> Scene:
    """A slider-crank whose slider is pressed to its line by the connecting rod."""
    rod = {"kind": "rod", "height": 0.02, "width": 0.04, "density": 2500.0}
    joints = {"O": {"first": GROUND, "second": {"body": "C"}},
              "A": {"first": {"body": "C", "point": "end"}, "second": {"body": "R"}},
              "S": {"kind": "slider", "first": GROUND, "second": {"body": "R", "point": "end"}, "mu": mu,
                    "coulomb_speed": 0.05}}  # fmt: skip
    return machine({"C": rod | {"length": 0.3}, "R": rod | {"length": 0.7}}, joints,
                   {"B": {"body": "R", "point": "end"}}, initial={"C": {"angle": 1.0, "rate": 10.0}},
                   gravity=[0, 0], **more)  # fmt: skip


@pytest.mark.slow
def test_a_dry_slider_takes_from_the_energy_what_presses_it_times_its_way() -> None:
    times = np.linspace(0.01, 1.0, 100)
    scene = crank(0.2)
    run = simulate(scene, times)
    assert run.ok, run.message
    assert run.distance(simulate(crank(0.0), times)) > 1e-2
    evaluator, found = states(scene, times)
    energies = np.array([evaluator.at(one.q, one.v, one.time).kinetic for one in found])
    pressed = [reactions_of(evaluator, one.q, one.v, one.a, one.time).joints["S"].force[1] for one in found]
    assert energies[-1] < 0.9 * energies[0]
    rates = np.gradient(run.marker("B")[:, 0], times, edge_order=2)
    lost = 0.2 * np.abs(pressed) * rates * np.tanh(rates / 0.05)
    taken = np.concatenate([[0.0], np.cumsum((lost[1:] + lost[:-1]) / 2 * np.diff(times))])
    np.testing.assert_allclose(energies[0] - energies, taken, atol=0.01 * energies[0])


def test_lanes_are_singles() -> None:
    times = np.array([0.1, 0.3])
    singles = [simulate(crank(mu), times).points[..., 0] for mu in (0.0, 0.2, 0.3)]
    lanes = simulate(crank(0.1), times, {"joints.S.mu": np.array([0.0, 0.2, 0.3])})
    np.testing.assert_allclose(lanes.points, np.stack(singles, axis=-1), atol=1e-8)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"joints.O.mu": 0.1}, r"joints\.O: radius is missing; friction by mu acts at the radius of the pin"),
        ({"joints.O.mu": -0.1}, r"joints\.O\.mu"),
    ],
)
def test_a_pin_is_told_by_coefficient_and_radius(values: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        load_scene("single-pendulum").with_values(values)


def test_who_cannot_says_so() -> None:
    scene = pendulum(0.3, 0.05, solver={"integrator": "energy-momentum"})
    with pytest.raises(
        InputError, match=r"solver\.integrator: energy-momentum knows no friction by the forces of joints"
    ):
        simulate(scene, np.array([0.1]))


def test_a_force_that_others_may_bear_brakes_nothing() -> None:
    """Of three cranks of a parallelogram two would do."""
    rod = {"kind": "rod", "length": 1.0, "height": 0.02, "width": 0.04, "density": 2500.0}
    bodies, joints = {"C": rod | {"length": 2.0}}, {}
    for k in range(3):
        bodies[f"L{k}"] = rod
        joints[f"O{k}"] = {"first": {"body": "ground", "point": [k, 0.0]}, "second": {"body": f"L{k}"}}
        joints[f"P{k}"] = {"first": {"body": f"L{k}", "point": "end"}, "second": {"body": "C", "point": [k, 0.0]}}
    start = {name: {"angle": 0.0 if name == "C" else 1.0} for name in bodies}
    scene = machine(bodies, joints, {"M": {"body": "C", "point": "end"}}, initial=start)
    assert simulate(scene, np.array([0.1])).ok
    dry = scene.with_values({"joints.O0.radius": 0.05}).with_values({"joints.O0.mu": 0.3})
    with pytest.raises(InputError, match=r"joints\.O0\.mu: the force of O0 is not unique"):
        simulate(dry, np.array([0.1]))
    del bodies["L2"], joints["O2"], joints["P2"], start["L2"]
    joints["O0"] |= {"mu": 0.3, "radius": 0.05}
    assert simulate(machine(bodies, joints, {"M": {"body": "C"}}, initial=start), np.array([0.1])).ok
