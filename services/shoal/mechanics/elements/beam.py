"""Bernoulli-Euler elements of any order in R^d: cubic (r, r') or quintic (r, r', r''), straight or pre-curved, damped.

With S in [0, L] the material coordinate, r(S) the Hermite curve through the nodal vectors and r0(S) the
stress-free one, whose arc length is s0, the strain energy is 1/2 int EA eps^2 + EI |kappa - kappa0|^2 ds0,

    eps = |dr/ds0| - 1 = |r'|/|r0'| - 1,    kappa = (r' ^ r'')/(|r'|^2 |r0'|),

kappa the curvature as a bivector. In the plane it is one number, the rate of turn of the tangent (Gerstmayr and Shabana
2006, eqs. 15 to 17, for r0 straight), and r0 may be curved: kappa0 is the curvature of r0. In space it is the vector
r' x r'' over the same; bending has the same stiffness in all directions, twisting costs nothing, and r0 is straight, as
the plane of a stress-free curvature is not defined. Both strains vanish at r = r0 and under rigid motion, for any
parametrisation of r0. Kelvin-Voigt material: N = EA (eps + eta deps/dt), M = EI (kappa + eta dkappa/dt), in space with
the rate of the size of kappa (`strain.bend`).

Scaled by powers of L, the vectors X = ((r2 - r1)/L, r1', L r1'', ..., r2', L r2'', ...) give p = r' and
c = L r'' with coefficients that do not depend on the element; these are the quadrature table. With
k = (p ^ c)/|p|^2 a point of weight w on the unit interval contributes

    w/2 (EA L |p0| (|p|/|p0| - 1)^2 + EI/L |k - k0|^2/|p0|).

Coefficients of an element: 1/L [1/m], EA L [N m], EI/L [N m], eta [s]; reference, in the plane: 1/|r0'| and the angle
k0 = L theta0' of every point. `cubic` and `quintic` hold the families and their forces, each for both dimensions. Point
by point, as that of the quintic element, the force of the cubic one takes 8 % more time in sixteen lanes and 2 % more
alone. `beam_table` has stiffness and damping of both, and the energy of the quintic one.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from shoal.errors import InputError
from shoal.mechanics import plane
from shoal.mechanics.elements.element import Element
from shoal.mechanics.elements.families import Entry
from shoal.mechanics.numerics.tile import Array, Number
from shoal.scene import Rod
from shoal.scene.sections import Section

CUBIC = 4
QUINTIC = 6

# Hermite polynomials on the unit interval, coefficients of 1, x, x^2, ...; the nodal vectors of the first
# node in increasing order of differentiation, then those of the second.
HERMITE = {
    CUBIC: np.array([[1, 0, -3, 2], [0, 1, -2, 1], [0, 0, 3, -2], [0, 0, -1, 1]], dtype=float),
    QUINTIC: np.array(
        [
            [1, 0, 0, -10, 15, -6],
            [0, 1, 0, -6, 8, -3],
            [0, 0, 0.5, -1.5, 1.5, -0.5],
            [0, 0, 0, 10, -15, 6],
            [0, 0, 0, -4, 7, -3],
            [0, 0, 0, 0.5, -1, 0.5],
        ]
    ),
}

COEFFICIENTS = 4


def quadrature(vectors: int, axial: int, bending: int) -> Array:
    """Return Gauss rules with these numbers of points for axial and bending strain; equal rules share their points.

    Returns (points, 2 vectors): the coefficients of p and of c in X, the weight of eps, the weight of kappa.
    """
    x, weights = _gauss(axial)
    if axial == bending:
        return _table(vectors, x, weights, weights)
    return _joined(vectors, (x, weights), _gauss(bending))


def lobatto(vectors: int, bending: int) -> Array:
    """The same with the three points of Lobatto's rule for the axial strain, two of which are the nodes."""
    return _joined(vectors, (np.array([0.0, 0.5, 1.0]), np.array([1.0, 4.0, 1.0]) / 6), _gauss(bending))


def _joined(vectors: int, axial: tuple[Array, Array], bending: tuple[Array, Array]) -> Array:
    (x, weights), (y, others) = axial, bending
    return np.concatenate([_table(vectors, x, weights, 0 * weights), _table(vectors, y, 0 * others, others)])


def _gauss(points: int) -> tuple[Array, Array]:
    x, weights = np.polynomial.legendre.leggauss(points)
    return (x + 1) / 2, weights / 2


def _table(vectors: int, points: Array, axial: Array, bending: Array) -> Array:
    order = vectors // 2
    kept = [order, *range(1, order), *range(order + 1, vectors)]  # the shape of r1' is minus that of r2'
    slope, curve = (np.array(shape(vectors, points, 1.0, n))[kept] for n in (1, 2))
    return np.ascontiguousarray(np.vstack([slope, curve, axial, bending]).T)


def shape(vectors: int, x: Number, length: Number, derivative: int) -> list[Number]:
    """Shape functions of the derivative of r in S, at the fraction x."""
    shapes = []
    for number, polynomial in enumerate(HERMITE[vectors]):
        value: Number = 0.0
        for coefficient in np.polynomial.polynomial.polyder(polynomial, derivative)[::-1]:
            value = value * x + coefficient
        shapes.append(value * length ** float(number % (vectors // 2) - derivative) + 0.0 * x)
    return shapes


def pairs(points: Array, weights: Array) -> Array:
    """The pairs +-xi of a rule on [-1, 1], xi = 0 in the middle where it has one: (xi, weight, number of -xi, of +xi).

    Weights are those of the unit interval. The last row is the middle, of weight zero in a rule without one.
    """
    last = len(points) - 1
    pairs = [(points[last - k], weights[last - k] / 2, k, last - k) for k in range(len(points) // 2)]
    return np.array([*pairs, (0.0, weights[last // 2] / 2 if last % 2 == 0 else 0.0, last // 2, last // 2)])


def _products(vectors: int, derivative: int) -> Array:
    """int_0^1 S S' dx of derivatives of the shape functions, exactly: S S' has degree 2 vectors - 2 at most."""
    x, weights = _gauss(vectors)
    shapes = np.array(shape(vectors, x, 1.0, derivative))
    products = (shapes * weights) @ shapes.T
    return np.asarray((products + products.T) / 2)


_UNIT_MASS = {vectors: _products(vectors, 0) for vectors in HERMITE}
_UNIT_STRETCHING = {vectors: _products(vectors, 1) for vectors in HERMITE}


def mass_matrix(vectors: int, mass_per_length: Number, length: Number) -> list[list[Number]]:
    """Consistent mass [kg, kg m, kg m^2, ...] on the nodal vectors, the same for x and y."""
    return _on_nodes(_UNIT_MASS[vectors], mass_per_length * length, length)


def stretching(vectors: int, axial: Number, length: Number) -> list[list[Number]]:
    """EA int dS/ds dS'/ds ds [N/m, N, N m, ...] on the nodal vectors: their stiffness along a straight rod."""
    return _on_nodes(_UNIT_STRETCHING[vectors], axial / length, length)


def _on_nodes(unit: Array, factor: Number, length: Number) -> list[list[Number]]:
    order = len(unit) // 2
    return [
        [factor * length ** float(i % order + j % order) * value for j, value in enumerate(row)]
        for i, row in enumerate(unit)
    ]


def padded(factors: list[Any]) -> list[Any]:
    """Those of the cubic element's vectors, where each node has one vector more that takes no part."""
    return [*factors[:2], 0.0, *factors[2:], 0.0]


def weight(vectors: int, mass_per_length: Number, length: Number) -> list[Number]:
    """Consistent load of a unit acceleration [kg, kg m, ...] on the nodal vectors."""
    matrix, order = mass_matrix(vectors, mass_per_length, length), vectors // 2
    return [row[0] + row[order] for row in matrix]


def reference(vectors: int, rule: Array, nodal: list[Number], length: Number) -> list[Number]:
    """The stress-free shape at the points of a rule, 1/|r0'| and L theta0'; nodal: its nodal vectors, (2, ...)."""
    order = vectors // 2
    scaled = [(nodal[order] - nodal[0]) / length]
    scaled += [nodal[first + j] * length ** float(j - 1) for first in (0, order) for j in range(1, order)]
    found: list[Number] = []
    for row in rule:
        px, py = sum(a * v for a, v in zip(row[: vectors - 1], scaled, strict=True))
        cx, cy = sum(a * v for a, v in zip(row[vectors - 1 : -2], scaled, strict=True))
        square = px**2 + py**2
        found += [1.0 / np.sqrt(square), (px * cy - py * cx) / square]
    return found


def element(
    vectors: int,
    family: type,
    space: tuple[int, ...],
    part: Callable[[Rod, Section, Number, list[Number]], Entry],
) -> Element:
    """A beam element as `Element` states it; space: a tuple as long as its nodal vectors."""

    def nodal_vectors(rod: Rod, s: Number) -> list[Number]:
        return [_padded(vector(rod, s), space) for vector in (tangent, _normal)[: vectors // 2 - 1]]

    return Element(
        family=family,
        nodal_vectors=nodal_vectors,
        position_shape=lambda x, y, length: shape(vectors, x, length, 0),
        direction_shape=lambda x, y, length: shape(vectors, x, length, 1),
        mass=lambda density, section, length: mass_matrix(vectors, density * section.area, length),
        weight=lambda line, length: weight(vectors, line, length),
        part=part,
        stretching=lambda axial, length: stretching(vectors, axial, length),
    )


def part(
    vectors: int,
    rule: Array,
    variant: int,
    rod: Rod,
    section: Section,
    length: Number,
    nodal: list[Number],
) -> Entry:
    """One element of a rod with this rule; nodal: its nodal vectors at rest, (d, ...).

    Raises InputError for a curved one in space.
    """
    flat = len(nodal[0]) == plane.DIMENSIONS
    if rod.curvature and not flat:
        raise InputError(f"curvature: an {rod.element} is straight in space")
    axial, bending = rod.modulus * section.area, rod.modulus * section.bending
    numbers = [1.0 / length, axial * length, bending / length, rod.retardation + 0.0 * length]
    free = reference(vectors, rule, nodal, length) if flat else []
    return Entry(rule, variant, bool(np.any(rod.retardation)), numbers, free)


def tangent(rod: Rod, s: Number) -> Number:
    """Unit vector along the unstrained rod at the arc length s [m], along its own frame, (2, ...)."""
    return plane.vector(*(plane.unit(rod.turn(s)) if rod.curvature else (1.0 + 0.0 * s, 0.0)))


def _normal(rod: Rod, s: Number) -> Number:
    """The second derivative of the unstrained rod by the arc length [1/m], (2, ...)."""
    return (sum(k * s**power for power, k in enumerate(rod.curvature)) + 0.0 * s) * plane.quarter(tangent(rod, s))


def _padded(vector: Number, space: tuple[int, ...]) -> Number:
    """A vector of the plane z = 0."""
    return np.concatenate([vector, 0.0 * vector[:1]])[: len(space)]
