"""Straight elements in space: closed forms of the energy, its derivatives, and what the plane's elements give."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import element_doors as doors
import numpy as np
import pytest
from shoal.mechanics.dynamics import ELEMENT_ROOM
from shoal.mechanics.elements import beam, cubic, families, quintic
from shoal.mechanics.elements.strain import STRAIGHT
from shoal.mechanics.numerics.tile import SINGLE, WIDE, packed

EA, EI, LENGTH, ETA = 1.6e5, 5.3, 0.5, 2e-3
Family = Any
CASES: dict[str, tuple[Family, int, Any, int]] = {
    "cubic, full": (cubic.SpatialCubics, cubic.FULL, cubic.FULL_RULE, beam.CUBIC),
    "cubic, reduced": (cubic.SpatialCubics, cubic.REDUCED, cubic.REDUCED_RULE, beam.CUBIC),
    "cubic, damped": (cubic.SpatialCubics, cubic.DAMPED, cubic.FULL_RULE, beam.CUBIC),
    "quintic, four": (
        quintic.SpatialQuintics,
        quintic.FOUR,
        beam.quadrature(beam.QUINTIC, 4, 4),
        beam.QUINTIC,
    ),
    "quintic, four, damped": (
        quintic.SpatialQuintics,
        quintic.FOUR_DAMPED,
        beam.quadrature(beam.QUINTIC, 4, 4),
        beam.QUINTIC,
    ),
    "quintic, five": (
        quintic.SpatialQuintics,
        quintic.FIVE,
        beam.quadrature(beam.QUINTIC, 5, 5),
        beam.QUINTIC,
    ),
    "quintic, five, damped": (
        quintic.SpatialQuintics,
        quintic.FIVE_DAMPED,
        beam.quadrature(beam.QUINTIC, 5, 5),
        beam.QUINTIC,
    ),
}
PLANE: dict[str, tuple[Family, int]] = {
    "cubic, full": (cubic.Cubics, cubic.FULL),
    "cubic, reduced": (cubic.Cubics, cubic.REDUCED),
    "cubic, damped": (cubic.Cubics, cubic.DAMPED),
    "quintic, four": (quintic.Quintics, quintic.FOUR),
    "quintic, four, damped": (quintic.Quintics, quintic.FOUR_DAMPED),
    "quintic, five": (quintic.Quintics, quintic.FIVE),
    "quintic, five, damped": (quintic.Quintics, quintic.FIVE_DAMPED),
}


def cases(wanted: Callable[[str], bool] = lambda case: True) -> Any:
    """Of these cases; the kernels of the quintic take half a minute to compile."""
    chosen = filter(wanted, CASES)
    return pytest.mark.parametrize(
        "case", [pytest.param(case, marks=[pytest.mark.slow] * case.startswith("quintic")) for case in chosen]
    )


every, damped = cases(), cases(lambda case: "damped" in case)


def _elements(case: str, *, lanes: int = 1, count: int = 1, dimensions: int = 3) -> Any:
    """So many elements side by side, none of which shares a node with another."""
    family, variant, rule, vectors = CASES[case]
    reference: list[Any] = []
    if dimensions == 2:
        family, variant = PLANE[case]
        along, none = np.array([1.0, 0.0]), np.zeros(2)
        nodal = [none, along, none][: vectors // 2] + [LENGTH * along, along, none][: vectors // 2]
        reference = beam.reference(vectors, rule, nodal, LENGTH)
    found, side = families.Collected(), dimensions * vectors
    for number in range(count):
        numbers = [1 / LENGTH, EA * LENGTH, EI / LENGTH, ETA]
        entry = families.Entry(rule, variant, "damped" in case, numbers, reference)
        found.add("rod", [*range(side * number, side * (number + 1))], entry)
    return packed(found.family(family), slice(0, lanes), (0,) * lanes)


def _bent(case: str, seed: int) -> Any:
    """The nodal vectors of a random element, stretched by some percent, bent by some tenths of a radian in space."""
    rng = np.random.default_rng(seed)
    order = CASES[case][3] // 2
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    nodes = []
    for node in range(2):
        place = np.array([LENGTH * node * (1 + rng.uniform(-0.05, 0.05)), 0.0, 0.0])
        slope = np.array([1.0, 0.0, 0.0]) + rng.uniform(-0.3, 0.3, 3) * [0.1, 1, 1]
        nodes.append([place, slope, rng.uniform(-0.5, 0.5, 3) / LENGTH][:order])
    vectors = np.array(nodes).reshape(-1, 3) @ turn.T
    vectors[[0, order]] += rng.normal(size=3)
    return vectors


def _force(case: str, z: Any, zdot: Any = None, power: Any = None) -> Any:
    f, dimensions = np.zeros(z.size), z.shape[1]
    rates = np.zeros(z.size) if zdot is None else zdot.ravel().copy()
    lost = np.zeros(1) if power is None else power
    elements = _elements(case, dimensions=dimensions)
    doors.force(SINGLE, elements, z.ravel().copy(), rates, f, np.zeros(ELEMENT_ROOM), lost)
    return f.reshape(z.shape)


def _energy(case: str, z: Any) -> float:
    energy, elements = np.zeros(1), _elements(case, dimensions=z.shape[1])
    doors.energy(SINGLE, elements, z.ravel().copy(), np.zeros(ELEMENT_ROOM), energy)
    return float(energy[0])


def _matrix(case: str, z: Any, *, viscous: bool = False) -> Any:
    out, elements = np.zeros(z.size**2), _elements(case, dimensions=z.shape[1])
    doors.matrix(SINGLE, elements, viscous, z.ravel().copy(), np.zeros(ELEMENT_ROOM), out)
    return out.reshape(z.size, z.size)


def _columns(function: Any, z: Any, h: float) -> Any:
    """Central differences of a function of the nodal vectors, one column for each number of z."""
    units = h * np.eye(z.size).reshape(-1, *z.shape)
    return np.array([(np.ravel(function(z + unit)) - np.ravel(function(z - unit))) / (2 * h) for unit in units]).T


@pytest.mark.slow
@every
@pytest.mark.parametrize("seed", range(3))
def test_force_and_tangent_are_derivatives_of_the_energy(case: str, seed: int) -> None:
    z = _bent(case, seed)
    force, tangent = _force(case, z), _matrix(case, z)
    gradient = _columns(lambda state: _energy(case, state), z, 1e-5).reshape(z.shape)
    np.testing.assert_allclose(force, -gradient, atol=1e-7 * np.abs(force).max())
    np.testing.assert_allclose(tangent, tangent.T, atol=1e-12 * np.abs(tangent).max())
    differences = _columns(lambda state: _force(case, state), z, 1e-6)
    np.testing.assert_allclose(tangent, -differences, atol=1e-8 * np.abs(tangent).max())
    # Inner forces have no resultant and no moment.
    assert np.abs(force[0] + force[len(z) // 2]).max() < 1e-12 * np.abs(force).max()
    assert np.abs(np.cross(z, force).sum(axis=0)).max() < 1e-11 * np.abs(force).max()


@every
@pytest.mark.parametrize("seed", range(3))
def test_a_rotation_turns_the_force_and_leaves_the_energy(case: str, seed: int) -> None:
    rng = np.random.default_rng(100 + seed)
    z, zdot = _bent(case, seed), rng.normal(size=_bent(case, seed).shape)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    assert _energy(case, z @ turn.T) == pytest.approx(_energy(case, z), rel=1e-12)
    force = _force(case, z, zdot)
    np.testing.assert_allclose(
        _force(case, z @ turn.T, zdot @ turn.T), force @ turn.T, atol=1e-11 * np.abs(force).max()
    )


@every
@pytest.mark.parametrize("seed", range(3))
def test_a_rod_that_stays_in_a_plane_has_the_forces_of_the_plane(case: str, seed: int) -> None:
    rng = np.random.default_rng(200 + seed)
    plane = _bent(case, seed)[:, :2]  # the shadow of a random element is one too, shorter
    slopes = [1, len(plane) // 2 + 1]
    plane[slopes] /= np.linalg.norm(plane[slopes], axis=1)[:, None]
    plane[len(plane) // 2] = plane[0] + LENGTH * plane[slopes].mean(axis=0)
    rates = rng.normal(size=plane.shape)
    frame = np.linalg.qr(rng.normal(size=(3, 3)))[0][:, :2]
    lost, lost_in_space = np.zeros(1), np.zeros(1)
    expected = _force(case, plane, rates, lost) @ frame.T
    force = _force(case, plane @ frame.T, rates @ frame.T, lost_in_space)
    np.testing.assert_allclose(force, expected, atol=1e-12 * np.abs(expected).max())
    assert lost_in_space[0] == pytest.approx(lost[0], rel=1e-10)
    assert _energy(case, plane @ frame.T) == pytest.approx(_energy(case, plane), rel=1e-11)
    both = np.kron(np.eye(len(plane)), frame)
    for viscous in (False, *([True] if "damped" in case else [])):
        flat = _matrix(case, plane, viscous=viscous)
        within = both.T @ _matrix(case, plane @ frame.T, viscous=viscous) @ both
        np.testing.assert_allclose(within, flat, atol=1e-11 * np.abs(flat).max())


@damped
@pytest.mark.parametrize("seed", range(3))
def test_damping_loses_what_its_force_takes_and_nothing_in_a_rigid_motion(case: str, seed: int) -> None:
    rng = np.random.default_rng(300 + seed)
    z = _bent(case, seed)
    zdot, lost = rng.normal(size=z.shape), np.zeros(1)
    viscous = _force(case, z, zdot, lost) - _force(case, z)
    assert lost[0] > 0
    assert lost[0] == pytest.approx(-np.sum(viscous * zdot), rel=1e-10)
    matrix = _matrix(case, z, viscous=True)
    np.testing.assert_allclose(-(matrix @ zdot.ravel()).reshape(z.shape), viscous, atol=1e-10 * np.abs(viscous).max())
    spin, bending = np.cross(rng.normal(size=3), z), lost[0]
    size = np.abs(_force(case, z, zdot) - _force(case, z)).max()
    lost[0] = 0.0
    assert np.abs(_force(case, z, spin, lost) - _force(case, z)).max() < 1e-11 * size
    # A turn that is far from straight still has the share of its plane that a straight one resists.
    assert abs(lost[0]) < STRAIGHT * bending


@pytest.mark.slow
@every
def test_lanes_and_neighbours_equal_singles(case: str) -> None:
    width, vectors = len(WIDE), CASES[case][3]
    side = 3 * vectors
    rng = np.random.default_rng(5)
    states, rates = np.array([_bent(case, seed).ravel() for seed in range(width)]), rng.normal(size=(width, side))
    singles = np.array(
        [_force(case, z.reshape(-1, 3), v.reshape(-1, 3)).ravel() for z, v in zip(states, rates, strict=True)]
    )
    tangents = np.array([_matrix(case, z.reshape(-1, 3)).ravel() for z in states])
    wide, matrices = np.zeros((side, width)), np.zeros((side**2, width))
    lanes, room = _elements(case, lanes=width), np.zeros(ELEMENT_ROOM)
    at = np.ascontiguousarray(states.T).ravel(), np.ascontiguousarray(rates.T).ravel()
    doors.force(WIDE, lanes, *at, wide.reshape(-1), room, np.zeros(width))
    doors.matrix(WIDE, lanes, False, at[0], room, matrices.reshape(-1))
    many, blocks = np.zeros(side * width), np.zeros(side**2 * width)
    neighbours, room = _elements(case, count=width), np.zeros(ELEMENT_ROOM)
    doors.force(SINGLE, neighbours, states.ravel(), rates.ravel(), many, room, np.zeros(1))
    doors.matrix(SINGLE, neighbours, False, states.ravel(), room, blocks)
    for found, expected in ((wide.T, singles), (many, singles), (matrices.T, tangents), (blocks, tangents)):
        np.testing.assert_allclose(found.reshape(expected.shape), expected, atol=1e-13 * np.abs(expected).max())


@cases(lambda case: "reduced" not in case)
def test_a_helix_has_its_energy_of_bending(case: str) -> None:
    """EI k^2/2 for each metre, of curvature k = a/(a^2 + b^2): the closer, the less an element turns."""
    errors = []
    for a, b in ((1.4, 0.8), (2.8, 1.6)):
        pace, nodes = np.hypot(a, b), []
        for s in (0.0, LENGTH / np.hypot(a, b)):
            place = np.array([a * np.cos(s), a * np.sin(s), b * s])
            slope = np.array([-a * np.sin(s), a * np.cos(s), b]) / pace
            nodes += [place, slope, np.array([-a * np.cos(s), -a * np.sin(s), 0.0]) / pace**2][: CASES[case][3] // 2]
        errors.append(abs(_energy(case, np.array(nodes)) / (EI * LENGTH * (a / pace**2) ** 2 / 2) - 1))
    assert errors[0] < 0.05
    assert errors[1] < errors[0] / 3.5
