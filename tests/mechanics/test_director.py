"""The director rod: closed forms of torsion and bending about both axes, derivatives, rotations, shapes at rest."""

from __future__ import annotations

from typing import Any

import element_doors as doors
import numpy as np
import pytest
from shoal.mechanics.dynamics import ELEMENT_ROOM
from shoal.mechanics.elements import director, families
from shoal.mechanics.numerics.tile import SINGLE, WIDE, packed
from shoal.scene.sections import Rectangle

YOUNG, SHEAR, HEIGHT, WIDTH, LENGTH = 2e8, 7.5e7, 0.04, 0.02, 0.5
SECTION = Rectangle(HEIGHT, WIDTH)
REST = (0.1, 0.2, -0.1, 0.05, 0.1, 0.3, 0.01, -0.02, 0.005)


def _elements(free: tuple[float, ...], count: int = 1, *, tile: Any = SINGLE) -> Any:
    found = families.Collected()
    for number in range(count):
        part = director.entry(
            YOUNG, SHEAR * SECTION.torsion, SECTION.area, (SECTION.bending, SECTION.side), LENGTH, [*free]
        )
        found.add("rod", [*range(18 * number, 18 * (number + 1))], part)
    return packed(found.family(director.DirectorRods), slice(0, len(tile)), tile)


def _evaluate(z: Any, free: tuple[float, ...] = (0.0,) * 9) -> tuple[float, Any]:
    f, energy, at, room = np.zeros(z.size), np.zeros(1), z.ravel().copy(), np.zeros(ELEMENT_ROOM)
    rods = _elements(free, z.size // 18)
    doors.force(SINGLE, rods, at, at, f, room, energy)
    doors.energy(SINGLE, rods, at, room, energy)
    return float(energy[0]), f.reshape(z.shape)


def _state(seed: int) -> Any:
    """r, r' and d of both nodes of a random element, with directors as the constraints want them."""
    rng = np.random.default_rng(seed)
    nodes = []
    for node in range(2):
        slope = np.array([1.0, 0, 0]) + rng.uniform(-0.3, 0.3, 3) * [0.1, 1, 1]
        along = slope / np.linalg.norm(slope)
        side = np.array([0, 1.0, 0]) + rng.uniform(-0.3, 0.3, 3)
        side -= along * (along @ side)
        nodes += [np.array([LENGTH * node, 0, 0]) + rng.uniform(-0.01, 0.01, 3), slope, side / np.linalg.norm(side)]
    return np.array(nodes)


def _turned(seed: int) -> Any:
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    return turn * np.linalg.det(turn)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_force_and_stiffness_are_derivatives_and_turn_with_the_rod(seed: int) -> None:
    z, h, turn = _state(seed), 1e-6, _turned(seed)
    energy, force = _evaluate(z, REST)
    units = h * np.eye(18).reshape(-1, 6, 3)
    gradient = [(_evaluate(z + unit, REST)[0] - _evaluate(z - unit, REST)[0]) / (2 * h) for unit in units]
    np.testing.assert_allclose(force.ravel(), np.negative(gradient), atol=1e-7 * np.abs(force).max())
    turned, other = _evaluate(z @ turn.T, REST)
    assert turned == pytest.approx(energy, rel=1e-12)
    np.testing.assert_allclose(other, force @ turn.T, atol=1e-11 * np.abs(force).max())
    assert np.abs(force[0] + force[3]).max() < 1e-12 * np.abs(force).max()
    assert np.abs(np.cross(z, force).sum(axis=0)).max() < 1e-11 * np.abs(force).max()
    many, apart = _evaluate(np.array([z, _state(9)] * 5), REST)
    assert many == pytest.approx(5 * (energy + _evaluate(_state(9), REST)[0]), rel=1e-12)
    np.testing.assert_allclose(apart[8], force, atol=1e-13 * np.abs(force).max())
    out = np.zeros(18 * 18)
    doors.tangent(SINGLE, _elements(REST), z.ravel().copy(), np.zeros(ELEMENT_ROOM), out)
    columns = np.array([(_evaluate(z - u, REST)[1] - _evaluate(z + u, REST)[1]).ravel() / (2 * h) for u in units])
    stiffness = out.reshape(18, 18)
    np.testing.assert_allclose(stiffness, columns.T, atol=1e-7 * np.abs(stiffness).max())


@pytest.mark.slow
@pytest.mark.parametrize("twist", [1e-3, 0.5, 1.5])
def test_a_uniform_twist_has_the_energy_of_saint_venant(twist: float) -> None:
    z = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [LENGTH, 0, 0], [1, 0, 0], [0, np.cos(twist), np.sin(twist)]])
    energy, force = _evaluate(z @ _turned(4).T)
    torque = SHEAR * SECTION.torsion * twist / LENGTH
    assert energy == pytest.approx(torque * twist / 2, rel=1e-12)
    np.testing.assert_allclose(np.cross(z, force @ _turned(4))[5], [-torque, 0, 0], atol=1e-11 * torque)


@pytest.mark.parametrize("roll", [0.0, np.pi / 2, 0.7])
def test_an_arc_has_the_stiffness_of_the_side_it_bends_to(roll: float) -> None:
    """Energy of an arc in the plane x, y whose section is turned by roll about the tangent; at rest it has none."""
    bend, radius = 0.05, LENGTH / 0.05
    nodes = []
    for a in (0.0, bend):
        along, inward = np.array([np.cos(a), np.sin(a), 0]), np.array([-np.sin(a), np.cos(a), 0])
        place = radius * np.array([np.sin(a), 1 - np.cos(a), 0])
        nodes += [place, along, np.cos(roll) * inward + np.sin(roll) * np.array([0, 0, 1.0])]
    strong, weak = YOUNG * WIDTH * HEIGHT**3 / 12, YOUNG * HEIGHT * WIDTH**3 / 12
    expected = (strong * np.cos(roll) ** 2 + weak * np.sin(roll) ** 2) * bend**2 / (2 * LENGTH)
    energy, _ = _evaluate(np.array(nodes))
    assert energy == pytest.approx(expected, rel=1e-3)
    at_rest = (*(0.0, bend * np.cos(roll), -bend * np.sin(roll)) * 2, 0.0, 0.0, 0.0)
    assert _evaluate(np.array(nodes), at_rest)[0] < 1e-5 * expected


@pytest.mark.slow
def test_lanes_equal_singles() -> None:
    width = len(WIDE)
    states = np.array([_state(seed) for seed in range(width)])
    forces, energies = np.zeros((18, width)), np.zeros(width)
    z = np.ascontiguousarray(states.reshape(width, 18).T).ravel()
    rods, room = _elements(REST, tile=WIDE), np.zeros(64 * width)
    doors.force(WIDE, rods, z, z, forces.reshape(-1), room, energies)
    doors.energy(WIDE, rods, z, room, energies)
    for lane, state in enumerate(states):
        energy, force = _evaluate(state, REST)
        np.testing.assert_allclose(forces[:, lane], force.ravel(), atol=1e-13 * np.abs(force).max())
        assert energies[lane] == pytest.approx(energy, rel=1e-13)
