"""Gauss's principle of least constraint, in the metric of the mass matrix.

The true acceleration minimises 1/2 (M a - Q)' M^-1 (M a - Q) subject to C_q a = -eta (paper, eq. 16). How the
minimiser is found is one of METHODS; `projection` is the default and the only one that is right at singular positions.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from shoal.compile.simd import EIGHT
from shoal.errors import InputError
from shoal.mechanics import constraints
from shoal.mechanics.derived import derive
from shoal.mechanics.least import alternatives, branch, lent, many, projection, together
from shoal.mechanics.least.branch import GONE
from shoal.mechanics.least.work import HERE, GaussWork, lane_work, load_lane, rows
from shoal.mechanics.model import Arrays
from shoal.mechanics.numerics import sparse
from shoal.mechanics.numerics.tile import Array, Tile

LEAVING = 3.0
"""A singular position is left this much farther away than it is entered: the distance depends on the order of pivots,
and steps would end at every change between the two ways to the acceleration."""
PROJECTION, BAUMGARTE = 0, 4
METHODS = {
    "projection": PROJECTION,
    "kkt": alternatives.KKT,
    "augmented-lagrangian": alternatives.AUGMENTED,
    "proximal": alternatives.PROXIMAL,
    "baumgarte": BAUMGARTE,
}
"""Ways to the acceleration, unless somebody else seeks it; see `kernels.Seek`."""


def method(name: str) -> int:
    """The number of a way to the acceleration. Raises InputError."""
    if name not in METHODS:
        raise InputError(f"solver.acceleration: the mechanics knows no {name!r}; there are {', '.join(METHODS)}")
    return METHODS[name]


@njit(cache=True, error_model="numpy", forceinline=True)
def state(tile: Tile, m: Arrays, w: GaussWork, t: float, q: Array, v: Array) -> None:
    """C_q into w.jacobian and eta into w.gap at a state, whose derived rows are filled."""
    derive(tile, m.derived, q, m.unknowns, m.held_rows, False)
    derive(tile, m.derived, v, m.unknowns, m.held_rows, True)
    constraints.jacobian(tile, m.constraints, q, 1.0, w.jacobian)
    constraints.bias(tile, m.constraints, m.functions, t, v, w.gap)


@njit(cache=True, error_model="numpy", forceinline=True)
def constrain(tile: Tile, m: Arrays, w: GaussWork, t: float, q: Array, v: Array, a: Array, tolerance: float) -> None:
    """Turn the forces Q in `a` into the true acceleration; the multipliers go into w.multiplier.

    tolerance: distance from a singular position, relative to a row's length, below which third derivatives take over.
    Those define the acceleration up to the distance d itself, the constraints up to eps/d^2: round-off eps
    in C_q v leaves the rate of the weakest direction uncertain by eps/d, and its acceleration by that over d. So the
    best tolerance is about the cube root of eps.
    """
    state(tile, m, w, t, q, v)
    for lane in range(len(tile)):
        w.power[lane] = 0.0
    if m.saddle.size > 0 and m.method == PROJECTION and many.constrain(tile, m, w, t, q, v, a):
        return
    width = len(tile)
    s = lane_work(m, w)
    rows(tile, m, w)
    sparse.forward(tile, m.pattern, m.mass_factor, m.mass_root, a, 0)
    if m.method == BAUMGARTE:
        _stabilise(tile, m, w, t, q, v)
    count, n, alone = m.constraints.size, m.unknowns, 0
    orthogonal = m.method == PROJECTION or m.method == BAUMGARTE
    turned, measured = False, False
    for lane in range(width):
        if width % len(EIGHT) == 0 and lane % len(EIGHT) == 0 and orthogonal:
            rank = together.orthonormalise(w.group, count, n, width, lane, w.response, tolerance)
            if 0 <= rank < count:
                turned = turned or _turn(tile, m, w, v)
                rank = rank if _are_redundant(tile, m, w, v, lane, rank) else together.ALONE
            if rank != together.ALONE:
                together.raise_closeness(w.group, rank, count, lane, w.closeness)
                for k in range(lane, lane + len(EIGHT)):
                    w.near[k] = 0.0
                together.move(w.group, rank, count, n, width, lane, w.gap, a)
                lent.take_back_from_group(tile, m, w, lane, rank, a)
                together.multipliers(w.group, rank, count, width, lane, w.multiplier)
                alone = lane + len(EIGHT)
        if lane < alone:
            continue
        load_lane(width, lane, m, w, s, a)
        for k in range(count):
            s.weights[k] = -w.gap[k * width + lane]
        if orthogonal:
            near = tolerance * (LEAVING if w.near[lane] == HERE else 1.0)
            rank = projection.orthonormalise(s.rows, s.triangle, s.norms, s.order, near)
            left = projection.left(rank, s.rows)
            if left > GONE:
                turned, measured = False, measured or _measure(tile, m, w, t, q)
                if not branch.is_real(tile, m, w, s, t, v, lane, rank):
                    load_lane(width, lane, m, w, s, a)
                    rank = projection.orthonormalise(s.rows, s.triangle, s.norms, s.order, GONE)
                    left = projection.left(rank, s.rows)
            w.near[lane] = HERE if left > GONE else 0.0
            first = rank
            projection.components(rank, s.triangle, s.norms, s.order, s.weights, s.wanted)
            locked = False
            if rank < count:
                turned = False
                rank, locked = branch.follow(tile, m, w, s, t, q, v, a, lane, rank, tolerance)
                w.near[lane] = HERE if locked or rank > first else w.near[lane]
            distance = s.triangle[first - 1, first - 1] if first > 0 else 1.0
            if w.near[lane] == HERE:
                distance = max(left, GONE)
            w.closeness[lane] = max(w.closeness[lane], 1.0 / distance**2)
            projection.move(rank, s.rows, s.wanted, s.y)
            lent.take_back_from_lane(tile, m, w, s, lane, rank, orthogonal)
            if locked:
                projection.confine(rank, s.rows, s.y, s.row)
            if m.driven and rank > first:
                w.power[lane] = branch.power(tile, m, w, s, v, lane, first, rank)
            projection.multipliers(first, s.triangle, s.norms, s.order, s.wanted, s.weights)
        else:
            projection.clear(s.wanted)
            alternatives.prepare(m.method, s.rows, s.triangle, s.norms)
            alternatives.correct(m.method, s.rows, s.weights, s.triangle, s.norms, s.wanted, s.y)
            lent.take_back_from_lane(tile, m, w, s, lane, np.int64(0), orthogonal)
            for k in range(count):
                s.weights[k] = s.wanted[k] * s.norms[k]
        for i in range(m.unknowns):
            a[i * width + lane] = s.y[i]
        for k in range(count):
            w.multiplier[k * width + lane] = s.weights[k]
    sparse.backward(tile, m.pattern, m.mass_factor, m.mass_root, a, 0)


@njit(cache=True, error_model="numpy")
def _turn(tile: Tile, m: Arrays, w: GaussWork, v: Array) -> bool:
    """dC_q/dt into w.turning."""
    constraints.jacobian(tile, m.constraints, v, 0.0, w.turning)
    return True


@njit(cache=True, error_model="numpy")
def _measure(tile: Tile, m: Arrays, w: GaussWork, t: float, q: Array) -> bool:
    """C into w.residual."""
    constraints.residual(tile, m.constraints, m.functions, t, q, w.residual)
    return True


@njit(cache=True, error_model="numpy")
def _are_redundant(tile: Tile, m: Arrays, w: GaussWork, v: Array, lane: int, rank: int) -> bool:
    """Return whether the rows of a group beyond a rank add nothing by third derivatives; dC_q/dt is in w.

    At rest those vanish and say nothing.
    """
    c, n, width = m.constraints, m.unknowns, len(tile)
    for k in range(lane, lane + len(EIGHT)):
        moving = 0.0
        for i in range(n):
            moving += abs(v[i * width + k])
        if moving == 0.0:
            return False
    for number in range(rank, c.size):
        if not together.third_derivative(c, w.group, rank, number, n, width, lane, v, w.turning, many.STILL, w.extra):
            sparse.forward(tile, m.pattern, m.mass_factor, m.mass_root, w.extra, 0)
            if not together.depends(w.group, rank, n, width, lane, w.extra, projection.NEW):
                return False
    return True


@njit(cache=True, error_model="numpy")
def _stabilise(tile: Tile, m: Arrays, w: GaussWork, t: float, q: Array, v: Array) -> None:
    """Baumgarte 1972: C'' + 2 alpha C' + alpha^2 C = 0 in place of C'' = 0."""
    width = len(tile)
    c = m.constraints
    constraints.residual(tile, c, m.functions, t, q, w.multiplier)
    for i in range(c.size * width):
        w.gap[i] += m.baumgarte * m.baumgarte * w.multiplier[i]
    constraints.rates(tile, c, m.functions, t, w.multiplier)
    constraints.add_product(tile, c, w.jacobian, v, w.multiplier)
    for i in range(c.size * width):
        w.gap[i] += 2.0 * m.baumgarte * w.multiplier[i]
