"""Torsion springs between directions from place to place: a linear oscillator, a chain that is a beam, refusals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from shoal.errors import InputError
from shoal.mechanics.analysis.modes import modes
from shoal.mechanics.analysis.statics import statics
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene

GROUND = {"body": "ground", "point": [0.0, 0.0]}


def one(rate: float = 0.0, **spring: Any) -> Scene:
    """A mass of 2 kg on a massless arm of 0.5 m, held to the ground's x axis by 3 N m/rad."""
    mass = {"body": "A"}
    return Scene.parse({
        "name": "arm", "gravity": [0, 0], "bodies": {"A": {"kind": "point-mass", "mass": 2.0}},
        "joints": {"D": {"kind": "distance", "first": GROUND, "second": mass, "length": 0.5}},
        "loads": {"S": {"kind": "torsion-spring", "first": GROUND, "second": GROUND, "second_to": mass,
                        "stiffness": 3.0} | spring},
        "markers": {"A": mass}, "initial": {"A": {"position": [0.5, 0.0], "velocity": [0.0, 0.5 * rate]}},
    })  # fmt: skip


@pytest.mark.parametrize("amplitude", [0.3, 4.0])
def test_the_spring_is_linear_also_beyond_half_a_turn(amplitude: float) -> None:
    omega = np.sqrt(3.0 / (2.0 * 0.25))
    times = np.linspace(0.1, 5.0, 20)
    run = simulate(one(amplitude * omega).with_values({"solver.integrator": "dop853"}), times)
    assert run.ok
    angle = amplitude * np.sin(omega * times)
    np.testing.assert_allclose(run.marker("A"), 0.5 * np.stack([np.cos(angle), np.sin(angle)], axis=1), atol=1e-8)


def test_the_rest_may_be_another_angle() -> None:
    found = statics(one(angle=0.7))
    assert found.ok
    np.testing.assert_allclose(found.marker("A"), [0.5 * np.cos(0.7), 0.5 * np.sin(0.7)], atol=1e-10)


def chain(count: int) -> Scene:
    """A cantilever of unit length, mass and bending stiffness as masses on distances with springs between these."""
    length = 1.0 / count
    bodies = {f"m{k}": {"kind": "point-mass", "mass": length * (0.5 if k == count else 1.0)}
              for k in range(1, count + 1)}  # fmt: skip
    places: list[dict[str, Any]] = [GROUND, *({"body": name} for name in bodies)]
    joints = {f"d{k}": {"kind": "distance", "first": places[k - 1], "second": places[k]} for k in range(1, count + 1)}
    loads: dict[str, Any] = {"s0": {"kind": "torsion-spring", "first": GROUND, "second": GROUND, "second_to": places[1],
                                    "stiffness": 2.0 / length}}  # fmt: skip
    for k in range(1, count):
        loads[f"s{k}"] = {"kind": "torsion-spring", "first": places[k - 1], "first_to": places[k],
                          "second": places[k], "second_to": places[k + 1], "stiffness": 1.0 / length}  # fmt: skip
    start = {name: {"position": [length * k, 0.0]} for k, name in enumerate(bodies, 1)}
    return Scene.parse({"name": "chain", "gravity": [0, 0], "bodies": bodies, "joints": joints, "loads": loads,
                        "markers": {"end": places[-1]}, "initial": start})  # fmt: skip


def test_a_chain_of_masses_vibrates_as_the_cantilever_that_it_stands_for() -> None:
    """omega = 3.51602 sqrt(EI/(rho A L^4)) of Euler and Bernoulli's beam, met with the second order."""
    errors = [modes(chain(count), count=1).modes[0].angular_frequency / 3.516015 - 1 for count in (8, 16)]
    assert abs(errors[1]) < 4e-3
    assert errors[0] / errors[1] == pytest.approx(4.0, abs=0.3)


@pytest.mark.parametrize(
    ("spring", "message"),
    [
        ({"first": {"body": "A"}}, r"loads\.S\.first: A is a point mass, which has no angle; .* first_to or second_to"),
        ({"second_to": GROUND}, r"loads\.S\.second_to: is where second is at the start; no direction leads there"),
        ({"second_to": {"body": "B"}}, r"loads\.S\.second_to\.body: no body 'B'"),
    ],
)
def test_what_has_no_direction_is_refused(spring: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        simulate(one(**spring), np.array([0.1]))


def test_it_is_for_the_plane() -> None:
    with pytest.raises(InputError, match=r"loads\.S\.second_to: is for scenes in the plane"):
        one().with_values({"dimensions": 3})


@pytest.mark.parametrize("angle", [np.pi, -np.pi, 3.0])
def test_a_chain_that_is_nearly_straight_is_not_wound_up_to_either_side(angle: float) -> None:
    """Its mirror image, of the opposite rest angle, moves as its mirror image."""

    def moved(side: float, rest: float) -> Any:
        mass, place = {"kind": "point-mass", "mass": 0.1}, lambda name: {"body": name}
        scene = Scene.parse({
            "name": "chain", "gravity": [0, 0], "bodies": {"b": mass, "c": mass},
            "joints": {"ab": {"kind": "distance", "first": GROUND, "second": place("b")},
                       "bc": {"kind": "distance", "first": place("b"), "second": place("c")}},
            "loads": {"t": {"kind": "torsion-spring", "first": place("b"), "first_to": GROUND, "second": place("b"),
                            "second_to": place("c"), "stiffness": 0.8, "angle": rest}},
            "markers": {"c": place("c")},
            "initial": {"b": {"position": [0.2, 0.0]}, "c": {"position": [0.4, 0.02 * side]}},
        })  # fmt: skip
        run = simulate(scene, np.linspace(0.05, 0.5, 10))
        assert run.ok, run.message
        return run.marker("c") * [1.0, side]

    up, down = moved(1.0, angle), moved(-1.0, -angle)
    np.testing.assert_allclose(up, down, atol=1e-9)
    if abs(angle) > 3.1:  # straight: it swings by as much as it was bent
        assert np.max(np.abs(up[:, 1])) < 0.03
