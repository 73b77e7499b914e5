"""The director rod: a cubic centreline with one director a node, for bending about two axes, torsion and pre-curvature.

A node has r, r' and d, the section's local y axis (height), with |d| = 1 and d . r' = 0 (`Element.products`). The
smallest rotation carries both directors from their tangents to that in the middle of the element, t_m, where phi is the
angle between them. At x the section is that halfway between, turned by phi (x - 1/2) about t_m into (e, f), and carried
by the smallest rotation from t_m to t. With h = L t' and u = h . t_m/(1 + t . t_m) its strains, times L, are

    bending:  k_y = (h - u t) . e,    k_z = (h - u t) . f,    torsion:  phi - t_m . (t x h)/(1 + t . t_m),

and the energy that of EI_y (k_y - k_y0)^2, EI_z (k_z - k_z0)^2 and GJ, by two points of Gauss, with the stretching of
the cable by three of Lobatto. Twist in an element stays below a right angle or so; it is linear, and the rod of second
order. The force is the gradient written out backwards; each step has the name of what it is the derivative by.

Coefficients: 1/L [1/m], EA L, GJ/L, EI_y/L (in the plane of t and d), EI_z/L [N m]; reference: torsion, k_y and k_z of
the unstrained element at both points. Rows: x, y, z of r1, r1', d1, r2, r2', d2.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from shoal.errors import InputError
from shoal.mechanics.elements import beam
from shoal.mechanics.elements.batch import add_rows, add_sum, coefficient, coordinate, put, rest, together
from shoal.mechanics.elements.element import Element
from shoal.mechanics.elements.families import Entry, Family, Kernel, implement
from shoal.mechanics.elements.section import torsion_constant
from shoal.mechanics.numerics.pointers import shift
from shoal.mechanics.numerics.simd import EIGHT, load, root, store
from shoal.mechanics.numerics.tile import Array, Number, Tile
from shoal.scene import Rod

ROWS, COEFFICIENTS = 18, 5
_AXIAL = np.array([[0.0, 1 / 6], [0.5, 4 / 6], [1.0, 1 / 6]])
_BENDING = np.array([[0.5 - 0.5 / np.sqrt(3), 0.5], [0.5 + 0.5 / np.sqrt(3), 0.5]])
_STEP = 1e-6
"""Of the differences of the force that are the stiffness, in slopes; times the length of the element in places."""


class DirectorRods(Family):
    """Director rods."""


@njit(error_model="numpy", forceinline=True)
def _dot(a, b):  # type: ignore[no-untyped-def]
    """a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(error_model="numpy", forceinline=True)
def _cross(a, b):  # type: ignore[no-untyped-def]
    """a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit(error_model="numpy", forceinline=True)
def _times(k, a):  # type: ignore[no-untyped-def]
    """k a."""
    return k * a[0], k * a[1], k * a[2]


@njit(error_model="numpy", forceinline=True)
def _plus(a, k, b):  # type: ignore[no-untyped-def]
    """a + k b."""
    return a[0] + k * b[0], a[1] + k * b[1], a[2] + k * b[2]


@njit(error_model="numpy", forceinline=True)
def _across(a, t, inverse):  # type: ignore[no-untyped-def]
    """The derivative by s of what has the derivative a by t = s/|s|; inverse: 1/|s|."""
    return _times(inverse, _plus(a, -_dot(a, t), t))


@njit(error_model="numpy", forceinline=True)
def _angle(r):  # type: ignore[no-untyped-def]
    """The angle whose tangent is r, |r| <= 1: halved three times, then by its series."""
    for _ in range(3):
        r = r / (1.0 + root(1.0 + r * r))
    s, v = r * r, 0.0 * r
    for n in range(10, -1, -1):
        v = 1.0 / (2.0 * n + 1.0) - s * v
    return 8.0 * r * v


@njit(error_model="numpy", forceinline=True)
def _turn(a):  # type: ignore[no-untyped-def]
    """Sine and cosine of an angle up to a right one or so, by their series."""
    s, c, d = a * a, 0.0 * a + 1.0, 0.0 * a + 1.0
    for n in range(11, 0, -1):
        c = 1.0 - s * c / ((2.0 * n) * (2.0 * n - 1.0))
        d = 1.0 - s * d / ((2.0 * n) * (2.0 * n + 1.0))
    return a * d, c


@njit(error_model="numpy", forceinline=True)
def _carry(d, t, tm):  # type: ignore[no-untyped-def]
    """A director carried from t to tm by the smallest rotation, and two factors for the way back."""
    j = 1.0 / (1.0 + _dot(t, tm))
    v = _dot(d, tm) * j
    return _plus(_plus(d, -v, t), -v, tm), v, j


@njit(error_model="numpy", forceinline=True)
def _carry_back(m, d, t, tm, v, j):  # type: ignore[no-untyped-def]
    """Derivatives by d, t and tm of what has the derivative m by the carried director."""
    s, most = (_dot(m, t) + _dot(m, tm)) * j, _times(-v, m)
    return _plus(m, -s, tm), _plus(most, s * v, tm), _plus(_plus(most, -s, d), s * v, t)


@njit(error_model="numpy", forceinline=True)
def _shapes(x):  # type: ignore[no-untyped-def]
    """Factors of D = (r2 - r1)/L, r1' and r2' in r' and in L r''."""
    return (
        6.0 * x * (1.0 - x),
        1.0 - 4.0 * x + 3.0 * x * x,
        3.0 * x * x - 2.0 * x,
        6.0 - 12.0 * x,
        6.0 * x - 4.0,
        6.0 * x - 2.0,
    )


@njit(error_model="numpy", forceinline=True)
def _curve(x, chord, s1, s2):  # type: ignore[no-untyped-def]
    """r' and L r'' at x."""
    a, b, c, d, e, f = _shapes(x)
    p = _plus(_plus(_times(a, chord), b, s1), c, s2)
    return p, _plus(_plus(_times(d, chord), e, s1), f, s2)


@njit(error_model="numpy", forceinline=True)
def _collect(x, p, c, g, g1, g2):  # type: ignore[no-untyped-def]
    """Add to the derivatives by D, r1' and r2' those of a point: p by r', c by L r''."""
    i, j, k, m, n, o = _shapes(x)
    return _plus(_plus(g, i, p), m, c), _plus(_plus(g1, j, p), n, c), _plus(_plus(g2, k, p), o, c)


@njit(error_model="numpy", forceinline=True)
def _gradient(z, stiff, free):  # type: ignore[no-untyped-def]
    """The energy of elements and its derivatives by their rows; stiff: coefficients, free: reference."""
    inverse, ea, gj, ey, ez = stiff
    r1, s1, d1, r2, s2, d2 = z[0:3], z[3:6], z[6:9], z[9:12], z[12:15], z[15:18]
    zero = _times(0.0, r1)
    chord = _times(inverse, _plus(r2, -1.0, r1))
    g, g1, g2 = zero, zero, zero
    energy = 0.0 * inverse
    for k in range(len(_AXIAL)):
        x, w = _AXIAL[k, 0], _AXIAL[k, 1]
        p, _ = _curve(x, chord, s1, s2)
        n = root(_dot(p, p))
        energy = energy + 0.5 * w * ea * (n - 1.0) * (n - 1.0)
        g, g1, g2 = _collect(x, _times(w * ea * (1.0 - 1.0 / n), p), zero, g, g1, g2)
    pm, _ = _curve(0.5, chord, s1, s2)
    im = 1.0 / root(_dot(pm, pm))
    tm = _times(im, pm)
    i1 = 1.0 / root(_dot(s1, s1))
    t1 = _times(i1, s1)
    i2 = 1.0 / root(_dot(s2, s2))
    t2 = _times(i2, s2)
    m1, v1, j1 = _carry(d1, t1, tm)
    m2, v2, j2 = _carry(d2, t2, tm)
    m12 = _cross(m1, m2)
    s = _dot(tm, m12)
    c = 1.0 + _dot(m1, m2)
    phi = 2.0 * _angle(s / c)
    b = _plus(m1, 1.0, m2)
    ib = 1.0 / root(_dot(b, b))
    e0 = _times(ib, b)
    f0 = _cross(tm, e0)
    by_tm, by_e, by_f, by_phi = zero, zero, zero, 0.0 * inverse
    for k in range(len(_BENDING)):
        x, w = _BENDING[k, 0], _BENDING[k, 1]
        p, curl = _curve(x, chord, s1, s2)
        ip = 1.0 / root(_dot(p, p))
        t = _times(ip, p)
        tc = _dot(t, curl)
        h = _times(ip, _plus(curl, -tc, t))
        i = 1.0 / (1.0 + _dot(tm, t))
        u = _dot(h, tm) * i
        th = _cross(t, h)
        q = _dot(tm, th) * i
        kk = _plus(h, -u, t)
        sa, ca = _turn(phi * (x - 0.5))
        e = _plus(_times(ca, e0), sa, f0)
        f = _plus(_times(ca, f0), -sa, e0)
        ky, kz, tau = _dot(kk, e), _dot(kk, f), phi - q
        o0, o1, o2 = free[3 * k], free[3 * k + 1], free[3 * k + 2]
        torque, my, mz = w * gj * (tau - o0), w * ey * (ky - o1), w * ez * (kz - o2)
        energy = energy + 0.5 * (torque * (tau - o0) + my * (ky - o1) + mz * (kz - o2))
        m = _plus(_times(my, e), mz, f)
        al, be = _dot(t, m) * i, torque * i
        by_h = _plus(_plus(m, -al, tm), -be, _cross(tm, t))
        by_t = _plus(_plus(_times(-u, m), al * u + be * q, tm), -be, _cross(h, tm))
        by_tm = _plus(_plus(_plus(by_tm, -al, h), al * u + be * q, t), -be, th)
        by_phi = by_phi + torque + (x - 0.5) * (my * kz - mz * ky)
        by_e = _plus(by_e, my * ca - mz * sa, kk)
        by_f = _plus(by_f, my * sa + mz * ca, kk)
        tH = _dot(t, by_h)
        by_t = _plus(_plus(by_t, -tc * ip, by_h), -tH * ip, curl)
        g, g1, g2 = _collect(
            x, _plus(_across(by_t, t, ip), -_dot(h, by_h) * ip, t), _times(ip, _plus(by_h, -tH, t)), g, g1, g2
        )
    by_e = _plus(by_e, 1.0, _cross(by_f, tm))
    by_tm = _plus(by_tm, 1.0, _cross(e0, by_f))
    by_b = _across(by_e, e0, ib)
    part = 2.0 * by_phi / (c * c + s * s)
    y, xx = part * c, -part * s
    by_tm = _plus(by_tm, y, m12)
    by_m1 = _plus(_plus(by_b, y, _cross(m2, tm)), xx, m2)
    by_m2 = _plus(_plus(by_b, y, _cross(tm, m1)), xx, m1)
    n1, a1, c1 = _carry_back(by_m1, d1, t1, tm, v1, j1)
    n2, a2, c2 = _carry_back(by_m2, d2, t2, tm, v2, j2)
    by_tm = _plus(_plus(by_tm, 1.0, c1), 1.0, c2)
    g, g1, g2 = _collect(0.5, _across(by_tm, tm, im), zero, g, g1, g2)
    g1 = _plus(g1, 1.0, _across(a1, t1, i1))
    g2 = _plus(g2, 1.0, _across(a2, t2, i2))
    ends = _times(inverse, g)
    return energy, (-ends[0], -ends[1], -ends[2], *g1, *n1, *ends, *g2, *n2)


@njit(error_model="numpy", forceinline=True)
def _numbers(tile, family, number, lane):  # type: ignore[no-untyped-def]
    """Coefficients and reference of elements."""
    c = COEFFICIENTS
    stiff = (
        coefficient(tile, family, number, lane, c, 0),
        coefficient(tile, family, number, lane, c, 1),
        coefficient(tile, family, number, lane, c, 2),
        coefficient(tile, family, number, lane, c, 3),
        coefficient(tile, family, number, lane, c, 4),
    )
    first = (
        rest(tile, family, number, lane, 0),
        rest(tile, family, number, lane, 1),
        rest(tile, family, number, lane, 2),
    )
    other = (
        rest(tile, family, number, lane, 3),
        rest(tile, family, number, lane, 4),
        rest(tile, family, number, lane, 5),
    )
    return stiff, (*first, *other)


@njit(error_model="numpy", forceinline=True)
def _vector(tile, family, number, lane, k, z):  # type: ignore[no-untyped-def]
    """Three rows from the k-th on."""
    x, y = coordinate(tile, family, number, lane, ROWS, k, z), coordinate(tile, family, number, lane, ROWS, k + 1, z)
    return x, y, coordinate(tile, family, number, lane, ROWS, k + 2, z)


@njit(error_model="numpy", forceinline=True)
def _state(tile, family, number, lane, z):  # type: ignore[no-untyped-def]
    """All rows."""
    a, b = _vector(tile, family, number, lane, 0, z), _vector(tile, family, number, lane, 3, z)
    c, d = _vector(tile, family, number, lane, 6, z), _vector(tile, family, number, lane, 9, z)
    e, f = _vector(tile, family, number, lane, 12, z), _vector(tile, family, number, lane, 15, z)
    return (*a, *b, *c, *d, *e, *f)


@njit(error_model="numpy", forceinline=True)
def _kept(w):  # type: ignore[no-untyped-def]
    """All rows, as the stiffness keeps them."""
    e = len(EIGHT)
    a, b, c = load(EIGHT, w, e), load(EIGHT, w, 2 * e), load(EIGHT, w, 3 * e)
    d, f, g = load(EIGHT, w, 4 * e), load(EIGHT, w, 5 * e), load(EIGHT, w, 6 * e)
    h, i, j = load(EIGHT, w, 7 * e), load(EIGHT, w, 8 * e), load(EIGHT, w, 9 * e)
    k, m, n = load(EIGHT, w, 10 * e), load(EIGHT, w, 11 * e), load(EIGHT, w, 12 * e)
    o, p, q = load(EIGHT, w, 13 * e), load(EIGHT, w, 14 * e), load(EIGHT, w, 15 * e)
    r, s, t = load(EIGHT, w, 16 * e), load(EIGHT, w, 17 * e), load(EIGHT, w, 18 * e)
    return a, b, c, d, f, g, h, i, j, k, m, n, o, p, q, r, s, t


@njit(cache=True, error_model="numpy")
def force(tile: Tile, family: Family, z: Array, zdot: Array, f: Array, w: Array, power: Array, moving: bool) -> None:
    """See `families.add_force`."""
    number = 0
    while number < family.size:
        count = together(tile, family, number)
        for lane in range(0, len(tile) - family.spare, len(EIGHT)):
            stiff, free = _numbers(tile, family, number, lane)
            _, g = _gradient(_state(tile, family, number, lane, z), stiff, free)
            a, b, c = _times(-1.0, g[0:3]), _times(-1.0, g[3:6]), _times(-1.0, g[6:9])
            d, e, h = _times(-1.0, g[9:12]), _times(-1.0, g[12:15]), _times(-1.0, g[15:18])
            add_rows(tile, family, number, lane, count, w, f, (*a, *b, *c, *d, *e, *h))
        number += count


@njit(cache=True, error_model="numpy")
def potential(tile: Tile, family: Family, z: Array, w: Array, energy: Array, row: int) -> None:
    """See `families.add_energy`."""
    number, total = 0, shift(energy, row * len(tile))
    while number < family.size:
        count = together(tile, family, number)
        for lane in range(0, len(tile), len(EIGHT)):
            stiff, free = _numbers(tile, family, number, lane)
            found, _ = _gradient(_state(tile, family, number, lane, z), stiff, free)
            add_sum(tile, lane, count, w, total, found)
        number += count


@njit(cache=True, error_model="numpy")
def stiffness(tile: Tile, family: Family, z: Array, w: Array, out: Array, first: int) -> None:
    """See `families.tangent`: central differences of the force, whose error is of the order of 1e-9 of the largest."""
    number = 0
    while number < family.size:
        count = together(tile, family, number)
        for lane in range(0, len(tile), len(EIGHT)):
            stiff, free = _numbers(tile, family, number, lane)
            state = _state(tile, family, number, lane, z)
            for column in range(ROWS):
                length = 1.0 / stiff[0]
                step = _STEP * (length if column % 9 < 3 else length * stiff[0])
                for k in range(ROWS):
                    store(w, len(EIGHT) * (1 + k), state[k])
                here = len(EIGHT) * (1 + column)
                middle = load(EIGHT, w, here)
                for side in range(2):
                    store(w, here, middle + (1.0 - 2.0 * side) * step)
                    _, g = _gradient(_kept(w), stiff, free)
                    for k in range(ROWS):
                        place = len(EIGHT) * (1 + ROWS + k)
                        if side == 0:
                            store(w, place, g[k])
                        else:
                            value = (load(EIGHT, w, place) - g[k]) / (2.0 * step)
                            row = first + ROWS * ROWS * number + ROWS * k + column
                            put(tile, lane, count, w, out, row, ROWS * ROWS, value)
        number += count


implement(DirectorRods, Kernel(ROWS, COEFFICIENTS, 1), force=force, potential=potential, stiffness=stiffness)


def _part(rod: Rod, height: Number, width: Number, length: Number, nodal: list[Number]) -> Entry:
    if rod.curvature or np.any(rod.retardation):
        raise InputError("a director-rod of a scene is straight and elastic: leave curvature and retardation out")
    young: Number = rod.youngs_modulus
    return entry(young, young / (2 * (1 + rod.poisson_ratio)), height, width, length, (0.0,) * 6)


def entry(
    young: Number, shear: Number, height: Number, width: Number, length: Number, free: tuple[Number, ...]
) -> Entry:
    """One element of this material [Pa] and section [m]; free: torsion, k_y and k_z at rest, times L, at each point."""
    bending = young * width * height**3 / 12 / length, young * height * width**3 / 12 / length
    torsion = shear * torsion_constant(height, width) / length
    numbers = [1.0 / length, young * height * width * length, torsion, *bending]
    return Entry(_BENDING, 0, False, numbers, [*free])


def _nodal_vectors(rod: Rod, s: Number) -> list[Number]:
    none = 0.0 * np.asarray(s)
    return [np.stack([1.0 + none, none, none]), np.stack([none, 1.0 + none, none])]


def _padded(factors: list[Number]) -> list[Number]:
    """Those of the cable, and zeros for the directors."""
    return [*factors[:2], 0.0, *factors[2:], 0.0]


def _mass(density: Number, height: Number, width: Number, length: Number) -> list[list[Number]]:
    """That of the cable, and the polar inertia of the section on the directors, which are linear in between."""
    cable = beam.mass_matrix(beam.CUBIC, density * height * width, length)
    polar = density * height * width * (height**2 + width**2) / 12 * length
    rows = [_padded(row) for row in cable]
    first, second = [0.0, 0.0, polar / 3, 0.0, 0.0, polar / 6], [0.0, 0.0, polar / 6, 0.0, 0.0, polar / 3]
    return [*rows[:2], first, *rows[2:], second]


def _stretching(axial: Number, length: Number) -> list[list[Number]]:
    rows = [_padded(row) for row in beam.stretching(beam.CUBIC, axial, length)]
    return [*rows[:2], [0.0] * 6, *rows[2:], [0.0] * 6]


ELEMENT = Element(
    family=DirectorRods,
    nodal_vectors=_nodal_vectors,
    position_shape=lambda x, y, length: _padded(beam.shape(beam.CUBIC, x, length, 0)),
    direction_shape=lambda x, y, length: _padded(beam.shape(beam.CUBIC, x, length, 1)),
    mass=_mass,
    weight=lambda density, height, width, length: _padded(beam.weight(beam.CUBIC, density * height * width, length)),
    part=_part,
    stretching=_stretching,
    products=((1, 1, 1.0), (0, 1, 0.0)),
)
