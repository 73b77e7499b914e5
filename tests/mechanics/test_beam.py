"""Cubic and quintic beams: mass, objectivity, derivatives, damping, pre-curved shapes, large deflections."""

from __future__ import annotations

from typing import Any

import element_doors as doors
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import ellipk, ellipkinc
from shoal.mechanics.dynamics import ELEMENT_ROOM
from shoal.mechanics.elements import beam, cubic, families, quintic
from shoal.mechanics.elements.beam import CUBIC, QUINTIC
from shoal.mechanics.numerics.tile import SINGLE, WIDE, packed

EA, EI, LENGTH, ETA = 1.6e5, 5.3, 0.5, 2e-3
RULES = [(CUBIC, 5, 3), (QUINTIC, 4, 4), (QUINTIC, 5, 5)]
every_rule = pytest.mark.parametrize(("vectors", "axial", "bending"), RULES)
orders = pytest.mark.parametrize("vectors", [CUBIC, QUINTIC])


def _straight(vectors: int, length: float) -> list[complex]:
    """Nodal vectors of an element at rest on the x axis."""
    return [*[0j, 1 + 0j, 0j][: vectors // 2], *[length + 0j, 1 + 0j, 0j][: vectors // 2]]


def _family(
    rule: tuple[int, int, int],
    *,
    rest: Any = None,
    eta: float = 0.0,
    lanes: int = 1,
    elements: int = 1,
    length: float = LENGTH,
    axial: float = EA,
    bending: float = EI,
) -> Any:
    """A chain of equal elements; rest: complex nodal vectors of every element."""
    vectors, table = rule[0], beam.quadrature(*rule)
    if vectors == CUBIC:
        kind: Any = cubic.Cubics
        variant = cubic.DAMPED if eta else cubic.FULL if rest is None else cubic.CURVED
    else:
        four = rule[1:] == (4, 4)
        kind, variant = quintic.Quintics, quintic.FOUR if four else quintic.FIVE
        if eta:
            variant = quintic.FOUR_DAMPED if four else quintic.FIVE_DAMPED
        elif rest is not None:
            variant = quintic.FOUR_CURVED if four else quintic.FIVE_CURVED
    found = families.Collected()
    for number, nodal in enumerate([_straight(vectors, length)] * elements if rest is None else rest):
        places = [np.array([v.real, v.imag]) for v in nodal]
        numbers = [1.0 / length, axial * length, bending / length, eta]
        part = families.Entry(table, variant, eta > 0, numbers, beam.reference(vectors, table, places, length))
        found.add("rod", [*range(vectors * number, vectors * (number + 2))], part)
    return packed(found.family(kind), slice(0, lanes), (0,) * lanes)


def _pairs(vectors: Any) -> Any:
    values = np.asarray(vectors, dtype=complex)
    return np.column_stack([values.real, values.imag]).ravel()


def _bent(vectors: int, seed: int) -> Any:
    """A random element, stretched by some percent, bent by some tenths of a radian, turned anyhow."""
    rng = np.random.default_rng(seed)
    turn = np.exp(1j * rng.uniform(-np.pi, np.pi))
    first = complex(*rng.normal(size=2))
    stretch = 1 + rng.uniform(-0.05, 0.05, 3)
    nodes = [first, first + LENGTH * stretch[0] * turn]
    state = []
    for node, s in zip(nodes, stretch[1:], strict=True):
        slope = s * turn * np.exp(1j * rng.uniform(-0.6, 0.6))
        curve = turn * complex(*rng.normal(size=2)) * 0.3 / LENGTH
        state += [node, slope, curve][: vectors // 2]
    return _pairs(state)


def _arc(vectors: int, radius: float, length: float, begin: float = 0.0) -> list[complex]:
    """Nodal vectors of an element of a circle, from the arc length `begin` on; it starts along x at the origin."""
    state = []
    for s in (begin, begin + length):
        turn = np.exp(1j * s / radius)
        state += [1j * radius * (1 - turn), turn, 1j * turn / radius][: vectors // 2]
    return state


def _force(family: Any, z: Any, zdot: Any = None) -> tuple[Any, float]:
    f, power = np.zeros(z.size), np.zeros(1)
    doors.force(
        SINGLE, family, z.copy(), np.zeros(z.size) if zdot is None else zdot.copy(), f, np.zeros(ELEMENT_ROOM), power
    )
    return f, float(power[0])


def _energy(family: Any, z: Any) -> float:
    energy = np.zeros(1)
    doors.energy(SINGLE, family, z.copy(), np.zeros(ELEMENT_ROOM), energy)
    return float(energy[0])


def _matrix(family: Any, z: Any, *, viscous: bool = False) -> Any:
    """Assembled over the chain."""
    side = family.side
    out = np.full(family.size * side * side, np.nan)
    doors.matrix(SINGLE, family, viscous, z.copy(), np.zeros(ELEMENT_ROOM), out)
    whole = np.zeros((z.size, z.size))
    for rows, block in zip(
        family.rows[: side * family.size].reshape(-1, side), out.reshape(-1, side, side), strict=True
    ):
        whole[np.ix_(rows, rows)] += block
    return whole


@orders
def test_mass_is_positive_exact_and_keeps_mass_and_moments(vectors: int) -> None:
    rho, length, order = 4.432, 0.7, vectors // 2
    mass = np.array(beam.mass_matrix(vectors, rho, length))
    np.testing.assert_array_equal(mass, mass.T)
    assert np.linalg.eigvalsh(mass).min() > 0
    one, s = np.zeros(vectors), np.zeros(vectors)
    one[[0, order]], s[[1, order, order + 1]] = 1.0, [1.0, length, 1.0]
    assert one @ mass @ one == pytest.approx(rho * length, rel=1e-13)
    assert one @ mass @ s == pytest.approx(rho * length**2 / 2, rel=1e-13)
    assert s @ mass @ s == pytest.approx(rho * length**3 / 3, rel=1e-13)
    np.testing.assert_allclose(beam.weight(vectors, rho, length), mass @ one, rtol=1e-13)
    points, weights = np.polynomial.legendre.leggauss(7)
    shape = np.array(beam.shape(vectors, (1 + points) / 2, length, 0))
    np.testing.assert_allclose(mass, rho * length / 2 * (shape * weights) @ shape.T, rtol=1e-12)


@orders
def test_shapes_are_derivatives_of_each_other_and_interpolate(vectors: int) -> None:
    x, h, order = 0.3, 1e-4, vectors // 2
    for lower in (0, 1):
        change = doors.differences(
            lambda at, lower=lower: np.array(beam.shape(vectors, at[0], LENGTH, lower)), np.array([x]), h
        )
        np.testing.assert_allclose(beam.shape(vectors, x, LENGTH, lower + 1), change[:, 0] / LENGTH, atol=1e-9)
    for node in (0, 1):
        values = [beam.shape(vectors, float(node), LENGTH, derivative) for derivative in range(order)]
        np.testing.assert_allclose(values, np.eye(vectors)[node * order : (node + 1) * order], atol=1e-12)


@every_rule
def test_rigid_motion_gives_no_force_whatever_the_shape_at_rest(vectors: int, axial: int, bending: int) -> None:
    rest = _arc(vectors, 0.4, LENGTH)
    for nodal in (_straight(vectors, LENGTH), rest):
        family = _family((vectors, axial, bending), rest=[nodal], eta=ETA)
        for seed in range(3):
            rng = np.random.default_rng(seed)
            turn, first = np.exp(1j * rng.uniform(-np.pi, np.pi)), complex(*rng.normal(size=2))
            at = np.array(nodal) * turn
            at[[0, vectors // 2]] += first
            swing = 1j * at
            z = _pairs(at)
            force, power = _force(family, z, _pairs(swing))
            assert np.abs(force).max() < 2e-13 * EA
            assert power < 1e-20 * EA
            assert _energy(family, z) < 1e-25 * EA
            for viscous in (False, True):
                matrix = _matrix(family, z, viscous=viscous)
                assert np.abs(matrix @ _pairs(swing)).max() < 1e-12 * np.abs(matrix).max()


@every_rule
@pytest.mark.parametrize("seed", range(3))
def test_force_and_tangent_are_derivatives(vectors: int, axial: int, bending: int, seed: int) -> None:
    family = _family((vectors, axial, bending), rest=[_arc(vectors, 0.8, LENGTH)])
    z = _bent(vectors, seed)
    force = _force(family, z)[0]
    gradient = doors.differences(lambda at: _energy(family, at), z, 1e-3)
    np.testing.assert_allclose(force, -gradient, rtol=0, atol=1e-7 * np.abs(force).max())
    tangent = _matrix(family, z)
    np.testing.assert_array_equal(tangent, tangent.T)
    slope = doors.differences(lambda at: _force(family, at)[0], z, 1e-3)
    np.testing.assert_allclose(tangent, -slope, rtol=0, atol=1e-7 * np.abs(tangent).max())
    # Inner forces: no resultant, no moment.
    order = vectors // 2
    f, at = (values[0::2] + 1j * values[1::2] for values in (force, z))
    assert abs(f[0] + f[order]) < 1e-13 * np.abs(force).max()
    assert abs(np.imag(np.conj(at) * f).sum()) < 1e-12 * np.abs(force).max()


@pytest.mark.slow
@every_rule
@pytest.mark.parametrize("seed", range(3))
def test_damping_takes_the_power_of_its_matrix(vectors: int, axial: int, bending: int, seed: int) -> None:
    rest = [_arc(vectors, 0.8, LENGTH)]
    rule = (vectors, axial, bending)
    family, z = _family(rule, rest=rest, eta=ETA), _bent(vectors, seed)
    v = np.random.default_rng(100 + seed).normal(size=z.size)
    matrix = _matrix(family, z, viscous=True)
    np.testing.assert_array_equal(matrix, matrix.T)
    assert np.linalg.eigvalsh(matrix).min() > -1e-12 * np.abs(matrix).max()
    force, power = _force(family, z, v)
    assert power == pytest.approx(v @ matrix @ v, rel=1e-12)
    elastic = _force(_family(rule, rest=rest), z)[0]
    np.testing.assert_allclose(force, elastic - matrix @ v, rtol=0, atol=1e-12 * np.abs(matrix @ v).max())
    # Small motions about the unloaded shape: the damping matrix is eta times the stiffness.
    at = _pairs(rest[0])
    stiffness = _matrix(family, at)
    np.testing.assert_allclose(
        _matrix(family, at, viscous=True), ETA * stiffness, rtol=0, atol=1e-12 * ETA * np.abs(stiffness).max()
    )


@pytest.mark.slow
@orders
def test_lanes_equal_singles(vectors: int) -> None:
    width, rule = len(WIDE), (vectors, 5, 3 if vectors == CUBIC else 5)
    side = 2 * vectors
    rng = np.random.default_rng(3)
    states = np.array([_bent(vectors, seed) for seed in range(width)]).T
    rates = rng.normal(size=states.shape)
    elastic, damped = _family(rule, lanes=width), _family(rule, lanes=width, eta=ETA)
    for wide, single in ((elastic, _family(rule)), (damped, _family(rule, eta=ETA))):
        forces, power, energy = np.zeros(side * width), np.zeros(width), np.zeros(width)
        work = np.zeros(ELEMENT_ROOM)
        doors.force(WIDE, wide, states.ravel(), rates.ravel(), forces, work, power)
        doors.energy(WIDE, wide, states.ravel(), work, energy)
        blocks = np.zeros(side * side * width)
        doors.matrix(WIDE, wide, wide.damped, states.ravel(), work, blocks)
        for lane in range(width):
            z, v = states[:, lane].copy(), rates[:, lane].copy()
            force, lost = _force(single, z, v)
            np.testing.assert_allclose(forces[lane::width], force, rtol=0, atol=1e-13 * np.abs(force).max())
            assert power[lane] == pytest.approx(lost, rel=1e-12)
            assert energy[lane] == pytest.approx(_energy(single, z), rel=1e-12)
            matrix = _matrix(single, z, viscous=single.damped)
            np.testing.assert_allclose(
                blocks[lane::width].reshape(side, side), matrix, rtol=0, atol=1e-13 * np.abs(matrix).max()
            )


@orders
def test_a_straight_rod_bent_into_a_quarter_circle_stores_the_energy_of_its_curvature(vectors: int) -> None:
    """U = 1/2 EI kappa^2 pi R/2 with kappa = 1/R: pi EI/(4 R)."""
    radius = 0.5
    expected = np.pi * EI / (4 * radius)
    errors = []
    for elements in (2, 4):
        length = np.pi * radius / 2 / elements
        family = _family(
            (vectors, 5, 3 if vectors == CUBIC else 5), elements=elements, length=length, axial=EI / radius**2
        )
        z = np.concatenate(
            [_pairs(_arc(vectors, radius, length, n * length)[: vectors // 2]) for n in range(elements + 1)]
        )
        errors.append(abs(_energy(family, z) / expected - 1))
    assert errors[1] < (1e-4 if vectors == CUBIC else 1e-9)
    assert np.log2(errors[0] / errors[1]) > (3.8 if vectors == CUBIC else 7.5)


@every_rule
def test_a_pre_curved_rod_is_free_of_stress(vectors: int, axial: int, bending: int) -> None:
    """Even where the interpolated shape is not parameterised by its arc length: one element for a third of a circle."""
    radius, length = 0.4, 0.4 * 2 * np.pi / 3
    rest = _arc(vectors, radius, length)
    family, z = _family((vectors, axial, bending), rest=[rest], length=length), _pairs(rest)
    assert np.abs(_force(family, z)[0]).max() < 1e-13 * EA


@pytest.mark.parametrize(
    ("rule", "elements", "modes"),
    [((CUBIC, 3, 3), 1, 3), ((QUINTIC, 5, 5), 1, 3), ((QUINTIC, 4, 4), 2, 3), ((QUINTIC, 4, 4), 1, 4)],
)
def test_only_rigid_motions_are_free_where_the_rule_is_recommended(
    rule: tuple[int, int, int], elements: int, modes: int
) -> None:
    family = _family(rule, elements=elements)
    z = np.zeros(rule[0] * (elements + 1)).reshape(elements + 1, -1)
    z[:, 0], z[:, 2] = LENGTH * np.arange(elements + 1), 1.0
    stiffness = np.abs(np.linalg.eigvalsh(_matrix(family, z.ravel())))
    assert np.count_nonzero(stiffness < 1e-10 * stiffness.max()) == modes
    if rule[0] == QUINTIC:
        recommended = np.array_equal(quintic.recommended(elements), beam.quadrature(*rule))
        assert recommended == (modes == 3)


# Large deflections. A rod clamped along x bends under a transverse force P at its end. With s0 the length
# at rest EI theta'' = -(1 + eps) t x F, EA eps = t.F, and the strains of this file are the only approximation.
SPAN, THICKNESS, YOUNG = 2.0, 0.1, 2.07e11
STIFF_AXIAL, STIFF_BENDING = YOUNG * THICKNESS**2, YOUNG * THICKNESS**4 / 12
LOAD = 3 * STIFF_BENDING / SPAN**2


def _elastica(axial: float, bending: float, load: float) -> Any:
    """theta, theta', x, y over s0 of the rod by shooting; the load pulls downwards."""

    def rate(_s: float, y: Any) -> list[float]:
        stretch = 1 - load * np.sin(y[0]) / axial
        return [y[1], stretch * np.cos(y[0]) * load / bending, stretch * np.cos(y[0]), stretch * np.sin(y[0])]

    def shoot(curvature: float) -> Any:
        start = [0.0, curvature, 0.0, 0.0]
        return solve_ivp(rate, (0, SPAN), start, "DOP853", rtol=1e-12, atol=1e-13, dense_output=True)

    root = brentq(lambda curvature: shoot(curvature).y[1, -1], -1.2 * load * SPAN / bending, 0.0, xtol=1e-13)
    return shoot(root).sol


def _tip(rule: tuple[int, int, int], elements: int, axial: float, bending: float, load: float, shape: Any) -> Any:
    """Displacement of the end by Newton's method from the nodes of `shape`; r and the direction of r' are held."""
    vectors, length = rule[0], SPAN / elements
    family = _family(rule, elements=elements, length=length, axial=axial, bending=bending)
    nodal = []
    for s in np.linspace(0, SPAN, elements + 1):
        theta, curvature, x, y = shape(s)
        turn = np.exp(1j * theta)
        nodal += [x + 1j * y, turn, 1j * curvature * turn][: vectors // 2]
    z = _pairs(nodal)
    free = np.setdiff1d(np.arange(z.size), [0, 1, 3])
    for _ in range(20):
        residual = _force(family, z)[0]
        residual[vectors * elements + 1] -= load
        step = np.linalg.solve(_matrix(family, z)[np.ix_(free, free)], residual[free])
        z[free] += step
        if np.abs(step).max() < 1e-10:
            return z[vectors * elements : vectors * elements + 2] - [SPAN, 0]
    raise AssertionError("Newton's method did not converge")


@pytest.mark.parametrize(
    ("rule", "meshes", "error", "slope"),
    [
        ((CUBIC, 5, 3), (8, 16), 2e-6, 4.5),
        ((QUINTIC, 5, 5), (2, 4), 1e-7, 7.5),
        ((QUINTIC, 4, 4), (2, 4), 2e-7, 7.0),
    ],
)
def test_a_cantilever_converges_to_the_extensible_elastica(
    rule: tuple[int, int, int], meshes: tuple[int, int], error: float, slope: float
) -> None:
    shape = _elastica(STIFF_AXIAL, STIFF_BENDING, LOAD)
    exact = shape(SPAN)[2:] - [SPAN, 0]
    np.testing.assert_allclose(exact, [-0.508537304, -1.207239855], atol=2e-9)  # published for cable elements
    errors = [np.linalg.norm(_tip(rule, n, STIFF_AXIAL, STIFF_BENDING, LOAD, shape) - exact) for n in meshes]
    assert errors[1] < error
    assert np.log2(errors[0] / errors[1]) > slope


def test_a_slender_cantilever_bends_as_elliptic_integrals_say() -> None:
    """Frisch-Fay 1962, inextensible: sqrt(P L^2/EI) = K(k) - F(phi, k) with sin(phi) = 1/(k sqrt 2)."""
    load = 3.0  # in EI/L^2

    def excess(k: float) -> float:
        return float(ellipk(k**2) - ellipkinc(np.arcsin(1 / (k * np.sqrt(2))), k**2) - np.sqrt(load))

    k = brentq(excess, 1 / np.sqrt(2) + 1e-12, 1 - 1e-12, xtol=1e-15)
    reach = np.sqrt(2 * (2 * k**2 - 1) / load)  # x of the end over L: sqrt(2 sin(theta_L) EI/(P L^2))
    bending = 1.0
    axial = bending * 12 * (2000 / SPAN) ** 2  # a section of 1/2000 of the length
    force = load * bending / SPAN**2
    shape = _elastica(axial, bending, force)
    tip = _tip((QUINTIC, 5, 5), 8, axial, bending, force, shape)
    assert (SPAN + tip[0]) / SPAN == pytest.approx(reach, abs=2e-7)
