"""The strains of Simo and Reissner's rod, the gradient of their energy and its change; see `simo_reissner`.

An element is 12 numbers, or SIMD vectors: r1, r1', d1, r2, r2', d2. Its strains are stretch and shear at three points
of Lobatto, and bending at two of Gauss, times the length L:

    a cos(beta) + t sin(beta) - 1,    t cos(beta) - a sin(beta),    phi + 4 beta (1 - 2 x),

with a and t the parts of r' along a normal and across it, and phi the angle from d1 to d2. At the nodes the normal is
d/|d| and beta is 0. In the middle it is that of d1/|d1| + d2/|d2|, from which the section turns by beta more, so far
that its shear is tau, the mean of the nodes': tan(beta) = (t - tau)/(a + g^3) with g = 1 - |r'|^2 where that is above
0, else 0. Without g a rod that is pressed to no length would have no tangent to turn with, and no stable step.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from shoal.compile.simd import heaviside, inverse_root, reciprocal
from shoal.compile.tuples import dot, plus, times
from shoal.mechanics.elements.hermite import collect, curve
from shoal.mechanics.numerics.arc import arctangent

STRAINS = 8
"""Stretch and shear of each point of Lobatto, then bending at both of Gauss."""
AXIAL = np.array([[0.0, 1 / 6], [0.5, 4 / 6], [1.0, 1 / 6]])
BENDING = np.array([[0.5 - 0.5 / np.sqrt(3), 0.5], [0.5 + 0.5 / np.sqrt(3), 0.5]])
"""Points and weights."""
TURNED = 4.0 * (1.0 - 2.0 * BENDING[0, 0])
"""By how much beta bends at the first point of Gauss, and the other way at the second."""


@njit(error_model="numpy", forceinline=True)
def _cross(a, b):  # type: ignore[no-untyped-def]
    """a x b."""
    return a[0] * b[1] - a[1] * b[0]


@njit(error_model="numpy", forceinline=True)
def _quarter(a):  # type: ignore[no-untyped-def]
    """a turned by a right angle, counter-clockwise."""
    return -a[1], a[0]


@njit(error_model="numpy", forceinline=True)
def _unit(d):  # type: ignore[no-untyped-def]
    """d/|d|."""
    return times(inverse_root(dot(d, d)), d)


@njit(error_model="numpy", forceinline=True)
def _by_angle(d):  # type: ignore[no-untyped-def]
    """The derivative of the angle of d."""
    return times(reciprocal(dot(d, d)), _quarter(d))


@njit(error_model="numpy", forceinline=True)
def _middle(z, inverse):  # type: ignore[no-untyped-def]
    """r' in the middle; inverse: 1/L."""
    p, _ = curve(AXIAL[1, 0], times(inverse, plus(z[6:8], -1.0, z[0:2])), z[2:4], z[8:10])
    return p


@njit(error_model="numpy", forceinline=True)
def _between(e1, e2):  # type: ignore[no-untyped-def]
    """The angle from e1 to e2, below two right ones."""
    return 2.0 * arctangent(_cross(e1, e2) * reciprocal(1.0 + dot(e1, e2)))


@njit(error_model="numpy", forceinline=True)
def _short(a, t):  # type: ignore[no-untyped-def]
    """1 - |r'|^2 where that is above 0, else 0."""
    g = 1.0 - a * a - t * t
    return g * heaviside(g)


@njit(error_model="numpy", forceinline=True)
def _bent(p, m, tau):  # type: ignore[no-untyped-def]
    """In the middle: a, t, cos(beta), sin(beta), beta, and 1 over the length of (a + g^3, t - tau)."""
    a, t = dot(m, p), _cross(m, p)
    g = _short(a, t)
    x, y = a + g * g * g, t - tau
    size = inverse_root(x * x + y * y)
    cosine, sine = x * size, y * size
    return a, t, cosine, sine, 2.0 * arctangent(sine * reciprocal(1.0 + cosine)), size


@njit(error_model="numpy", forceinline=True)
def _by(bent):  # type: ignore[no-untyped-def]
    """The derivatives of beta by a, t and tau."""
    a, t, cosine, sine, _, size = bent
    g = _short(a, t)
    steep = 6.0 * g * g
    return size * sine * (steep * a - 1.0), size * (cosine + sine * steep * t), -size * cosine


@njit(error_model="numpy", forceinline=True)
def strains(z, inverse):  # type: ignore[no-untyped-def]
    """The strains of elements; inverse: 1/L."""
    e1, e2, p = _unit(z[4:6]), _unit(z[10:12]), _middle(z, inverse)
    one, two = (dot(e1, z[2:4]) - 1.0, _cross(e1, z[2:4])), (dot(e2, z[8:10]) - 1.0, _cross(e2, z[8:10]))
    a, t, cosine, sine, beta, _ = _bent(p, _unit(plus(e1, 1.0, e2)), 0.5 * (one[1] + two[1]))
    mid, phi = (a * cosine + t * sine - 1.0, t * cosine - a * sine), _between(e1, e2)
    return (*one, *mid, *two, phi + TURNED * beta, phi - TURNED * beta)


@njit(error_model="numpy", forceinline=True)
def _seen(p, u, e, w):  # type: ignore[no-untyped-def]
    """Return the changes of the parts of p along and across e, for a change u of p and a rotation w of e."""
    return dot(e, u) + _cross(e, p) * w, _cross(e, u) - dot(e, p) * w


@njit(error_model="numpy", forceinline=True)
def _mid_change(bent, along, across, dtau):  # type: ignore[no-untyped-def]
    """The changes of stretch and shear in the middle and of beta, when a, t and tau do so."""
    a, t, cosine, sine, _, _ = bent
    by_a, by_t, by_tau = _by(bent)
    turn = by_a * along + by_t * across + by_tau * dtau
    longer = cosine * along + sine * across + (t * cosine - a * sine) * turn
    return longer, cosine * across - sine * along - (a * cosine + t * sine) * turn, turn


@njit(error_model="numpy", forceinline=True)
def rates(z, v, inverse):  # type: ignore[no-untyped-def]
    """The rates of the strains, v being those of z."""
    e1, e2, p = _unit(z[4:6]), _unit(z[10:12]), _middle(z, inverse)
    m, w1, w2 = _unit(plus(e1, 1.0, e2)), dot(_by_angle(z[4:6]), v[4:6]), dot(_by_angle(z[10:12]), v[10:12])
    one, two = _seen(z[2:4], v[2:4], e1, w1), _seen(z[8:10], v[8:10], e2, w2)
    along, across = _seen(p, _middle(v, inverse), m, 0.5 * (w1 + w2))
    bent = _bent(p, m, 0.5 * (_cross(e1, z[2:4]) + _cross(e2, z[8:10])))
    longer, slid, turn = _mid_change(bent, along, across, 0.5 * (one[1] + two[1]))
    return (*one, longer, slid, *two, w2 - w1 + TURNED * turn, w2 - w1 - TURNED * turn)


@njit(error_model="numpy", forceinline=True)
def _node(s, e, axial, shear, stretch, slide):  # type: ignore[no-untyped-def]
    """At a node: energy, and the forces along e and across it; stretch, slide: free strains."""
    longer, slid = dot(e, s) - 1.0 - stretch, _cross(e, s) - slide
    return 0.5 * (axial * longer * longer + shear * slid * slid), axial * longer, shear * slid


@njit(error_model="numpy", forceinline=True)
def _back(p, e, along, across):  # type: ignore[no-untyped-def]
    """The derivatives by p and by the angle of e, of what changes so with the parts of p along e and across it."""
    return plus(times(along, e), across, _quarter(e)), along * _cross(e, p) - across * dot(e, p)


@njit(error_model="numpy", forceinline=True)
def _held(d, stiffness):  # type: ignore[no-untyped-def]
    """The energy of a director that is not of unit length, and its derivative."""
    square = dot(d, d)
    inverse = inverse_root(square)
    longer = square * inverse - 1.0
    return 0.5 * stiffness * longer * longer, times(stiffness * longer * inverse, d)


@njit(error_model="numpy", forceinline=True)
def _stresses(bent, phi, stiff, free):  # type: ignore[no-untyped-def]
    """In the middle: tension, shear force and the moments at the points of Gauss."""
    _, ea, ga, ei = stiff
    a, t, cosine, sine, beta, _ = bent
    force = AXIAL[1, 1] * ea * (a * cosine + t * sine - 1.0 - free[2])
    across = AXIAL[1, 1] * ga * (t * cosine - a * sine - free[3])
    first = BENDING[0, 1] * ei * (phi + TURNED * beta - free[6])
    return force, across, first, BENDING[1, 1] * ei * (phi - TURNED * beta - free[7])


@njit(error_model="numpy", forceinline=True)
def _by_parts(bent, force, across, first, second):  # type: ignore[no-untyped-def]
    """The derivatives of the energy by a, t and tau, and what turns beta."""
    a, t, cosine, sine, _, _ = bent
    by_a, by_t, by_tau = _by(bent)
    turn = force * (t * cosine - a * sine) - across * (a * cosine + t * sine) + TURNED * (first - second)
    by_a, by_t = force * cosine - across * sine + turn * by_a, force * sine + across * cosine + turn * by_t
    return by_a, by_t, turn * by_tau, turn


@njit(error_model="numpy", forceinline=True)
def gradient(z, stiff, free):  # type: ignore[no-untyped-def]
    """The energy of elements and its derivatives by their rows; stiff: 1/L, EA L, kappa G A L, EI/L."""
    inverse, ea, ga, ei = stiff
    s1, d1, s2, d2 = z[2:4], z[4:6], z[8:10], z[10:12]
    e1, e2, p = _unit(d1), _unit(d2), _middle(z, inverse)
    m, w = _unit(plus(e1, 1.0, e2)), AXIAL[0, 1]
    bent = _bent(p, m, 0.5 * (_cross(e1, s1) + _cross(e2, s2)))
    force, across, first, second = _stresses(bent, _between(e1, e2), stiff, free)
    squares = force * force / (AXIAL[1, 1] * ea) + across * across / (AXIAL[1, 1] * ga)
    squares = squares + (first * first + second * second) / (BENDING[0, 1] * ei)
    u1, f1, q1 = _node(s1, e1, w * ea, w * ga, free[0], free[1])
    u2, f2, q2 = _node(s2, e2, w * ea, w * ga, free[4], free[5])
    by_a, by_t, by_tau, _ = _by_parts(bent, force, across, first, second)
    by_p, by_m = _back(p, m, by_a, by_t)
    by_s1, by1 = _back(s1, e1, f1, q1 + 0.5 * by_tau)
    by_s2, by2 = _back(s2, e2, f2, q2 + 0.5 * by_tau)
    none = times(0.0, s1)
    g, g1, g2 = collect(AXIAL[1, 0], by_p, none, none, by_s1, by_s2)
    by1, by2 = by1 + 0.5 * by_m - first - second, by2 + 0.5 * by_m + first + second
    h1, n1 = _held(d1, 0.5 * ga)
    h2, n2 = _held(d2, 0.5 * ga)
    n1, n2 = plus(n1, by1, _by_angle(d1)), plus(n2, by2, _by_angle(d2))
    ends = times(inverse, g)
    return 0.5 * squares + u1 + u2 + h1 + h2, (-ends[0], -ends[1], *g1, *n1, *ends, *g2, *n2)


@njit(error_model="numpy", forceinline=True)
def _by_change(bent, along, across, dtau):  # type: ignore[no-untyped-def]
    """The changes of the derivatives of beta, when a, t and tau do so."""
    a, t, cosine, sine, _, size = bent
    g, grown = _short(a, t), a * along + t * across
    steep, steeper = 6.0 * g * g, -24.0 * g * grown
    _, _, turn = _mid_change(bent, along, across, dtau)
    smaller = -size * (cosine * (along - steep * grown) + sine * (across - dtau))
    by_a, by_t, by_tau = _by(bent)
    by_a = smaller * by_a + size * (cosine * turn * (steep * a - 1.0) + sine * (steeper * a + steep * along))
    turned = cosine * turn * steep * t - sine * turn
    by_t = smaller * by_t + size * (turned + sine * (steeper * t + steep * across))
    return by_a, by_t, smaller * by_tau + size * sine * turn


@njit(error_model="numpy", forceinline=True)
def _parts_change(bent, along, across, dtau, dphi, stiff, stresses):  # type: ignore[no-untyped-def]
    """The changes of the derivatives of `_by_parts` and of the moments, when a, t, tau and phi do so."""
    _, ea, ga, ei = stiff
    a, t, cosine, sine, _, _ = bent
    force, shear, _, _ = stresses
    _, _, _, moment = _by_parts(bent, *stresses)
    by_a, by_t, by_tau = _by(bent)
    dby_a, dby_t, dby_tau = _by_change(bent, along, across, dtau)
    longer, slid, turn = _mid_change(bent, along, across, dtau)
    dforce, dshear = AXIAL[1, 1] * ea * longer, AXIAL[1, 1] * ga * slid
    first, second = BENDING[0, 1] * ei * (dphi + TURNED * turn), BENDING[1, 1] * ei * (dphi - TURNED * turn)
    stretch, slide = a * cosine + t * sine, t * cosine - a * sine
    more = dforce * slide + force * slid - dshear * stretch - shear * longer + TURNED * (first - second)
    by_along = dforce * cosine - force * sine * turn - dshear * sine - shear * cosine * turn
    by_across = dforce * sine + force * cosine * turn + dshear * cosine - shear * sine * turn
    by_along, by_across = by_along + more * by_a + moment * dby_a, by_across + more * by_t + moment * dby_t
    return by_along, by_across, more * by_tau + moment * dby_tau, first + second


@njit(error_model="numpy", forceinline=True)
def _back_change(p, u, e, w, along, across, dalong, dacross):  # type: ignore[no-untyped-def]
    """Return the change of `_back` for a change u of p, a rotation w of e, and changes of along and across."""
    more, turn = _back(p, e, dalong, dacross)
    a, t = _seen(p, u, e, w)
    return plus(more, w, plus(times(along, _quarter(e)), -across, e)), turn + along * t - across * a


@njit(error_model="numpy", forceinline=True)
def _angle_change(s, u):  # type: ignore[no-untyped-def]
    """The change of `_by_angle` with that of s."""
    square = reciprocal(dot(s, s))
    return plus(times(square, _quarter(u)), -2.0 * dot(s, u) * square, _by_angle(s))


@njit(error_model="numpy", forceinline=True)
def _held_change(d, u, stiffness):  # type: ignore[no-untyped-def]
    """The change of what `_held` derives."""
    inverse = inverse_root(dot(d, d))
    t = times(inverse, d)
    grown = dot(t, u)
    return plus(times(stiffness * grown, t), stiffness * (1.0 - inverse), plus(u, -grown, t))


@njit(error_model="numpy", forceinline=True)
def _node_change(s, u, d, w, numbers, by_tau, dby_tau):  # type: ignore[no-untyped-def]
    """At a node: the changes of the derivatives by r' and by the angle of d, and the latter; numbers: see `_node`."""
    e = _unit(d)
    _, force, across = _node(s, e, *numbers)
    across = across + 0.5 * by_tau
    longer, slid = _seen(s, u, e, w)
    _, by = _back(s, e, force, across)
    axial, shear, _, _ = numbers
    more, turn = _back_change(s, u, e, w, force, across, axial * longer, shear * slid + 0.5 * dby_tau)
    return more, turn, by


@njit(error_model="numpy", forceinline=True)
def change(z, v, stiff, free):  # type: ignore[no-untyped-def]
    """Return the change of the derivatives of the energy for a change v of z: the stiffness times v."""
    inverse, ea, ga, _ = stiff
    s1, d1, s2, d2 = z[2:4], z[4:6], z[8:10], z[10:12]
    v1, v2, p, u = v[4:6], v[10:12], _middle(z, inverse), _middle(v, inverse)
    e1, e2, w = _unit(d1), _unit(d2), AXIAL[0, 1]
    m, w1, w2 = _unit(plus(e1, 1.0, e2)), dot(_by_angle(d1), v1), dot(_by_angle(d2), v2)
    bent = _bent(p, m, 0.5 * (_cross(e1, s1) + _cross(e2, s2)))
    stresses = _stresses(bent, _between(e1, e2), stiff, free)
    by_a, by_t, by_tau, _ = _by_parts(bent, *stresses)
    _, by_m = _back(p, m, by_a, by_t)
    mean = 0.5 * (w1 + w2)
    along, across = _seen(p, u, m, mean)
    dtau = 0.5 * (_seen(s1, v[2:4], e1, w1)[1] + _seen(s2, v[8:10], e2, w2)[1])
    dby_a, dby_t, dby_tau, moment = _parts_change(bent, along, across, dtau, w2 - w1, stiff, stresses)
    by_p, turn_m = _back_change(p, u, m, mean, by_a, by_t, dby_a, dby_t)
    by_s1, turn1, by1 = _node_change(s1, v[2:4], d1, w1, (w * ea, w * ga, free[0], free[1]), by_tau, dby_tau)
    by_s2, turn2, by2 = _node_change(s2, v[8:10], d2, w2, (w * ea, w * ga, free[4], free[5]), by_tau, dby_tau)
    none = times(0.0, s1)
    g, g1, g2 = collect(AXIAL[1, 0], by_p, none, none, by_s1, by_s2)
    bending = stresses[2] + stresses[3]
    by1, by2 = by1 + 0.5 * by_m - bending, by2 + 0.5 * by_m + bending
    turn1, turn2 = turn1 + 0.5 * turn_m - moment, turn2 + 0.5 * turn_m + moment
    n1 = plus(plus(_held_change(d1, v1, 0.5 * ga), turn1, _by_angle(d1)), by1, _angle_change(d1, v1))
    n2 = plus(plus(_held_change(d2, v2, 0.5 * ga), turn2, _by_angle(d2)), by2, _angle_change(d2, v2))
    ends = times(inverse, g)
    return (-ends[0], -ends[1], *g1, *n1, *ends, *g2, *n2)
