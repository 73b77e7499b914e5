"""Test of whether branches of the motion cross at a singular position, as third derivatives of constraints assume.

That is a property of the machine and not of where it is. Near the singular position x_s the combination of constraints
whose gradient vanishes there is u'C = c + 1/2 (x - x_s)' H (x - x_s), H = u'C_qq. If c is zero, branches cross; if not,
they are the arms of hyperbolas, and the motion stays on its own, however sharp its turn is. Such a machine is regular
everywhere, as a four-bar that has not quite the lengths of a parallelogram, and its constraints define its motion.

At a position near x_s the gradient l = H (x - x_s) is the remainder of a row that depends on others, at right angles to
the velocity v. In the plane of both c = -1/2 |l|^4 v'Hv / (v'Hv l'Hl - (v'Hl)^2), as u'C = 0. It is compared with the
round-off of the constraints. Where both terms of the divisor cancel, the position is beyond what H describes, and the
larger one counts.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from shoal.mechanics import constraints
from shoal.mechanics.derived import derive
from shoal.mechanics.least.work import GaussWork
from shoal.mechanics.model import Arrays
from shoal.mechanics.numerics import sparse
from shoal.mechanics.numerics.tile import Array, Tile

INEXACT = 4e-9
"""Round-off of a constraint, as a part of the violation `constraints.OPEN` times its size: 18 eps of its terms.

Lengths that are stated to 16 digits leave 1 to 5 eps of it (parallelograms and kites of decimal lengths)."""


@njit(cache=True, error_model="numpy")
def momentum(tile: Tile, m: Arrays, w: GaussWork, v: Array) -> None:
    """Put M v, of the regularised mass matrix, into w.moved."""
    sparse.multiply(tile, m.pattern, m.mass, v, w.moved)
    if m.refinements > 0:
        sparse.multiply(tile, m.pattern, m.lent, v, w.lent)
        for i in range(m.unknowns * len(tile)):
            w.moved[i] += w.lent[i]


@njit(cache=True, error_model="numpy", forceinline=True)
def power(tile: Tile, m: Arrays, w: GaussWork, v: Array, change: Array, lane: int) -> float:
    """Return the power v'M da [W] of forces that have changed the acceleration of one lane by da."""
    width, total = len(tile), 0.0
    momentum(tile, m, w, v)
    for i in range(lane, m.unknowns * width, width):
        total += w.moved[i] * change[i]
    return total


@njit(cache=True, error_model="numpy", forceinline=True)
def turn(tile: Tile, m: Arrays, w: GaussWork, weights: Array, lane: int, out: Array) -> None:
    """The sum of the rows of dC_q/dt in w.turning with these weights, in one lane of (unknowns, lanes)."""
    width, c = len(tile), m.constraints
    for i in range(m.unknowns * width):
        out[i] = 0.0
    for k in range(c.size):
        for e in range(c.entry[k], c.entry[k + 1]):
            out[c.column[e] * width + lane] += weights[k] * w.turning[e * width + lane]


@njit(cache=True, error_model="numpy")
def crosses(tile: Tile, m: Arrays, w: GaussWork, t: float, v: Array, lane: int, weights: Array, square: float) -> bool:
    """Return whether branches of the motion of one lane cross near it where u'C, u the weights, is singular.

    square: |l|^2 in the metric of the inverse mass matrix, with M^-1 l in w.branch. C is in w.residual, dC_q/dt of v in
    w.turning, and is replaced. Drives p are one more coordinate, along p': v becomes (v, 1) and l (l, u'C_p p').
    """
    width, c, n = len(tile), m.constraints, m.unknowns
    speed = np.sqrt(power(tile, m, w, v, v, lane))
    round_off, rate, bend = 0.0, 0.0, 0.0
    for k in range(c.size):
        round_off += abs(weights[k]) * (abs(w.residual[k * width + lane]) + INEXACT * c.open[k * width + lane])
        rate += weights[k] * constraints.driven(c, m.functions, k, t, 1) / speed
        bend += weights[k] * constraints.curvature(c, m.functions, k, t, 1, 1) / speed**2
    along, mixed, across = bend, bend * rate, bend * rate**2
    turn(tile, m, w, weights, lane, w.moved)
    for i in range(lane, n * width, width):
        along += w.moved[i] * v[i] / speed**2
        mixed += w.moved[i] * w.branch[i] / speed
    derive(tile, m.derived, w.branch, n, m.held_rows, True)
    constraints.jacobian(tile, c, w.branch, 0.0, w.turning)
    turn(tile, m, w, weights, lane, w.moved)
    for i in range(lane, n * width, width):
        across += w.moved[i] * w.branch[i]
    whole, curved = square + rate**2, max(abs(mixed**2 - along * across), mixed**2)
    return not whole**2 * abs(along) > 2.0 * round_off * curved
