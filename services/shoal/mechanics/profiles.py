"""Outlines of bodies in the plane as chains of features: edges and the convex corners between them, or parts of cams.

A body that is no farther than its radius from the chain touches one feature of it. The gap is smooth within a feature,
and its second derivative jumps from one to the next, so that a closed contact keeps its feature, with the edge longer
than it is, until an event. A chain ends at concave corners, where two contacts may be closed at once: it is longer
there as far as the next edge goes, beyond which its end is a point.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.mechanics import cams
from shoal.mechanics.numerics.tile import Array, Flags, Index

EDGE, CORNER, SEGMENT = 0, 1, 2
PLACE, ALONG, LENGTH, BEFORE, AFTER = 0, 2, 4, 5, 8
"""Numbers of an edge: its begin, its unit direction, its length, and of the edges before and after it, where the corner
is concave, the unit direction away from there and the length (of that before with a minus sign), else 0. Of a corner
its place, and the unit directions of the edges before it (ALONG) and after it (AFTER). Those of a segment are in
`cams`."""
SIZE = 11
BESIDE = 2
"""Features on either side of one that touches whose contacts are the same one."""
ROUND_OFF = 1e-9
"""Part of an edge by which a place over it may be beside it, or behind it: a million times round-off."""
ENDLESS = 1e9
"""Way [m] to the end of a feature that has none, and distance from no feature."""


class Profiles(NamedTuple):
    """Chains of features, those of each pair of surfaces that has one.

    begin, length: the first feature and how many there are, by pair. closed: whether the last one leads to the first.
    twin: the way from the number of a pair to that of another one on the same chain, or 0. outline: the first and the
    last but one of the features of all chains of the body, two a pair. kind: of every feature;
    numbers: `SIZE` each [m].
    """

    begin: Index
    length: Index
    closed: Index
    twin: Index
    outline: Index
    kind: Index
    numbers: Array


@njit(cache=True, error_model="numpy")
def _is_behind(p: Profiles, pair: int, x: float, y: float, away: float) -> bool:
    """Return whether a place is in the body, and no edge of its outline is nearer than `away`: it has come in there.

    The body is on the side of the outline that is not free, by the edges that a ray upwards crosses.
    """
    solid, around, least, longest = False, 0.0, np.inf, 0.0
    for k in range(p.outline[2 * pair], p.outline[2 * pair + 1]):
        if p.kind[k] == EDGE:
            at = SIZE * k
            begin, other = p.numbers[at + PLACE], p.numbers[at + PLACE + 1]
            tx, ty, length = p.numbers[at + ALONG], p.numbers[at + ALONG + 1], p.numbers[at + LENGTH]
            around += (begin * ty - other * tx) * length
            if (begin <= x) != (begin + tx * length <= x) and y < other + (x - begin) / tx * ty:
                solid = not solid
            share = min(max((x - begin) * tx + (y - other) * ty, 0.0), length)
            least = min(least, np.hypot(x - begin - share * tx, y - other - share * ty))
            longest = max(longest, length)
    return solid == (around > 0.0) and away <= least + ROUND_OFF * longest


@njit(cache=True, error_model="numpy")
def _goes_on(p: Profiles, pair: int, after: int, x: float, y: float, end_x: float, end_y: float) -> bool:
    """Return whether the line of an edge counts at a place beyond a concave end: over the edge there, and in the body.

    after: where the numbers of that edge are
    """
    dx, dy = x - end_x, y - end_y
    along = dx * p.numbers[after] + dy * p.numbers[after + 1]
    across = dx * p.numbers[after + 1] - dy * p.numbers[after]  # to the right of the way
    length = p.numbers[after + 2]
    size, height = abs(length), across if length > 0.0 else -across
    beside = -ROUND_OFF * size <= along <= size
    # In the body it has come in here where either edge is the nearest one.
    away = min(np.hypot(dx, dy), abs(across) if beside else np.inf)
    return (beside and height >= -ROUND_OFF * size) or _is_behind(p, pair, x, y, away)  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy")
def nearest(p: Profiles, pair: int, x: float, y: float, other: int) -> int:
    """Return the feature nearest to a place in the axes of the body.

    other: a feature of the same chain, which it and those beside it are not, or -1
    """
    first, count, found, least = p.begin[pair], p.length[pair], -1, np.inf
    if p.kind[first] == SEGMENT:
        return cams.nearest(p.numbers, first, count, SIZE, x, y)  # type: ignore[no-any-return]
    for k in range(count):
        if p.kind[first + k] != EDGE or (other >= 0 and abs(k - other) <= BESIDE):
            continue
        at = SIZE * (first + k)
        tx, ty, length = p.numbers[at + ALONG], p.numbers[at + ALONG + 1], p.numbers[at + LENGTH]
        dx, dy = x - p.numbers[at + PLACE], y - p.numbers[at + PLACE + 1]
        share = dx * tx + dy * ty
        inside = min(max(share, 0.0), length)
        away = np.hypot(dx - inside * tx, dy - inside * ty)
        if away < least:
            beside = k
            if share < 0.0 and (k > 0 or p.closed[pair] > 0):
                beside = (k - 1) % count
            elif share > length and (k < count - 1 or p.closed[pair] > 0):
                beside = (k + 1) % count
            if other < 0 or abs(beside - other) > BESIDE:
                found, least = beside, away
    return found


@njit(cache=True, error_model="numpy", forceinline=True)
def _from_corner(x, y):  # type: ignore[no-untyped-def]
    """Return the distance of a place at (x, y) from a corner, and the direction, as complex numbers."""
    size = np.sqrt(x * x + y * y)
    if size.real > 0.0:  # complex numbers cannot be divided by zero
        return size, x / size, y / size
    return size, 0j, 0j


@njit(cache=True, error_model="numpy")
def touch(p, pair, feature, kept, x, y):  # type: ignore[no-untyped-def]
    """Return the distance of a place from a feature, the normal there, and the way left to the feature's end.

    kept: whether the feature may be longer than it is; else a place behind its edge may be on another side of the body.
    x, y: in the axes of the body, as complex numbers whose imaginary parts are in proportion to the rates. The way [m]
    is that to the end towards which the place moves; last 1 or -1 where that is the feature after or before it.
    """
    if feature < 0:
        return complex(ENDLESS, 0.0), 1.0 + 0j, 0j, ENDLESS, 1.0
    k = p.begin[pair] + feature
    at = SIZE * k
    if p.kind[k] == SEGMENT:
        return cams.touch(p.numbers, at, x, y)
    begin_x, begin_y = p.numbers[at + PLACE], p.numbers[at + PLACE + 1]
    tx, ty = p.numbers[at + ALONG], p.numbers[at + ALONG + 1]
    dx, dy = x - begin_x, y - begin_y
    if p.kind[k] == CORNER:
        size, nx, ny = _from_corner(dx, dy)
        behind = dx.real * tx + dy.real * ty
        ahead = -(dx.real * p.numbers[at + AFTER] + dy.real * p.numbers[at + AFTER + 1])
        # Forwards is the normal turned by 90 degrees.
        forwards = nx.real * dy.imag - ny.real * dx.imag > 0.0
        return size, nx, ny, (ahead if forwards else behind), (1.0 if forwards else -1.0)
    share, length = dx * tx + dy * ty, p.numbers[at + LENGTH]
    begins, ends = p.numbers[at + BEFORE + 2] == 0.0, p.numbers[at + AFTER + 2] == 0.0
    ahead, behind = (length - share.real if ends else ENDLESS), (share.real if begins else ENDLESS)
    left, way = (ahead, 1.0) if share.imag >= 0.0 else (behind, -1.0)
    if kept:
        return dx * ty - dy * tx, complex(ty, 0.0), complex(-tx, 0.0), left, way
    if share.real < 0.0 and not begins:
        if not _goes_on(p, pair, at + BEFORE, x.real, y.real, begin_x, begin_y):
            size, nx, ny = _from_corner(dx, dy)
            return size, nx, ny, left, way
    elif share.real > length and not ends:
        end_x, end_y = begin_x + length * tx, begin_y + length * ty
        if not _goes_on(p, pair, at + AFTER, x.real, y.real, end_x, end_y):
            size, nx, ny = _from_corner(x - end_x, y - end_y)
            return size, nx, ny, left, way
    away, side = dx * ty - dy * tx, 1.0
    if away.real < -ROUND_OFF * length and not _is_behind(p, pair, x.real, y.real, -away.real):
        side = -1.0
    return side * away, complex(side * ty, 0.0), complex(-side * tx, 0.0), left, way


def chains(corners: Array, concave: Flags) -> list[tuple[Array, Array, float]]:
    """Return kinds, numbers (features, SIZE) and turn [rad] of the chains of a polygon between its concave corners.

    corners: (corners, 2); concave: (corners,). Of a polygon without a concave corner the chain is closed.
    """
    count = len(corners)
    ways = np.roll(corners, -1, axis=0) - corners
    lengths = np.linalg.norm(ways, axis=1)
    along = ways / lengths[:, None]
    breaks = np.flatnonzero(concave)
    found = []
    for begin, end in zip(breaks, np.roll(breaks, -1), strict=True) if len(breaks) else [(0, 0)]:
        kinds, numbers, turn = list[int](), list[list[float]](), 0.0
        for step in range((end - begin - 1) % count + 1):
            k = (begin + step) % count
            if step or not len(breaks):
                kinds.append(CORNER)
                turn += float(np.arccos(np.clip(along[k] @ along[k - 1], -1.0, 1.0)))
                numbers.append([*corners[k], *along[k - 1], 0.0, 0.0, 0.0, 0.0, *along[k], 0.0])
            before = [*-along[k - 1], -lengths[k - 1]] if concave[k] else [0.0] * 3
            follows = (k + 1) % count
            after = [*along[follows], lengths[follows]] if concave[follows] else [0.0] * 3
            kinds.append(EDGE)
            numbers.append([*corners[k], *along[k], lengths[k], *before, *after])
        found.append((np.array(kinds), np.array(numbers), turn))
    return found
