"""The cable element: mass, rigid motion, force and tangent as derivatives of the energy, another derivation."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest
from shoal.engines.casadi.element import cable_element
from shoal.mechanics.elements import ancf_cable
from shoal.mechanics.elements.ancf_cable import AncfCables
from shoal.mechanics.numerics.tile import SINGLE, WIDE

EA, EI, LENGTH = 1.6e5, 5.3, 0.5
TABLES = {
    "full": (ancf_cable.FULL_AXIAL, ancf_cable.FULL_BENDING),
    "reduced": (ancf_cable.REDUCED_AXIAL, ancf_cable.REDUCED_BENDING),
}
both = pytest.mark.parametrize("quadrature", list(TABLES))


def _element(lanes: int = 1) -> AncfCables:
    numbers = ancf_cable.coefficients(np.array(LENGTH), np.array(EA), np.array(EI))
    return AncfCables(1, np.arange(8), np.repeat([float(number) for number in numbers], lanes))


def _bent(seed: int) -> Any:
    """A random element, stretched by some percent, bent by some tenths of a radian, turned anyhow."""
    rng = np.random.default_rng(seed)
    turn, bend = rng.uniform(-np.pi, np.pi), rng.uniform(-0.6, 0.6, 2)
    stretch = 1 + rng.uniform(-0.05, 0.05, 3)
    first = rng.normal(size=2)
    chord = LENGTH * stretch[0] * np.array([np.cos(turn), np.sin(turn)])
    slopes = [s * np.array([np.cos(turn + b), np.sin(turn + b)]) for s, b in zip(stretch[1:], bend, strict=True)]
    return np.concatenate([first, slopes[0], first + chord, slopes[1]])


def _force(kernels: Any, quadrature: str, z: Any) -> Any:
    f = np.zeros(8)
    kernels.cable_force(SINGLE, _element(), quadrature == "full", z.copy(), f, np.zeros(24))
    return f


def _energy(kernels: Any, quadrature: str, z: Any) -> float:
    energy = np.zeros(1)
    kernels.cable_energy(SINGLE, _element(), *TABLES[quadrature], z.copy(), energy, np.zeros(24))
    return float(energy[0])


def _tangent(kernels: Any, quadrature: str, z: Any) -> Any:
    out = np.full(64, np.nan)
    kernels.cable_tangent(SINGLE, _element(), *TABLES[quadrature], z.copy(), out, np.zeros(24))
    return out.reshape(8, 8)


def test_mass_matrix_is_positive_and_keeps_mass_and_moments() -> None:
    rho, length = 4.432, 0.7
    mass = np.array(ancf_cable.mass_matrix(rho, length))
    np.testing.assert_array_equal(mass, mass.T)
    assert np.linalg.eigvalsh(mass).min() > 0
    # A translation and a rotation of the straight element, r = 1 and r = s, are in the element's space:
    # int rho, int rho s, int rho s^2 over the length are exact.
    one, s = np.array([1.0, 0, 1, 0]), np.array([0.0, 1, length, 1])
    assert one @ mass @ one == pytest.approx(rho * length, rel=1e-14)
    assert one @ mass @ s == pytest.approx(rho * length**2 / 2, rel=1e-14)
    assert s @ mass @ s == pytest.approx(rho * length**3 / 3, rel=1e-14)


def test_weight_is_the_mass_matrix_on_a_uniform_acceleration() -> None:
    mass, load = np.array(ancf_cable.mass_matrix(3.0, 0.7)), np.array(ancf_cable.weight(3.0, 0.7))
    np.testing.assert_allclose(load, mass @ [1, 0, 1, 0], rtol=1e-14)


def test_mass_is_the_exact_integral_of_the_shape_functions() -> None:
    # Gauss with 4 points is exact to degree 7; products of cubics have degree 6.
    points, weights = np.polynomial.legendre.leggauss(4)
    expected = sum(
        0.5 * w * np.outer(s := np.array(ancf_cable.position_shape((1 + x) / 2, np.array(LENGTH))), s)
        for x, w in zip(points, weights, strict=True)
    )
    np.testing.assert_allclose(ancf_cable.mass_matrix(1.0, LENGTH), LENGTH * expected, rtol=1e-13)


def test_slope_shape_is_the_derivative_of_the_position_shape() -> None:
    x, h, length = 0.3, 1e-5, np.array(LENGTH)
    up, down = (np.array(ancf_cable.position_shape(x + side * h, length)) for side in (1, -1))
    np.testing.assert_allclose(ancf_cable.slope_shape(x, length), (up - down) / (2 * h * LENGTH), atol=1e-8)


@both
@pytest.mark.parametrize("seed", range(5))
def test_rigid_motion_gives_no_force(kernels: Any, quadrature: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    turn, first = rng.uniform(-np.pi, np.pi), rng.normal(size=2)
    e = np.array([np.cos(turn), np.sin(turn)])
    z = np.concatenate([first, e, first + LENGTH * e, e])
    assert np.abs(_force(kernels, quadrature, z)).max() < 1e-14 * EA
    assert _energy(kernels, quadrature, z) < 1e-20 * EA * LENGTH
    # No stiffness against the three rigid motions either.
    quarter = np.array([[0.0, -1], [1, 0]])
    swing = np.concatenate([quarter @ part for part in z.reshape(4, 2)])
    for motion in (np.tile([1.0, 0, 0, 0], 2), np.tile([0, 1.0, 0, 0], 2), swing):
        assert np.abs(_tangent(kernels, quadrature, z) @ motion).max() < 1e-12 * EA / LENGTH


@both
@pytest.mark.parametrize("seed", range(5))
def test_force_is_the_negative_gradient_of_the_energy(kernels: Any, quadrature: str, seed: int) -> None:
    z, h = _bent(seed), 1e-5
    gradient = [
        (_energy(kernels, quadrature, z + h * unit) - _energy(kernels, quadrature, z - h * unit)) / (2 * h)
        for unit in np.eye(8)
    ]
    force = _force(kernels, quadrature, z)
    np.testing.assert_allclose(force, np.negative(gradient), atol=1e-7 * np.abs(force).max())
    # Inner forces: no resultant, no moment (both ends' forces and the slopes' generalised forces).
    cross = z[0::2] * force[1::2] - z[1::2] * force[0::2]
    assert np.abs(force[0:2] + force[4:6]).max() < 1e-13 * np.abs(force).max()
    assert abs(cross.sum()) < 1e-12 * np.abs(force).max()


@both
@pytest.mark.parametrize("seed", range(5))
def test_tangent_is_the_negative_gradient_of_the_force(kernels: Any, quadrature: str, seed: int) -> None:
    z, h = _bent(seed), 1e-6
    columns = [
        (_force(kernels, quadrature, z + h * unit) - _force(kernels, quadrature, z - h * unit)) / (2 * h)
        for unit in np.eye(8)
    ]
    tangent = _tangent(kernels, quadrature, z)
    np.testing.assert_allclose(tangent, tangent.T, atol=1e-12 * np.abs(tangent).max())
    np.testing.assert_allclose(tangent, -np.array(columns).T, atol=1e-8 * np.abs(tangent).max())


@both
@pytest.mark.parametrize("seed", range(5))
def test_energy_and_force_equal_another_derivation(kernels: Any, quadrature: str, seed: int) -> None:
    """CasADi differentiates the energy written in arc length; nothing is shared but the name of the quadrature."""
    e, h = ca.SX.sym("e", 8), ca.SX.sym("h")
    axial, bending = cable_element(quadrature).strain(e, h)
    energy = (EA * axial + EI * bending) / 2
    other = ca.Function("other", [e, h], [energy, -ca.gradient(energy, e), ca.hessian(energy, e)[0]])
    z = _bent(seed)
    value, force, stiffness = (np.array(part) for part in other(z, LENGTH))
    assert _energy(kernels, quadrature, z) == pytest.approx(value.item(), rel=1e-12)
    np.testing.assert_allclose(
        _force(kernels, quadrature, z), force.ravel(), rtol=1e-10, atol=1e-12 * np.abs(force).max()
    )
    np.testing.assert_allclose(
        _tangent(kernels, quadrature, z), stiffness, rtol=1e-10, atol=1e-12 * np.abs(stiffness).max()
    )


@both
def test_lanes_equal_singles(kernels: Any, quadrature: str) -> None:
    width = len(WIDE)
    states = np.array([_bent(seed) for seed in range(width)]).T
    forces, tangents = np.zeros((8, width)), np.zeros((64, width))
    elements = _element(width)
    kernels.cable_force(WIDE, elements, quadrature == "full", states.ravel(), forces.reshape(-1), np.zeros(24 * width))
    kernels.cable_tangent(
        WIDE, elements, *TABLES[quadrature], states.ravel(), tangents.reshape(-1), np.zeros(24 * width)
    )
    for lane in range(width):
        single = _force(kernels, quadrature, np.ascontiguousarray(states[:, lane]))
        np.testing.assert_allclose(forces[:, lane], single, atol=1e-13 * np.abs(single).max())
        stiffness = _tangent(kernels, quadrature, np.ascontiguousarray(states[:, lane]))
        np.testing.assert_allclose(tangents[:, lane].reshape(8, 8), stiffness, atol=1e-13 * np.abs(stiffness).max())


@both
@pytest.mark.parametrize("count", [1, 4])
def test_a_cantilever_bends_by_the_textbook_amount(kernels: Any, quadrature: str, count: int) -> None:
    """Tip deflection P L^3 / (3 EI) and slope P L^2 / (2 EI) of a clamped beam: exact for cubics under a tip load."""
    total, load = LENGTH * count, 1e-6
    size = 4 * (count + 1)
    stiffness = np.zeros((size, size))
    for number in range(count):
        at = 4 * number
        start = np.array([LENGTH * number, 0, 1, 0, LENGTH * (number + 1), 0, 1, 0])
        stiffness[at : at + 8, at : at + 8] += _tangent(kernels, quadrature, start)
    tip = np.zeros(size - 4)
    tip[-3] = load
    moved = np.linalg.solve(stiffness[4:, 4:], tip)
    assert moved[-3] == pytest.approx(load * total**3 / (3 * EI), rel=1e-8)
    assert moved[-1] == pytest.approx(load * total**2 / (2 * EI), rel=1e-8)
    # Pulled along its axis it stretches by P L / EA.
    pull = np.zeros(size - 4)
    pull[-4] = load
    assert np.linalg.solve(stiffness[4:, 4:], pull)[-4] == pytest.approx(load * total / EA, rel=1e-8)
