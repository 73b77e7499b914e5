"""Tangent of the branch of the motion at a singular position, and the rows that keep the acceleration on the branch.

At a singular position combinations u of constraints vanish (u' C_q = 0) and restrict the motion to higher order only.
Drives p(t) are coordinates as q is, so that all derivatives are those of the geometry C(q, p) of the machine. For
constraints that are quadratic in q, velocities satisfy u' (C_qq v v + C_pp p' p') = 0, the tangent cone of the
configuration space: one line for each branch of a linkage that crosses there. The acceleration then satisfies
u' C_qq x a = -u' C_pp p' p'', a linear row, with the tangent x = v; gears add to its right side. Along a branch all
derivatives by time have its direction to lowest order, so that rows hold near the singular position however slowly a
motion begins. Rows of constraints that are redundant everywhere vanish.

The velocity satisfies the cone up to round-off and truncation only. Near rest round-off is all of it, and the rows of
such a velocity would leave the machine no acceleration at all. So v is first projected onto the cone (Gauss-Newton on
u' C_qq x x / |x|^2 in the mass metric). At rest the tangent is the direction of the acceleration, which satisfies
u' (C_qq a a + C_pp p'' p'') = 0 by the fourth derivative: a fixed point of the tangent and the acceleration of least
constraint along it, sought from the minimiser first, then from other directions. Where no branch accelerates, the
machine stays at rest.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from shoal.mechanics import constraints, functions
from shoal.mechanics.derived import derive
from shoal.mechanics.least import crossing, projection
from shoal.mechanics.least.many import STILL
from shoal.mechanics.least.work import GaussWork, LaneWork
from shoal.mechanics.model import Arrays
from shoal.mechanics.numerics import sparse
from shoal.mechanics.numerics.tile import Array, Tile

ROUNDS = 30
"""Iterations at most of the projection onto the cone, and of tangent and acceleration at rest."""
ROUND_OFF = 1e-14
"""A distance from the cone that is none."""
GONE = 1e-11
"""What is left of a row that is redundant everywhere, as a part of its length."""
ON_CONE = 1e-3
"""Largest distance from the cone of a tangent of a branch."""
AWAY = 0.1
"""A velocity that its projection changes by more than this fraction is round-off where the machine hardly moves."""
FAR = 1e3
"""Distance of a start, relative to what drives ask for, from which Newton's method ends at the outer root of its side;
it halves each time, ten of ROUNDS."""
SLOWEST = 1e-9
"""Acceleration along a branch, relative to that without its rows, that is none."""
SETTLED = 1e-9
"""Relative change of the acceleration at which the fixed point at rest has converged."""
VELOCITY, ACCELERATION = 1, 2
"""What the tangent is: the derivative of the coordinates of this order."""


@njit(cache=True, error_model="numpy")
def is_real(tile: Tile, m: Arrays, w: GaussWork, s: LaneWork, t: float, v: Array, lane: int, first: int) -> bool:
    """Return whether branches of the motion of one lane cross at the singular position near it; see `crossing`.

    first: rank of the constraints, beyond which s.rows holds the remainders of the dependent ones. C is in w.residual.
    At rest the tangent is not known, and branches are taken to cross.
    """
    width, n, c = len(tile), m.unknowns, m.constraints
    for number in range(first, c.size):
        square = projection.dot(s.rows[number], s.rows[number])
        if not square > GONE**2:
            continue
        projection.dependence(number, first, s.triangle, s.norms, s.order, s.shift)
        constraints.jacobian(tile, c, v, 0.0, w.turning)
        crossing.turn(tile, m, w, s.shift, lane, w.extra)
        pace, largest = constraints.pace(tile, c, s.shift, v, lane), _largest(width, n, lane, w.extra)
        sparse.forward(tile, m.pattern, m.mass_factor, m.mass_root, w.extra, 0)
        if not (largest > STILL * pace and _is_new(width, n, lane, first, s, w.extra, projection.NEW * pace / largest)):
            continue
        for i in range(n):
            w.branch[i * width + lane] = s.rows[number, i]
        sparse.backward(tile, m.pattern, m.mass_factor, m.mass_root, w.branch, 0)
        if not crossing.crosses(tile, m, w, t, v, lane, s.shift, square):
            return False
    return True


@njit(cache=True, error_model="numpy")
def _combine(tile: Tile, m: Arrays, w: GaussWork, s: LaneWork, lane: int, first: int, rank: int, part: Array) -> None:
    """Put the sum of the basis rows from `first` on, times these parts, into w.extra as a change of the coordinates."""
    for i in range(m.unknowns):
        total = 0.0
        for j in range(first, rank):
            total += part[j] * s.rows[j, i]
        w.extra[i * len(tile) + lane] = total
    sparse.backward(tile, m.pattern, m.mass_factor, m.mass_root, w.extra, 0)


@njit(cache=True, error_model="numpy")
def power(tile: Tile, m: Arrays, w: GaussWork, s: LaneWork, v: Array, lane: int, first: int, rank: int) -> float:
    """Return the power [W] of the rows from `first` on, whose changes are in s.wanted: a part of the work of drives."""
    _combine(tile, m, w, s, lane, first, rank, s.wanted)
    return crossing.power(tile, m, w, v, w.extra, lane)  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy", forceinline=True)
def follow(
    tile: Tile,
    m: Arrays,
    w: GaussWork,
    s: LaneWork,
    t: float,
    q: Array,
    v: Array,
    forces: Array,
    lane: int,
    first: int,
    tolerance: float,
) -> tuple[int, bool]:
    """Add the rows of the branch of one lane to the orthonormal basis of its constraints.

    forces: D^-1/2 L^-1 Q (unknowns, lanes). first: rank of the constraints, whose components are in s.wanted.
    tolerance: distance from a singular position below which third derivatives apply.
    Returns the new rank, and whether no branch passes: then nothing accelerates but along the constraints.
    """
    width, n = len(tile), m.unknowns
    # Numbers of any value: Numba would compile `_rows` once for each constant that it is called with.
    velocity, approaching = np.int64(VELOCITY), np.bool_(True)
    speed = 0.0
    for i in range(n):
        w.branch[i * width + lane] = v[i * width + lane]
        speed = max(speed, abs(v[i * width + lane]))
    if speed > 0.0:
        for k in range(m.constraints.size):
            s.shift[k] = 0.0
        rank, off = _rows(tile, m, w, s, t, q, lane, first, velocity, approaching, s.shift)
        if rank == first and off <= ON_CONE:
            return first, False  # redundant everywhere
        _meet(tile, m, w, s, t, lane, first)
        rank, off = _approach(tile, m, w, s, t, q, lane, first, velocity)
        away = _difference(width, n, lane, w.branch, v)
        if off > ON_CONE or away > AWAY * speed:
            _accelerate(tile, m, w, s, forces, lane, first)
            if speed * speed < tolerance * _largest(width, n, lane, w.extra):
                speed = 0.0
        if speed > 0.0:
            rank, _ = _rows(tile, m, w, s, t, q, lane, first, velocity, not approaching, s.wanted)
            return rank, False
    _accelerate(tile, m, w, s, forces, lane, first)
    size = _largest(width, n, lane, w.extra)
    driven = _is_driven(m, t, np.int64(ACCELERATION))
    for seed in range(-1, 2 * n if driven else n):
        if driven:  # the drive sets how fast: what is free is only added
            _combine(tile, m, w, s, lane, np.int64(0), first, s.wanted)
            size = _largest(width, n, lane, w.extra)
            for i in range(n):
                w.branch[i * width + lane] = w.extra[i * width + lane]
        if seed >= 0:
            _direct(tile, m, w, s, lane, first, seed % n)
        if driven and seed >= 0:
            free = _largest(width, n, lane, w.extra)
            share = (FAR if seed < n else -FAR) * size / free if free > 0.0 else 0.0
            for i in range(n):
                w.extra[i * width + lane] = w.branch[i * width + lane] + share * w.extra[i * width + lane]
        rank, off = _settle(tile, m, w, s, t, q, forces, lane, first, 0.0 if driven else SLOWEST * size)
        if off <= ON_CONE:
            return rank, False
    return first, True


@njit(cache=True, error_model="numpy")
def _settle(
    tile: Tile,
    m: Arrays,
    w: GaussWork,
    s: LaneWork,
    t: float,
    q: Array,
    forces: Array,
    lane: int,
    first: int,
    least: float,
) -> tuple[int, float]:
    """Find the tangent along which a machine at rest accelerates, from a direction in w.extra.

    Returns the rank with its rows, and how far from the cone it is; infinite where it accelerates by less than `least`.
    """
    width, n = len(tile), m.unknowns
    rank, off, order = first, 0.0, np.int64(ACCELERATION)
    for _ in range(ROUNDS):
        for i in range(n):
            w.branch[i * width + lane] = w.extra[i * width + lane]
        rank, off = _approach(tile, m, w, s, t, q, lane, first, order)
        if off > ON_CONE:
            break
        rank, _ = _rows(tile, m, w, s, t, q, lane, first, order, np.bool_(False), s.wanted)
        _accelerate(tile, m, w, s, forces, lane, rank)
        size = _largest(width, n, lane, w.extra)
        if not size > least:
            return first, np.inf
        if _difference(width, n, lane, w.branch, w.extra) <= SETTLED * size:
            break
    return rank, off


@njit(cache=True, error_model="numpy")
def _direct(tile: Tile, m: Arrays, w: GaussWork, s: LaneWork, lane: int, first: int, number: int) -> None:
    """Put a direction that the constraints leave free into w.extra: what they leave of one coordinate."""
    width, n = len(tile), m.unknowns
    for i in range(n):
        w.extra[i * width + lane] = 1.0 if i == number else 0.0
        for j in range(first):
            w.extra[i * width + lane] -= s.rows[j, number] * s.rows[j, i]
    sparse.backward(tile, m.pattern, m.mass_factor, m.mass_root, w.extra, 0)


@njit(cache=True, error_model="numpy")
def _meet(tile: Tile, m: Arrays, w: GaussWork, s: LaneWork, t: float, lane: int, first: int) -> None:
    """Bring the tangent in w.branch on to C_q x = -C_t, which rates inside a step of an integrator miss."""
    width, c = len(tile), m.constraints
    for k in range(c.size):
        total = constraints.driven(c, m.functions, k, t, 1)
        for e in range(c.entry[k], c.entry[k + 1]):
            total += w.jacobian[e * width + lane] * w.branch[c.column[e] * width + lane]
        s.weights[k] = -total
    projection.components(first, s.triangle, s.norms, s.order, s.weights, s.shift)
    _combine(tile, m, w, s, lane, np.int64(0), first, s.shift)
    for i in range(lane, m.unknowns * width, width):
        w.branch[i] += w.extra[i]


@njit(cache=True, error_model="numpy")
def _approach(
    tile: Tile, m: Arrays, w: GaussWork, s: LaneWork, t: float, q: Array, lane: int, first: int, order: int
) -> tuple[int, float]:
    """Project the tangent in w.branch onto the cone; returns the rank with its rows, and the distance from the cone."""
    width, n = len(tile), m.unknowns
    rank, off, before = first, 0.0, 0.0
    for number in range(ROUNDS):
        for k in range(m.constraints.size):
            s.shift[k] = 0.0
        before = off
        rank, off = _rows(tile, m, w, s, t, q, lane, first, order, np.bool_(True), s.shift)
        if rank == first or off <= ROUND_OFF or (number > 0 and off <= projection.NEW and off > 0.1 * before):
            break
        _combine(tile, m, w, s, lane, first, rank, s.shift)
        step, size = _largest(width, n, lane, w.extra), _largest(width, n, lane, w.branch)
        part = min(1.0, size / step) if step > 0.0 else 0.0
        for i in range(n):
            w.branch[i * width + lane] += part * w.extra[i * width + lane]
    return rank, off


@njit(cache=True, error_model="numpy")
def _rows(
    tile: Tile,
    m: Arrays,
    w: GaussWork,
    s: LaneWork,
    t: float,
    q: Array,
    lane: int,
    first: int,
    order: int,
    approaching: bool,
    wanted: Array,
) -> tuple[int, float]:
    """Extend the basis by the rows u' C_qq x of the tangent x in w.branch.

    Returns the new rank and the distance of x from the cone, relative to the size of its terms.
    order: VELOCITY or ACCELERATION. approaching: the targets, which go into `wanted`, bring the tangent onto the cone;
    otherwise they are those of the acceleration. Where no drive moves, x is known up to its length, and rows are taken
    of u' C_qq x x / |x|^2, whose gradient vanishes along x.
    """
    width, n, count, c = len(tile), m.unknowns, m.constraints.size, m.constraints
    derive(tile, m.derived, w.branch, n, m.held_rows, True)
    constraints.jacobian(tile, c, w.branch, 0.0, w.turning)
    driven, square = _is_driven(m, t, order), 0.0
    for i in range(n):
        square += w.branch[i * width + lane] ** 2
    size = _largest(width, n, lane, w.branch)
    rank, off = first, 0.0
    for number in range(first, count):
        projection.dependence(number, first, s.triangle, s.norms, s.order, s.weights)
        bend, kick = 0.0, 0.0
        for k in range(count):
            bend += s.weights[k] * constraints.curvature(c, m.functions, k, t, order, order)
            kick += s.weights[k] * constraints.third_derivative(tile, c, m.functions, k, t, q, w.branch, lane)
        crossing.turn(tile, m, w, s.weights, lane, w.extra)
        pace = constraints.pace(tile, c, s.weights, w.branch, lane)
        if not _largest(width, n, lane, w.extra) > STILL * pace:
            continue
        value = 0.0
        for i in range(n):
            value += w.extra[i * width + lane] * w.branch[i * width + lane]
            w.moved[i * width + lane] = w.extra[i * width + lane]
        # What is left of a row counts beside the tangent that it is made of, whose round-off it has.
        share = projection.NEW * pace / _largest(width, n, lane, w.extra)
        sparse.forward(tile, m.pattern, m.mass_factor, m.mass_root, w.extra, 0)
        if not _is_new(width, n, lane, first, s, w.extra, share):
            continue
        off = max(off, abs(value + bend) / (pace * size))
        share *= _largest(width, n, lane, w.moved)
        for i in range(n):
            along = 0.0 if driven else value / square * w.branch[i * width + lane]
            w.extra[i * width + lane] = w.moved[i * width + lane] - along
        if approaching:
            target = -0.5 * (value + bend)
        elif order == VELOCITY:
            target = -kick
        else:
            target = value if driven else 0.0
        share /= _largest(width, n, lane, w.extra)
        sparse.forward(tile, m.pattern, m.mass_factor, m.mass_root, w.extra, 0)
        for i in range(n):
            s.row[i] = w.extra[i * width + lane]
        rank = projection.extend(rank, s.rows, wanted, s.row, target, share)
    return rank, off


@njit(cache=True, error_model="numpy")
def _is_driven(m: Arrays, t: float, order: int) -> bool:
    """Return whether a drive moves, so that the tangent has its length by it; order: VELOCITY or ACCELERATION."""
    for k in range(m.constraints.size):
        if functions.evaluate(m.functions, m.constraints.drive[k], t, order) != 0.0:
            return True
    return False


@njit(cache=True, error_model="numpy", forceinline=True)
def _is_new(width: int, n: int, lane: int, first: int, s: LaneWork, row: Array, share: float) -> bool:
    """Return whether more than this share of a row of one lane is independent of the constraints."""
    for i in range(n):
        s.row[i] = row[i * width + lane]
    length = projection.dot(s.row, s.row)
    for j in range(first):
        part = projection.dot(s.rows[j], s.row)
        for i in range(n):
            s.row[i] -= part * s.rows[j, i]
    return projection.dot(s.row, s.row) > share * share * length  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy")
def _accelerate(tile: Tile, m: Arrays, w: GaussWork, s: LaneWork, forces: Array, lane: int, rank: int) -> None:
    """The acceleration of one lane by the rows of the basis so far, into w.extra."""
    width, n = len(tile), m.unknowns
    for i in range(n):
        s.row[i] = forces[i * width + lane]
    for j in range(rank):
        gap = s.wanted[j] - projection.dot(s.rows[j], s.row)
        for i in range(n):
            s.row[i] += gap * s.rows[j, i]
    for i in range(n):
        w.extra[i * width + lane] = s.row[i]
    sparse.backward(tile, m.pattern, m.mass_factor, m.mass_root, w.extra, 0)


@njit(cache=True, error_model="numpy", forceinline=True)
def _largest(width: int, n: int, lane: int, x: Array) -> float:
    """The largest entry of one lane by size."""
    largest = 0.0
    for i in range(n):
        largest = max(largest, abs(x[i * width + lane]))
    return largest


@njit(cache=True, error_model="numpy", forceinline=True)
def _difference(width: int, n: int, lane: int, x: Array, y: Array) -> float:
    """The largest difference of entries of one lane."""
    largest = 0.0
    for i in range(n):
        largest = max(largest, abs(x[i * width + lane] - y[i * width + lane]))
    return largest
