"""The strains of Simo and Reissner's rod, the gradient of their energy and its change; see `simo_reissner`.

An element is 12 numbers, or SIMD vectors: r1, r1', d1, r2, r2', d2. Its strains are stretch and shear at three points
of Lobatto, and bending at two of Gauss, times the length L:

    |r'| cos(delta) - 1,    -|r'| sin(delta),    (r' x L r'')/|r'|^2 + delta2 - delta1,

with delta the angle from r' to d, of which the one in the middle is the mean of those at the nodes.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from shoal.mechanics.elements.hermite import collect, curve
from shoal.mechanics.numerics.arc import arctangent
from shoal.mechanics.numerics.pairs import cross, quarter
from shoal.mechanics.numerics.simd import root
from shoal.mechanics.numerics.tuples import dot, plus, times

STRAINS = 8
"""Stretch and shear of each point of Lobatto, then bending at both of Gauss."""
AXIAL = np.array([[0.0, 1 / 6], [0.5, 4 / 6], [1.0, 1 / 6]])
BENDING = np.array([[0.5 - 0.5 / np.sqrt(3), 0.5], [0.5 + 0.5 / np.sqrt(3), 0.5]])
"""Points and weights."""


@njit(error_model="numpy", forceinline=True)
def _chord(z, inverse):  # type: ignore[no-untyped-def]
    """(r2 - r1)/L; inverse: 1/L."""
    return times(inverse, plus(z[6:8], -1.0, z[0:2]))


@njit(error_model="numpy", forceinline=True)
def _turned(s, d):  # type: ignore[no-untyped-def]
    """The angle from s to d, below a right one, with its cosine and sine."""
    size = 1.0 / root(dot(s, s) * dot(d, d))
    c, n = size * dot(s, d), size * cross(s, d)
    return 2.0 * arctangent(n / (1.0 + c)), c, n


@njit(error_model="numpy", forceinline=True)
def _angles(z):  # type: ignore[no-untyped-def]
    """delta2 - delta1, and cosines and sines of delta at the points of Lobatto."""
    a1, c1, n1 = _turned(z[2:4], z[4:6])
    a2, c2, n2 = _turned(z[8:10], z[10:12])
    half = 1.0 / root((c1 + c2) * (c1 + c2) + (n1 + n2) * (n1 + n2))
    return a2 - a1, (c1, (c1 + c2) * half, c2), (n1, (n1 + n2) * half, n2)


@njit(error_model="numpy", forceinline=True)
def _bend(p, q):  # type: ignore[no-untyped-def]
    """L times the turning of the tangent over the length, p x q/|p|^2, and its derivatives by p and q."""
    square = 1.0 / dot(p, p)
    psi = cross(p, q) * square
    return psi, plus(times(-square, quarter(q)), -2.0 * psi * square, p), times(square, quarter(p))


@njit(error_model="numpy", forceinline=True)
def _by_angle(u):  # type: ignore[no-untyped-def]
    """The derivative of the angle of u."""
    return times(1.0 / dot(u, u), quarter(u))


@njit(error_model="numpy", forceinline=True)
def strains(z, inverse):  # type: ignore[no-untyped-def]
    """The strains of elements; inverse: 1/L."""
    chord, s1, s2 = _chord(z, inverse), z[2:4], z[8:10]
    apart, c, n = _angles(z)
    pm, _ = curve(AXIAL[1, 0], chord, s1, s2)
    n1, nm, n2 = root(dot(s1, s1)), root(dot(pm, pm)), root(dot(s2, s2))
    p, q = curve(BENDING[0, 0], chord, s1, s2)
    first = cross(p, q) / dot(p, p) + apart
    p, q = curve(BENDING[1, 0], chord, s1, s2)
    second = cross(p, q) / dot(p, p) + apart
    ends = n2 * c[2] - 1.0, -n2 * n[2]
    return (n1 * c[0] - 1.0, -n1 * n[0], nm * c[1] - 1.0, -nm * n[1], *ends, first, second)


@njit(error_model="numpy", forceinline=True)
def _turning(z, v):  # type: ignore[no-untyped-def]
    """The rates of delta at both nodes."""
    first = dot(_by_angle(z[4:6]), v[4:6]) - dot(_by_angle(z[2:4]), v[2:4])
    return first, dot(_by_angle(z[10:12]), v[10:12]) - dot(_by_angle(z[8:10]), v[8:10])


@njit(error_model="numpy", forceinline=True)
def _drawn(p, u, c, n, w):  # type: ignore[no-untyped-def]
    """Rates of stretch and shear at a point: u that of r', w that of delta."""
    size = root(dot(p, p))
    grown = dot(p, u) / size
    return grown * c - size * n * w, -grown * n - size * c * w


@njit(error_model="numpy", forceinline=True)
def rates(z, v, inverse):  # type: ignore[no-untyped-def]
    """The rates of the strains, v being those of z."""
    chord, s1, s2, moving = _chord(z, inverse), z[2:4], z[8:10], _chord(v, inverse)
    _, c, n = _angles(z)
    w1, w2 = _turning(z, v)
    pm, _ = curve(AXIAL[1, 0], chord, s1, s2)
    um, _ = curve(AXIAL[1, 0], moving, v[2:4], v[8:10])
    p, q = curve(BENDING[0, 0], chord, s1, s2)
    u, a = curve(BENDING[0, 0], moving, v[2:4], v[8:10])
    _, by_p, by_q = _bend(p, q)
    first = dot(by_p, u) + dot(by_q, a) + w2 - w1
    p, q = curve(BENDING[1, 0], chord, s1, s2)
    u, a = curve(BENDING[1, 0], moving, v[2:4], v[8:10])
    _, by_p, by_q = _bend(p, q)
    second = dot(by_p, u) + dot(by_q, a) + w2 - w1
    one, two = _drawn(s1, v[2:4], c[0], n[0], w1), _drawn(pm, um, c[1], n[1], 0.5 * (w1 + w2))
    return (*one, *two, *_drawn(s2, v[8:10], c[2], n[2], w2), first, second)


@njit(error_model="numpy", forceinline=True)
def _section(p, c, n, axial, shear, stretch, slide):  # type: ignore[no-untyped-def]
    """At a point of Lobatto: its energy, and the derivatives by |r'| and by delta; stretch, slide: free strains."""
    size = root(dot(p, p))
    e, g = size * c - 1.0 - stretch, -size * n - slide
    force, across = axial * e, shear * g
    return 0.5 * (force * e + across * g), force * c - across * n, -size * (force * n + across * c)


@njit(error_model="numpy", forceinline=True)
def _held(d, stiffness):  # type: ignore[no-untyped-def]
    """The energy of a director that is not of unit length, and its derivative."""
    size = root(dot(d, d))
    longer = stiffness * (size - 1.0)
    return 0.5 * longer * (size - 1.0), times(longer / size, d)


@njit(error_model="numpy", forceinline=True)
def gradient(z, stiff, free):  # type: ignore[no-untyped-def]
    """The energy of elements and its derivatives by their rows; stiff: 1/L, EA L, kappa G A L, EI/L."""
    inverse, ea, ga, ei = stiff
    s1, d1, s2, d2 = z[2:4], z[4:6], z[8:10], z[10:12]
    chord = _chord(z, inverse)
    apart, c, n = _angles(z)
    pm, _ = curve(AXIAL[1, 0], chord, s1, s2)
    wa, wm = AXIAL[0, 1], AXIAL[1, 1]
    u1, f1, by1 = _section(s1, c[0], n[0], wa * ea, wa * ga, free[0], free[1])
    um, fm, bym = _section(pm, c[1], n[1], wm * ea, wm * ga, free[2], free[3])
    u2, f2, by2 = _section(s2, c[2], n[2], wa * ea, wa * ga, free[4], free[5])
    energy = u1 + um + u2
    none = times(0.0, s1)
    g, g1, g2 = collect(AXIAL[1, 0], times(fm / root(dot(pm, pm)), pm), none, none, none, none)
    by_apart = 0.0 * inverse
    for k in range(len(BENDING)):
        p, q = curve(BENDING[k, 0], chord, s1, s2)
        psi, by_p, by_q = _bend(p, q)
        angle = psi + apart - free[6 + k]
        m = BENDING[k, 1] * ei * angle
        energy = energy + 0.5 * m * angle
        by_apart = by_apart + m
        g, g1, g2 = collect(BENDING[k, 0], times(m, by_p), times(m, by_q), g, g1, g2)
    by1, by2 = by1 + 0.5 * bym - by_apart, by2 + 0.5 * bym + by_apart
    g1 = plus(plus(g1, f1 / root(dot(s1, s1)), s1), -by1, _by_angle(s1))
    g2 = plus(plus(g2, f2 / root(dot(s2, s2)), s2), -by2, _by_angle(s2))
    h1, n1 = _held(d1, 0.5 * ga)
    h2, n2 = _held(d2, 0.5 * ga)
    n1, n2 = plus(n1, by1, _by_angle(d1)), plus(n2, by2, _by_angle(d2))
    ends = times(inverse, g)
    return energy + h1 + h2, (-ends[0], -ends[1], *g1, *n1, *ends, *g2, *n2)


@njit(error_model="numpy", forceinline=True)
def _section_change(p, u, c, n, w, axial, shear, stretch, slide):  # type: ignore[no-untyped-def]
    """The changes of the derivatives by r' and by delta at a point of Lobatto; u, w: those of r' and delta."""
    size = root(dot(p, p))
    _, by_n, by = _section(p, c, n, axial, shear, stretch, slide)
    t = times(1.0 / size, p)
    grown = dot(t, u)
    e, g = _drawn(p, u, c, n, w)
    force, across = axial * e, shear * g
    more = force * c - across * n + by / size * w
    turn = grown * by / size - size * (force * n + across * c) - size * by_n * w
    return plus(times(more, t), by_n / size, plus(u, -grown, t)), by, turn


@njit(error_model="numpy", forceinline=True)
def _angle_change(s, u):  # type: ignore[no-untyped-def]
    """The change of `_by_angle` with that of s."""
    square = 1.0 / dot(s, s)
    return plus(times(square, quarter(u)), -2.0 * dot(s, u) * square, _by_angle(s))


@njit(error_model="numpy", forceinline=True)
def _held_change(d, u, stiffness):  # type: ignore[no-untyped-def]
    """The change of what `_held` derives."""
    size = root(dot(d, d))
    t = times(1.0 / size, d)
    grown = dot(t, u)
    return plus(times(stiffness * grown, t), stiffness * (size - 1.0) / size, plus(u, -grown, t))


@njit(error_model="numpy", forceinline=True)
def change(z, v, stiff, free):  # type: ignore[no-untyped-def]
    """How the derivatives of the energy change when z does by v: the stiffness times v."""
    inverse, ea, ga, ei = stiff
    s1, d1, s2, d2 = z[2:4], z[4:6], z[8:10], z[10:12]
    v1, e1, v2, e2 = v[2:4], v[4:6], v[8:10], v[10:12]
    chord, moving = _chord(z, inverse), _chord(v, inverse)
    apart, c, n = _angles(z)
    w1, w2 = _turning(z, v)
    pm, _ = curve(AXIAL[1, 0], chord, s1, s2)
    um, _ = curve(AXIAL[1, 0], moving, v1, v2)
    wa, wm = AXIAL[0, 1], AXIAL[1, 1]
    p1, by1, turn1 = _section_change(s1, v1, c[0], n[0], w1, wa * ea, wa * ga, free[0], free[1])
    p2, by2, turn2 = _section_change(s2, v2, c[2], n[2], w2, wa * ea, wa * ga, free[4], free[5])
    p, bym, turnm = _section_change(pm, um, c[1], n[1], 0.5 * (w1 + w2), wm * ea, wm * ga, free[2], free[3])
    none = times(0.0, s1)
    g, g1, g2 = collect(AXIAL[1, 0], p, none, none, none, none)
    by_apart, turn = 0.0 * inverse, 0.0 * inverse
    for k in range(len(BENDING)):
        p, q = curve(BENDING[k, 0], chord, s1, s2)
        u, a = curve(BENDING[k, 0], moving, v1, v2)
        psi, by_p, by_q = _bend(p, q)
        square = 1.0 / dot(p, p)
        grown, psidot = 2.0 * dot(p, u) * square, dot(by_p, u) + dot(by_q, a)
        m = BENDING[k, 1] * ei * (psi + apart - free[6 + k])
        more = BENDING[k, 1] * ei * (psidot + w2 - w1)
        by_apart, turn = by_apart + m, turn + more
        first = plus(plus(times(-square, quarter(a)), -2.0 * psidot * square, p), -2.0 * psi * square, u)
        second = plus(times(square, quarter(u)), -grown, by_q)
        first = plus(first, -grown, by_p)
        g, g1, g2 = collect(
            BENDING[k, 0], plus(times(more, by_p), m, first), plus(times(more, by_q), m, second), g, g1, g2
        )
    by1, by2 = by1 + 0.5 * bym - by_apart, by2 + 0.5 * bym + by_apart
    turn1, turn2 = turn1 + 0.5 * turnm - turn, turn2 + 0.5 * turnm + turn
    g1 = plus(plus(plus(g1, 1.0, p1), -turn1, _by_angle(s1)), -by1, _angle_change(s1, v1))
    g2 = plus(plus(plus(g2, 1.0, p2), -turn2, _by_angle(s2)), -by2, _angle_change(s2, v2))
    n1 = plus(plus(_held_change(d1, e1, 0.5 * ga), turn1, _by_angle(d1)), by1, _angle_change(d1, e1))
    n2 = plus(plus(_held_change(d2, e2, 0.5 * ga), turn2, _by_angle(d2)), by2, _angle_change(d2, e2))
    ends = times(inverse, g)
    return (-ends[0], -ends[1], *g1, *n1, *ends, *g2, *n2)
