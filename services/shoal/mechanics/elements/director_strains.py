"""Strains of director rods and the gradient of their energy by reverse-mode differentiation; see `director`.

Each adjoint has the name of the variable that it is the derivative by. An element is
18 numbers, or SIMD vectors: r1, r1', d1, r2, r2', d2. Its strains are torsion, k_y and k_z at both points of Gauss,
times the length L, and the stretching at three points of Lobatto.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from shoal.compile.simd import inverse_root, reciprocal
from shoal.compile.tuples import dot, plus, times
from shoal.compile.tuples import wedge as cross
from shoal.mechanics.elements.hermite import collect, curve
from shoal.mechanics.numerics.arc import arctangent, turn

STRAINS = 9
AXIAL = np.array([[0.0, 1 / 6], [0.5, 4 / 6], [1.0, 1 / 6]])
BENDING = np.array([[0.5 - 0.5 / np.sqrt(3), 0.5], [0.5 + 0.5 / np.sqrt(3), 0.5]])
"""Points and weights of Lobatto's and Gauss's rules on (0, 1)."""


@njit(error_model="numpy", forceinline=True)
def _across(a, t, inverse):  # type: ignore[no-untyped-def]
    """The derivative by s of what has the derivative a by t = s/|s|; inverse: 1/|s|."""
    return times(inverse, plus(a, -dot(a, t), t))


@njit(error_model="numpy", forceinline=True)
def _carry(d, t, tm):  # type: ignore[no-untyped-def]
    """Parallel transport of a director from t to tm by the smallest rotation, and two factors for its adjoint."""
    j = reciprocal(1.0 + dot(t, tm))
    v = dot(d, tm) * j
    return plus(plus(d, -v, t), -v, tm), v, j


@njit(error_model="numpy", forceinline=True)
def _carry_back(m, d, t, tm, v, j):  # type: ignore[no-untyped-def]
    """Adjoint of `_carry`: derivatives by d, t and tm of a function with the derivative m by the carried director."""
    s, most = (dot(m, t) + dot(m, tm)) * j, times(-v, m)
    return plus(m, -s, tm), plus(most, s * v, tm), plus(plus(most, -s, d), s * v, t)


@njit(error_model="numpy", forceinline=True)
def _slope(s):  # type: ignore[no-untyped-def]
    """One over the length of a slope, its direction, and its length."""
    square = dot(s, s)
    inverse = inverse_root(square)
    return inverse, times(inverse, s), square * inverse


@njit(error_model="numpy", forceinline=True)
def _between(m1, m2, tm):  # type: ignore[no-untyped-def]
    """The twist phi between carried directors, and the section halfway, (e, f), with what leads to them."""
    m12 = cross(m1, m2)
    s, c = dot(tm, m12), 1.0 + dot(m1, m2)
    b = plus(m1, 1.0, m2)
    ib = inverse_root(dot(b, b))
    e = times(ib, b)
    return 2.0 * arctangent(s * reciprocal(c)), e, cross(tm, e), m12, s, c, ib


@njit(error_model="numpy", forceinline=True)
def _bent(p, curl, tm):  # type: ignore[no-untyped-def]
    """At a point: 1/|r'|, t, t . L r'', h, 1/(1 + t . t_m), u, t x h, its part of the torsion, h - u t."""
    ip, t, _ = _slope(p)
    tc = dot(t, curl)
    h = times(ip, plus(curl, -tc, t))
    i = reciprocal(1.0 + dot(tm, t))
    u = dot(h, tm) * i
    th = cross(t, h)
    return ip, t, tc, h, i, u, th, dot(tm, th) * i, plus(h, -u, t)


@njit(error_model="numpy", forceinline=True)
def _section(phi, x, e0, f0):  # type: ignore[no-untyped-def]
    """The section at x, and sine and cosine of its turn from the one halfway."""
    sa, ca = turn(phi * (x - 0.5))
    return plus(times(ca, e0), sa, f0), plus(times(ca, f0), -sa, e0), sa, ca


@njit(error_model="numpy", forceinline=True)
def strains(z, inverse):  # type: ignore[no-untyped-def]
    """The strains of elements; inverse: 1/L."""
    s1, d1, s2, d2 = z[3:6], z[6:9], z[12:15], z[15:18]
    chord = times(inverse, plus(z[9:12], -1.0, z[0:3]))
    pm, _ = curve(0.5, chord, s1, s2)
    _, tm, nm = _slope(pm)
    _, t1, n1 = _slope(s1)
    _, t2, n2 = _slope(s2)
    m1, _, _ = _carry(d1, t1, tm)
    m2, _, _ = _carry(d2, t2, tm)
    phi, e0, f0, _, _, _, _ = _between(m1, m2, tm)
    p, curl = curve(BENDING[0, 0], chord, s1, s2)
    q, kk = _bent(p, curl, tm)[7:9]
    e, f, _, _ = _section(phi, BENDING[0, 0], e0, f0)
    first = phi - q, dot(kk, e), dot(kk, f)
    p, curl = curve(BENDING[1, 0], chord, s1, s2)
    q, kk = _bent(p, curl, tm)[7:9]
    e, f, _, _ = _section(phi, BENDING[1, 0], e0, f0)
    second = phi - q, dot(kk, e), dot(kk, f)
    return (*first, *second, n1 - 1.0, nm - 1.0, n2 - 1.0)


@njit(error_model="numpy", forceinline=True)
def gradient(z, stiff, free):  # type: ignore[no-untyped-def]
    """The energy of elements and its derivatives by their rows; stiff: 1/L, EA L, GJ/L, EI_y/L, EI_z/L."""
    inverse, ea, gj, ey, ez = stiff
    r1, s1, d1, r2, s2, d2 = z[0:3], z[3:6], z[6:9], z[9:12], z[12:15], z[15:18]
    zero = times(0.0, r1)
    chord = times(inverse, plus(r2, -1.0, r1))
    pm, _ = curve(0.5, chord, s1, s2)
    im, tm, nm = _slope(pm)
    i1, t1, n1 = _slope(s1)
    i2, t2, n2 = _slope(s2)
    first, middle, last = n1 - 1.0 - free[6], nm - 1.0 - free[7], n2 - 1.0 - free[8]
    outer, inner = AXIAL[0, 1] * ea, AXIAL[1, 1] * ea
    energy = 0.5 * (outer * (first * first + last * last) + inner * (middle * middle))
    g, g1, g2 = collect(0.5, times(inner * middle, tm), zero, zero, times(outer * first, t1), times(outer * last, t2))
    m1, v1, j1 = _carry(d1, t1, tm)
    m2, v2, j2 = _carry(d2, t2, tm)
    phi, e0, f0, m12, s, c, ib = _between(m1, m2, tm)
    by_tm, by_e, by_f, by_phi = zero, zero, zero, 0.0 * inverse
    for k in range(len(BENDING)):
        x, w = BENDING[k, 0], BENDING[k, 1]
        p, curl = curve(x, chord, s1, s2)
        ip, t, tc, h, i, u, th, q, kk = _bent(p, curl, tm)
        e, f, sa, ca = _section(phi, x, e0, f0)
        ky, kz, tau = dot(kk, e), dot(kk, f), phi - q
        o0, o1, o2 = free[3 * k], free[3 * k + 1], free[3 * k + 2]
        torque, my, mz = w * gj * (tau - o0), w * ey * (ky - o1), w * ez * (kz - o2)
        energy = energy + 0.5 * (torque * (tau - o0) + my * (ky - o1) + mz * (kz - o2))
        m = plus(times(my, e), mz, f)
        al, be = dot(t, m) * i, torque * i
        by_h = plus(plus(m, -al, tm), -be, cross(tm, t))
        by_t = plus(plus(times(-u, m), al * u + be * q, tm), -be, cross(h, tm))
        by_tm = plus(plus(plus(by_tm, -al, h), al * u + be * q, t), -be, th)
        by_phi = by_phi + torque + (x - 0.5) * (my * kz - mz * ky)
        by_e = plus(by_e, my * ca - mz * sa, kk)
        by_f = plus(by_f, my * sa + mz * ca, kk)
        along = dot(t, by_h)
        by_t = plus(plus(by_t, -tc * ip, by_h), -along * ip, curl)
        g, g1, g2 = collect(
            x, plus(_across(by_t, t, ip), -dot(h, by_h) * ip, t), times(ip, plus(by_h, -along, t)), g, g1, g2
        )
    by_e = plus(by_e, 1.0, cross(by_f, tm))
    by_tm = plus(by_tm, 1.0, cross(e0, by_f))
    by_b = _across(by_e, e0, ib)
    part = 2.0 * by_phi * reciprocal(c * c + s * s)
    y, xx = part * c, -part * s
    by_tm = plus(by_tm, y, m12)
    by_m1 = plus(plus(by_b, y, cross(m2, tm)), xx, m2)
    by_m2 = plus(plus(by_b, y, cross(tm, m1)), xx, m1)
    h1, a1, c1 = _carry_back(by_m1, d1, t1, tm, v1, j1)
    h2, a2, c2 = _carry_back(by_m2, d2, t2, tm, v2, j2)
    by_tm = plus(plus(by_tm, 1.0, c1), 1.0, c2)
    g, g1, g2 = collect(0.5, _across(by_tm, tm, im), zero, g, g1, g2)
    g1 = plus(g1, 1.0, _across(a1, t1, i1))
    g2 = plus(g2, 1.0, _across(a2, t2, i2))
    ends = times(inverse, g)
    return energy, (-ends[0], -ends[1], -ends[2], *g1, *h1, *ends, *g2, *h2)
