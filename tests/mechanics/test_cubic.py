"""The cubic element: rigid motion, force and tangent as derivatives of the energy, another derivation."""

from __future__ import annotations

from typing import Any

import casadi as ca
import element_doors as doors
import numpy as np
import pytest
from shoal.engines.casadi.element import cable_element
from shoal.mechanics.dynamics import ELEMENT_ROOM
from shoal.mechanics.elements import beam, cubic, families
from shoal.mechanics.numerics.tile import SINGLE, WIDE, packed

EA, EI, LENGTH = 1.6e5, 5.3, 0.5
VARIANTS = {"full": (cubic.FULL, cubic.FULL_RULE), "reduced": (cubic.REDUCED, cubic.REDUCED_RULE)}
both = pytest.mark.parametrize("quadrature", list(VARIANTS))


def _element(quadrature: str, lanes: int = 1) -> Any:
    variant, rule = VARIANTS[quadrature]
    straight = [np.array(v) for v in ([0.0, 0.0], [1.0, 0.0], [LENGTH, 0.0], [1.0, 0.0])]
    numbers = [1 / LENGTH, EA * LENGTH, EI / LENGTH, 0.0]
    found = families.Collected()
    reference = beam.reference(beam.CUBIC, rule, straight, LENGTH)
    found.add("rod", [*range(8)], families.Entry(rule, variant, False, numbers, reference))
    return packed(found.family(cubic.Cubics), slice(0, lanes), (0,) * lanes)


def _bent(seed: int) -> Any:
    """A random element, stretched by some percent, bent by some tenths of a radian, turned anyhow."""
    rng = np.random.default_rng(seed)
    turn, bend = rng.uniform(-np.pi, np.pi), rng.uniform(-0.6, 0.6, 2)
    stretch = 1 + rng.uniform(-0.05, 0.05, 3)
    first = rng.normal(size=2)
    chord = LENGTH * stretch[0] * np.array([np.cos(turn), np.sin(turn)])
    slopes = [s * np.array([np.cos(turn + b), np.sin(turn + b)]) for s, b in zip(stretch[1:], bend, strict=True)]
    return np.concatenate([first, slopes[0], first + chord, slopes[1]])


def _force(quadrature: str, z: Any) -> Any:
    f, at = np.zeros(8), z.copy()
    doors.force(SINGLE, _element(quadrature), at, at, f, np.zeros(ELEMENT_ROOM), np.zeros(1))
    return f


def _energy(quadrature: str, z: Any) -> float:
    energy = np.zeros(1)
    doors.energy(SINGLE, _element(quadrature), z.copy(), np.zeros(ELEMENT_ROOM), energy)
    return float(energy[0])


def _tangent(quadrature: str, z: Any) -> Any:
    out = np.full(64, np.nan)
    doors.tangent(SINGLE, _element(quadrature), z.copy(), np.zeros(ELEMENT_ROOM), out)
    return out.reshape(8, 8)


@both
@pytest.mark.parametrize("seed", range(5))
def test_rigid_motion_gives_no_force(quadrature: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    turn, first = rng.uniform(-np.pi, np.pi), rng.normal(size=2)
    e = np.array([np.cos(turn), np.sin(turn)])
    z = np.concatenate([first, e, first + LENGTH * e, e])
    assert np.abs(_force(quadrature, z)).max() < 1e-14 * EA
    assert _energy(quadrature, z) < 1e-20 * EA * LENGTH
    # No stiffness against the three rigid motions either.
    quarter = np.array([[0.0, -1], [1, 0]])
    swing = np.concatenate([quarter @ part for part in z.reshape(4, 2)])
    for motion in (np.tile([1.0, 0, 0, 0], 2), np.tile([0, 1.0, 0, 0], 2), swing):
        assert np.abs(_tangent(quadrature, z) @ motion).max() < 1e-12 * EA / LENGTH


@both
@pytest.mark.parametrize("seed", range(5))
def test_force_is_the_negative_gradient_of_the_energy(quadrature: str, seed: int) -> None:
    z, h = _bent(seed), 1e-5
    gradient = [(_energy(quadrature, z + h * unit) - _energy(quadrature, z - h * unit)) / (2 * h) for unit in np.eye(8)]
    force = _force(quadrature, z)
    np.testing.assert_allclose(force, np.negative(gradient), atol=1e-7 * np.abs(force).max())
    # Inner forces: no resultant, no moment (both ends' forces and the slopes' generalised forces).
    cross = z[0::2] * force[1::2] - z[1::2] * force[0::2]
    assert np.abs(force[0:2] + force[4:6]).max() < 1e-13 * np.abs(force).max()
    assert abs(cross.sum()) < 1e-12 * np.abs(force).max()


@both
@pytest.mark.parametrize("seed", range(5))
def test_tangent_is_the_negative_gradient_of_the_force(quadrature: str, seed: int) -> None:
    z, h = _bent(seed), 1e-6
    columns = [(_force(quadrature, z + h * unit) - _force(quadrature, z - h * unit)) / (2 * h) for unit in np.eye(8)]
    tangent = _tangent(quadrature, z)
    np.testing.assert_allclose(tangent, tangent.T, atol=1e-12 * np.abs(tangent).max())
    np.testing.assert_allclose(tangent, -np.array(columns).T, atol=1e-8 * np.abs(tangent).max())


@both
@pytest.mark.parametrize("seed", range(5))
def test_energy_and_force_equal_another_derivation(quadrature: str, seed: int) -> None:
    """CasADi differentiates the energy written in arc length; nothing is shared but the name of the quadrature."""
    e, h = ca.SX.sym("e", 8), ca.SX.sym("h")
    axial, bending = cable_element(quadrature).strain(e, h)
    energy = (EA * axial + EI * bending) / 2
    other = ca.Function("other", [e, h], [energy, -ca.gradient(energy, e), ca.hessian(energy, e)[0]])
    z = _bent(seed)
    value, force, stiffness = (np.array(part) for part in other(z, LENGTH))
    assert _energy(quadrature, z) == pytest.approx(value.item(), rel=1e-12)
    np.testing.assert_allclose(_force(quadrature, z), force.ravel(), rtol=1e-10, atol=1e-12 * np.abs(force).max())
    np.testing.assert_allclose(_tangent(quadrature, z), stiffness, rtol=1e-10, atol=1e-12 * np.abs(stiffness).max())


@both
def test_lanes_equal_singles(quadrature: str) -> None:
    width = len(WIDE)
    states = np.array([_bent(seed) for seed in range(width)]).T
    forces, tangents = np.zeros((8, width)), np.zeros((64, width))
    elements = _element(quadrature, width)
    doors.force(
        WIDE, elements, states.ravel(), states.ravel(), forces.reshape(-1), np.zeros(ELEMENT_ROOM), np.zeros(width)
    )
    doors.tangent(WIDE, elements, states.ravel(), np.zeros(ELEMENT_ROOM), tangents.reshape(-1))
    for lane in range(width):
        single = _force(quadrature, np.ascontiguousarray(states[:, lane]))
        np.testing.assert_allclose(forces[:, lane], single, atol=1e-13 * np.abs(single).max())
        stiffness = _tangent(quadrature, np.ascontiguousarray(states[:, lane]))
        np.testing.assert_allclose(tangents[:, lane].reshape(8, 8), stiffness, atol=1e-13 * np.abs(stiffness).max())


@both
@pytest.mark.parametrize("count", [1, 4])
def test_a_cantilever_bends_by_the_textbook_amount(quadrature: str, count: int) -> None:
    """Tip deflection P L^3 / (3 EI) and slope P L^2 / (2 EI) of a clamped beam: exact for cubics under a tip load."""
    total, load = LENGTH * count, 1e-6
    size = 4 * (count + 1)
    stiffness = np.zeros((size, size))
    for number in range(count):
        at = 4 * number
        start = np.array([LENGTH * number, 0, 1, 0, LENGTH * (number + 1), 0, 1, 0])
        stiffness[at : at + 8, at : at + 8] += _tangent(quadrature, start)
    tip = np.zeros(size - 4)
    tip[-3] = load
    moved = np.linalg.solve(stiffness[4:, 4:], tip)
    assert moved[-3] == pytest.approx(load * total**3 / (3 * EI), rel=1e-8)
    assert moved[-1] == pytest.approx(load * total**2 / (2 * EI), rel=1e-8)
    # Pulled along its axis it stretches by P L / EA.
    pull = np.zeros(size - 4)
    pull[-4] = load
    assert np.linalg.solve(stiffness[4:, 4:], pull)[-4] == pytest.approx(load * total / EA, rel=1e-8)
