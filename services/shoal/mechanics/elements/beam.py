"""Planar Bernoulli-Euler elements of any order: cubic (r, r') or quintic (r, r', r''), straight or pre-curved, damped.

With S in [0, L] the material coordinate, r(S) the Hermite curve through the nodal vectors and r0(S) the
stress-free one, whose arc length is s0, the strain energy is 1/2 int EA eps^2 + EI kappa^2 ds0,

    eps = |dr/ds0| - 1 = |r'|/|r0'| - 1,    kappa = d(theta - theta0)/ds0 = (theta' - theta0')/|r0'|,

theta' = (r' x r'')/|r'|^2 the rate of turn of the tangent (Gerstmayr and Shabana 2006, eqs. 15 to 17, for
r0 straight). Both vanish at r = r0 and under rigid motion whatever the parametrisation of r0 is.
Kelvin-Voigt material: N = EA (eps + eta deps/dt), M = EI (kappa + eta dkappa/dt).

Scaled by powers of L, the vectors X = ((r2 - r1)/L, r1', L r1'', ..., r2', L r2'', ...) give p = r' and
c = L r'' with coefficients that do not depend on the element; these are the quadrature table. With
k = (p x c)/|p|^2 = L theta' a point of weight w on the unit interval contributes

    w/2 (EA L |p0| (|p|/|p0| - 1)^2 + EI/L (k - k0)^2/|p0|).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from shoal.mechanics.assembly.affine import Number
from shoal.mechanics.numerics.tile import Array, Index, Tile
from shoal.mechanics.numerics.vector import pointer

CUBIC = 4
QUINTIC = 6

# Hermite polynomials on the unit interval, coefficients of 1, x, x^2, ...; the nodal vectors of the first
# node in increasing order of differentiation, then those of the second.
_HERMITE = {
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

# Rows of the work space: scaled vectors, their rates, forces on them, second derivatives in (p, c).
_X = 0
_RATE = 10
_FORCE = 20
_HESSIAN = 30


class Beams(NamedTuple):
    """Elements with the same number of nodal vectors and the same quadrature.

    rows: 2 vectors numbers per element, x and y of each nodal vector, first node first.
    coefficients: 1/L [1/m], EA L [N m], EI/L [N m], eta [s] per element, (4 size, lanes).
    reference: 1/|r0'| and the angle k0 = L theta0' per element and point, (2 points size, lanes).
    damped: whether any eta differs from zero; otherwise rates are not looked at.
    table: of `quadrature`, (points, 2 vectors).
    """

    size: int
    vectors: int
    damped: bool
    points: int
    table: Array
    rows: Index
    coefficients: Array
    reference: Array


def quadrature(vectors: int, axial: int, bending: int) -> Array:
    """Gauss rules with so many points for the axial and the bending strain; equal rules share their points.

    Returns (points, 2 vectors): the coefficients of p and of c in X, the weight of eps, the weight of kappa.
    """
    x, weights = _gauss(axial)
    if axial == bending:
        return _table(vectors, x, weights, weights)
    y, others = _gauss(bending)
    return np.concatenate([_table(vectors, x, weights, 0 * weights), _table(vectors, y, 0 * others, others)])


def _gauss(points: int) -> tuple[Array, Array]:
    x, weights = np.polynomial.legendre.leggauss(points)
    return (x + 1) / 2, weights / 2


def _table(vectors: int, points: Array, axial: Array, bending: Array) -> Array:
    order = vectors // 2
    kept = [order, *range(1, order), *range(order + 1, vectors)]  # the shape of r1' is minus that of r2'
    slope, curve = (np.array(_shape(vectors, points, 1.0, n))[kept] for n in (1, 2))
    return np.ascontiguousarray(np.vstack([slope, curve, axial, bending]).T)


def _shape(vectors: int, x: Number, length: Number, derivative: int) -> list[Number]:
    """Shape functions of the derivative of r in S, at the fraction x."""
    shapes = []
    for number, polynomial in enumerate(_HERMITE[vectors]):
        value: Number = 0.0
        for coefficient in np.polynomial.polynomial.polyder(polynomial, derivative)[::-1]:
            value = value * x + coefficient
        shapes.append(value * length ** float(number % (vectors // 2) - derivative) + 0.0 * x)
    return shapes


def recommended(vectors: int, elements: int) -> Array:
    """The rule with the least error on coarse meshes, for a rod of so many elements.

    Four points do not see the stretch r' = P_4 of a quintic. Neighbours, which share r' and r'', forbid it;
    a rod of one quintic element needs a fifth point.
    """
    points = 3 if vectors == CUBIC else 4 if elements > 1 else 5
    return quadrature(vectors, points, points)


def _unit_masses(vectors: int) -> Array:
    """int_0^1 S S' dx, exactly: the product of the shape functions has degree 2 vectors - 2."""
    x, weights = _gauss(vectors)
    shape = np.array(_shape(vectors, x, 1.0, 0))
    masses = (shape * weights) @ shape.T
    return np.asarray((masses + masses.T) / 2)


_UNIT_MASS = {vectors: _unit_masses(vectors) for vectors in _HERMITE}


def mass_matrix(vectors: int, mass_per_length: Number, length: Number) -> list[list[Number]]:
    """Consistent mass [kg, kg m, kg m^2, ...] on the nodal vectors, the same for x and y."""
    order, mass = vectors // 2, mass_per_length * length
    return [
        [mass * length ** float(i % order + j % order) * unit for j, unit in enumerate(row)]
        for i, row in enumerate(_UNIT_MASS[vectors])
    ]


def weight(vectors: int, mass_per_length: Number, length: Number) -> list[Number]:
    """Consistent load of a unit acceleration [kg, kg m, ...] on the nodal vectors."""
    matrix, order = mass_matrix(vectors, mass_per_length, length), vectors // 2
    return [row[0] + row[order] for row in matrix]


def position_shape(vectors: int, x: Number, length: Number) -> list[Number]:
    """Shape functions of r at the fraction x of the element [1, m, m^2]."""
    return _shape(vectors, x, length, 0)


def slope_shape(vectors: int, x: Number, length: Number) -> list[Number]:
    """Shape functions of r' at the fraction x of the element [1/m, 1, m]."""
    return _shape(vectors, x, length, 1)


def curve_shape(vectors: int, x: Number, length: Number) -> list[Number]:
    """Shape functions of r'' at the fraction x of the element [1/m^2, 1/m, 1]."""
    return _shape(vectors, x, length, 2)


def coefficients(
    length: Number, axial_stiffness: Number, bending_stiffness: Number, retardation: Number
) -> list[Number]:
    """The four numbers of an element [1/m, N m, N m, s]."""
    return [1.0 / length, axial_stiffness * length, bending_stiffness / length, retardation]


def straight(vectors: int, length: Number) -> list[Number]:
    """Nodal vectors of an element at rest on the x axis, as complex numbers."""
    none = 0.0 * length
    order = vectors // 2
    return [*[none, 1.0 + none, none][:order], *[1.0 * length, 1.0 + none, none][:order]]


def _strain_angles(vectors: int, nodal: Any, x: Any, length: Number) -> tuple[Any, Any]:
    """|r'| and theta' [1/m] at the fractions x."""
    slope = sum(s * v for s, v in zip(slope_shape(vectors, x, length), nodal, strict=True))
    curve = sum(s * v for s, v in zip(curve_shape(vectors, x, length), nodal, strict=True))
    return np.abs(slope), np.imag(np.conj(slope) * curve) / np.abs(slope) ** 2


def reference(vectors: int, rule: Array, nodal: list[Number], length: Number) -> list[Number]:
    """The stress-free shape at the points of a rule, from its nodal vectors (complex): 1/|r0'|, L theta0' for each."""
    order = vectors // 2
    scaled = [(nodal[order] - nodal[0]) / length]
    scaled += [nodal[first + j] * length ** float(j - 1) for first in (0, order) for j in range(1, order)]
    found: list[Number] = []
    for row in rule:
        slope = sum(a * v for a, v in zip(row[: vectors - 1], scaled, strict=True))
        curve = sum(a * v for a, v in zip(row[vectors - 1 : -2], scaled, strict=True))
        found += [1.0 / np.abs(slope), np.imag(np.conj(slope) * curve) / np.abs(slope) ** 2]
    return found


def section_forces(
    nodal: npt.ArrayLike,
    rest: npt.ArrayLike,
    x: npt.ArrayLike,
    length: float,
    axial_stiffness: float,
    bending_stiffness: float,
    *,
    retardation: float = 0.0,
    rates: npt.ArrayLike | None = None,
) -> tuple[Array, Array]:
    """Normal force [N] and bending moment [N m] at the fractions x of an element.

    nodal, rest: nodal vectors of the present and of the stress-free shape, complex, (vectors,) or
    (vectors, times); x: (points,). rates: those of nodal, for the damping part. Returns two (points,)
    or (points, times). M > 0 turns the tangent counter-clockwise along the rod.
    """
    now = np.asarray(nodal, dtype=complex)
    vectors, many = len(now), now.ndim > 1
    at = np.asarray(x, dtype=float).reshape((-1, 1) if many else (-1,))
    ground = np.asarray(rest, dtype=complex).reshape((vectors, -1) if many else (vectors,))
    stretch0, turn0 = _strain_angles(vectors, ground, at, length)
    stretch, turn = _strain_angles(vectors, now, at, length)
    eps, kappa = stretch / stretch0 - 1.0, (turn - turn0) / stretch0
    if rates is not None:
        moving = np.asarray(rates, dtype=complex)
        slope, curve, slope_rate, curve_rate = (
            sum(s * v for s, v in zip(shape(vectors, at, length), values, strict=True))
            for values in (now, moving)
            for shape in (slope_shape, curve_shape)
        )
        stretch_rate = np.real(np.conj(slope) * slope_rate) / stretch
        # theta' = Im(r''/r'), so its rate is Im(dr''/r' - r'' dr'/r'^2).
        turn_rate = np.imag(curve_rate / slope - curve * slope_rate / slope**2)
        eps = eps + retardation * stretch_rate / stretch0
        kappa = kappa + retardation * turn_rate / stretch0
    return np.asarray(axial_stiffness * eps), np.asarray(bending_stiffness * kappa)


@njit(cache=True, error_model="numpy", forceinline=True)
def raw(family: Beams) -> Beams:
    """The same elements with pointers in place of arrays."""
    return Beams(
        family.size,
        family.vectors,
        family.damped,
        family.points,
        pointer(family.table),
        pointer(family.rows),
        pointer(family.coefficients),
        pointer(family.reference),
    )


# In the force, `vectors` and `damped` are constants where the functions below are called, so that the loops
# over vectors unroll and the loops over lanes become vector code.


@njit(cache=True, error_model="numpy", forceinline=True)
def _gather(tile: Tile, vectors: int, family: Beams, number: int, z: Array, w: Array, first: int) -> None:
    """The scaled vectors X of an element into rows of w from `first` on."""
    width = len(tile)
    order = vectors // 2
    base = COEFFICIENTS * number * width
    for component in range(2):
        at = 2 * vectors * number + component
        a, b = family.rows[at] * width, family.rows[at + vectors] * width
        to = (first + component) * width
        for lane in range(width):
            w[to + lane] = (z[b + lane] - z[a + lane]) * family.coefficients[base + lane]
        for node in range(2):
            for j in range(1, order):
                a = family.rows[at + 2 * (node * order + j)] * width
                to = (first + 2 * (node * (order - 1) + j) + component) * width
                if j == 1:
                    for lane in range(width):
                        w[to + lane] = z[a + lane]
                else:
                    for lane in range(width):
                        w[to + lane] = z[a + lane] / family.coefficients[base + lane]


@njit(cache=True, error_model="numpy", forceinline=True)
def _scatter(tile: Tile, vectors: int, family: Beams, number: int, w: Array, f: Array) -> None:
    """Subtract dU/dX, in the force rows of w, from the rows of f."""
    width = len(tile)
    order = vectors // 2
    base = COEFFICIENTS * number * width
    for component in range(2):
        at = 2 * vectors * number + component
        a, b = family.rows[at] * width, family.rows[at + vectors] * width
        source = (_FORCE + component) * width
        for lane in range(width):
            value = w[source + lane] * family.coefficients[base + lane]
            f[a + lane] += value
            f[b + lane] -= value
        for node in range(2):
            for j in range(1, order):
                a = family.rows[at + 2 * (node * order + j)] * width
                source = (_FORCE + 2 * (node * (order - 1) + j) + component) * width
                if j == 1:
                    for lane in range(width):
                        f[a + lane] -= w[source + lane]
                else:
                    for lane in range(width):
                        f[a + lane] -= w[source + lane] / family.coefficients[base + lane]


@njit(cache=True, error_model="numpy", forceinline=True, fastmath={"contract", "nsz", "arcp"})
def _force_points(tile: Tile, vectors: int, damped: bool, family: Beams, number: int, w: Array, power: Array) -> None:
    """Add dU/dX and the damping forces to the force rows of w."""
    width = len(tile)
    inner = vectors - 1
    base = COEFFICIENTS * number * width
    for g in range(family.points):
        at = 2 * vectors * g
        axial_weight, bending_weight = family.table[at + 2 * inner], family.table[at + 2 * inner + 1]
        rest = 2 * (number * family.points + g) * width
        for lane in range(width):
            px, py, cx, cy = 0.0, 0.0, 0.0, 0.0
            for k in range(inner):
                a, d = family.table[at + k], family.table[at + inner + k]
                x, y = w[(_X + 2 * k) * width + lane], w[(_X + 2 * k + 1) * width + lane]
                px, py, cx, cy = px + a * x, py + a * y, cx + d * x, cy + d * y
            shrink = 1.0 / np.sqrt(px * px + py * py)
            flat = shrink * shrink
            inverse = family.reference[rest + lane]
            k_ = (px * cy - py * cx) * flat
            ax, ay = cy - 2.0 * k_ * px, -cx - 2.0 * k_ * py  # |p|^2 dk/dp; |p|^2 dk/dc = (-py, px)
            axial = axial_weight * family.coefficients[base + width + lane]
            bending = bending_weight * family.coefficients[base + 2 * width + lane] * inverse
            strain = inverse - shrink  # eps/|p|
            angle = k_ - family.reference[rest + width + lane]
            if damped:
                eta = family.coefficients[base + 3 * width + lane]
                ux, uy, vx, vy = 0.0, 0.0, 0.0, 0.0
                for k in range(inner):
                    a, d = family.table[at + k], family.table[at + inner + k]
                    x, y = w[(_RATE + 2 * k) * width + lane], w[(_RATE + 2 * k + 1) * width + lane]
                    ux, uy, vx, vy = ux + a * x, uy + a * y, vx + d * x, vy + d * y
                stretch_rate = (px * ux + py * uy) * shrink
                angle_rate = (ax * ux + ay * uy - py * vx + px * vy) * flat
                strain += eta * inverse * stretch_rate * shrink
                angle += eta * angle_rate
                power[lane] += eta * (axial * inverse * stretch_rate**2 + bending * angle_rate**2)
            tension, moment = axial * strain, bending * angle * flat
            gx, gy = tension * px + moment * ax, tension * py + moment * ay
            hx, hy = -moment * py, moment * px
            for k in range(inner):
                a, d = family.table[at + k], family.table[at + inner + k]
                w[(_FORCE + 2 * k) * width + lane] += a * gx + d * hx
                w[(_FORCE + 2 * k + 1) * width + lane] += a * gy + d * hy


@njit(cache=True, error_model="numpy", forceinline=True)
def _add_force(
    tile: Tile, vectors: int, damped: bool, family: Beams, z: Array, zdot: Array, f: Array, w: Array, power: Array
) -> None:
    width = len(tile)
    for number in range(family.size):
        _gather(tile, vectors, family, number, z, w, _X)
        if damped:
            _gather(tile, vectors, family, number, zdot, w, _RATE)
        for i in range(_FORCE * width, (_FORCE + 2 * vectors - 2) * width):
            w[i] = 0.0
        _force_points(tile, vectors, damped, family, number, w, power)
        _scatter(tile, vectors, family, number, w, f)


@njit(cache=True, error_model="numpy")
def add_force(
    tile: Tile, family: Beams, z: Array, zdot: Array, f: Array, w: Array, power: Array, moving: bool = True
) -> None:
    """Add the elastic force -dU/dz and the damping force [N, N m, ...] to f (rows, lanes). Pointers.

    power: row 0 += power dissipated by damping [W]; w: work space of 64 rows. zdot and power are not
    looked at unless the family is damped; moving: whether damping counts, or the elastic part alone.
    """
    if family.damped and moving:
        if family.vectors == CUBIC:
            _add_force(tile, CUBIC, True, family, z, zdot, f, w, power)
        else:
            _add_force(tile, QUINTIC, True, family, z, zdot, f, w, power)
    elif family.vectors == CUBIC:
        _add_force(tile, CUBIC, False, family, z, zdot, f, w, power)
    else:
        _add_force(tile, QUINTIC, False, family, z, zdot, f, w, power)


@njit(cache=True, error_model="numpy")
def add_energy(tile: Tile, family: Beams, z: Array, w: Array, energy: Array, row: int) -> None:
    """Add the strain energy [J] to a row of energy; w: work space of 64 rows. Pointers."""
    width = len(tile)
    inner = family.vectors - 1
    for number in range(family.size):
        _gather(tile, family.vectors, family, number, z, w, _X)
        base = COEFFICIENTS * number * width
        for g in range(family.points):
            at = 2 * family.vectors * g
            rest = 2 * (number * family.points + g) * width
            for lane in range(width):
                px, py, cx, cy = 0.0, 0.0, 0.0, 0.0
                for k in range(inner):
                    a, d = family.table[at + k], family.table[at + inner + k]
                    x, y = w[(_X + 2 * k) * width + lane], w[(_X + 2 * k + 1) * width + lane]
                    px, py, cx, cy = px + a * x, py + a * y, cx + d * x, cy + d * y
                square = px * px + py * py
                inverse = family.reference[rest + lane]
                strain = np.sqrt(square) * inverse - 1.0
                angle = (px * cy - py * cx) / square - family.reference[rest + width + lane]
                axial = family.table[at + 2 * inner] * family.coefficients[base + width + lane] / inverse
                bending = family.table[at + 2 * inner + 1] * family.coefficients[base + 2 * width + lane] * inverse
                energy[row * width + lane] += 0.5 * (axial * strain * strain + bending * angle * angle)


@njit(cache=True, error_model="numpy")
def _blocks(tile: Tile, vectors: int, viscous: bool, family: Beams, z: Array, w: Array, out: Array, first: int) -> None:
    """Sum over the points of (a_i, d_i) H (a_j, d_j), H the second derivative in (p, c), or the damping matrix there.

    Filled at the places of r2 (which stands for X_0) and of the other vectors, for i <= j, then completed.
    """
    width = len(tile)
    inner, order, side = vectors - 1, vectors // 2, 2 * vectors
    for number in range(family.size):
        _gather(tile, vectors, family, number, z, w, _X)
        block = first + side * side * number
        for i in range(block * width, (block + side * side) * width):
            out[i] = 0.0
        for g in range(family.points):
            _hessian(tile, vectors, viscous, family, number, g, w)
            at = side * g
            for i in range(inner):
                a, d = family.table[at + i], family.table[at + inner + i]
                for j in range(i, inner):
                    b, e = family.table[at + j], family.table[at + inner + j]
                    place = block + 2 * (side * _place(order, i) + _place(order, j))
                    ab, ae, db, de = a * b, a * e, d * b, d * e
                    for m in range(2):
                        for n in range(2):
                            to = (place + side * m + n) * width
                            pp = (_HESSIAN + 4 * m + n) * width
                            pc, cp, cc = pp + 2 * width, pp + 8 * width, pp + 10 * width
                            for lane in range(width):
                                out[to + lane] += (ab * w[pp + lane] + ae * w[pc + lane]) + (
                                    db * w[cp + lane] + de * w[cc + lane]
                                )
        _complete(tile, vectors, family, number, out, block)


@njit(cache=True, error_model="numpy", forceinline=True)
def _place(order: int, k: int) -> int:
    """The nodal vector at whose place X_k is assembled."""
    return order if k == 0 else (k if k < order else k + 1)


@njit(cache=True, error_model="numpy")
def _complete(tile: Tile, vectors: int, family: Beams, number: int, out: Array, block: int) -> None:
    """From second derivatives in X to those in the nodal vectors, all entries."""
    width = len(tile)
    order, side = vectors // 2, 2 * vectors
    base = COEFFICIENTS * number * width
    for i in range(1, vectors):
        for j in range(1, vectors):
            # X_0 comes first in the half that was filled.
            filled = i == order or (j != order and i <= j)
            for m in range(2):
                for n in range(m if i == j else 0, 2):
                    to = (block + side * (2 * i + m) + 2 * j + n) * width
                    mirror = (block + side * (2 * j + n) + 2 * i + m) * width
                    if filled:
                        for lane in range(width):
                            inverse = family.coefficients[base + lane]
                            value = out[to + lane]
                            value = value * inverse if i % order == 0 else value
                            value = value * inverse if j % order == 0 else value
                            value = value / inverse if i % order == 2 else value
                            value = value / inverse if j % order == 2 else value
                            out[to + lane] = value
                            out[mirror + lane] = value
    for k in range(2, side):
        for m in range(2):
            right = (block + side * k + 2 * order + m) * width
            left = (block + side * k + m) * width
            below = (block + side * (2 * order + m) + k) * width
            above = (block + side * m + k) * width
            for lane in range(width):
                out[left + lane] = -out[right + lane]
                out[above + lane] = -out[below + lane]
    for m in range(2):
        for n in range(2):
            corner = (block + side * m + n) * width
            opposite = (block + side * (2 * order + m) + 2 * order + n) * width
            for lane in range(width):
                out[corner + lane] = out[opposite + lane]


@njit(cache=True, error_model="numpy")
def _hessian(tile: Tile, vectors: int, viscous: bool, family: Beams, number: int, g: int, w: Array) -> None:
    """Second derivatives of the energy of a point in (p, c), or its damping matrix there, into 16 rows of w."""
    width = len(tile)
    inner = vectors - 1
    base = COEFFICIENTS * number * width
    at = 2 * vectors * g
    rest = 2 * (number * family.points + g) * width
    h = _HESSIAN * width
    for lane in range(width):
        px, py, cx, cy = 0.0, 0.0, 0.0, 0.0
        for k in range(inner):
            a, d = family.table[at + k], family.table[at + inner + k]
            x, y = w[(_X + 2 * k) * width + lane], w[(_X + 2 * k + 1) * width + lane]
            px, py, cx, cy = px + a * x, py + a * y, cx + d * x, cy + d * y
        shrink = 1.0 / np.sqrt(px * px + py * py)
        flat = shrink * shrink
        tx, ty = px * shrink, py * shrink
        inverse = family.reference[rest + lane]
        k_ = (px * cy - py * cx) * flat
        # The gradient of k in (p, c).
        ax, ay, bx, by = (cy - 2.0 * k_ * px) * flat, (-cx - 2.0 * k_ * py) * flat, -py * flat, px * flat
        axial = family.table[at + 2 * inner] * family.coefficients[base + width + lane]
        bending = family.table[at + 2 * inner + 1] * family.coefficients[base + 2 * width + lane] * inverse
        if viscous:
            eta = family.coefficients[base + 3 * width + lane]
            axial, bending = axial * eta, bending * eta
            along, across, moment = axial * inverse, 0.0, 0.0
        else:
            # (|p|/|p0| - 1)^2 |p0|/2 bends by 1/|p0| along p and by eps/|p| across it.
            along, across = axial * inverse, axial * (inverse - shrink)
            moment = bending * (k_ - family.reference[rest + width + lane])
        # With a, b this gradient: d2k/dp2 = -2 (p a' + a p' + k I)/|p|^2, d2k/dpdc = ((0, 1; -1, 0) - 2 p b')/|p|^2.
        first, both = -2.0 * moment * flat, along - across
        pxx = both * tx * tx + across + bending * ax * ax + first * (2.0 * px * ax + k_)
        pxy = both * tx * ty + bending * ax * ay + first * (px * ay + ax * py)
        pyy = both * ty * ty + across + bending * ay * ay + first * (2.0 * py * ay + k_)
        mixed = moment * flat
        xx, xy = bending * ax * bx + first * px * bx, bending * ax * by + first * px * by + mixed
        yx, yy = bending * ay * bx + first * py * bx - mixed, bending * ay * by + first * py * by
        cxx, cxy, cyy = bending * bx * bx, bending * bx * by, bending * by * by
        w[h + lane], w[h + width + lane], w[h + 2 * width + lane], w[h + 3 * width + lane] = pxx, pxy, xx, xy
        w[h + 4 * width + lane], w[h + 5 * width + lane] = pxy, pyy
        w[h + 6 * width + lane], w[h + 7 * width + lane] = yx, yy
        w[h + 8 * width + lane], w[h + 9 * width + lane] = xx, yx
        w[h + 10 * width + lane], w[h + 11 * width + lane] = cxx, cxy
        w[h + 12 * width + lane], w[h + 13 * width + lane] = xy, yy
        w[h + 14 * width + lane], w[h + 15 * width + lane] = cxy, cyy


@njit(cache=True, error_model="numpy")
def tangent(tile: Tile, family: Beams, z: Array, w: Array, out: Array, first: int) -> None:
    """Stiffness d2U/dz2 of every element; rows of out from `first` on: (size (2 vectors)^2, lanes), row-major blocks.

    w: work space of 64 rows. Pointers.
    """
    _blocks(tile, family.vectors, False, family, z, w, out, first)


@njit(cache=True, error_model="numpy")
def damping(tile: Tile, family: Beams, z: Array, w: Array, out: Array, first: int) -> None:
    """Damping matrix -df/dzdot of every element [N s/m, ...], laid out as in `tangent`. Pointers."""
    _blocks(tile, family.vectors, True, family, z, w, out, first)
