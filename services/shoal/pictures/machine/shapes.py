"""Shapes of symbols in their own coordinates, as engineers draw them; u is the unit, gaps between lines are nan."""

from __future__ import annotations

import numpy as np

from shoal.trajectory import Array

PIN, FOOT, BLOCK = 0.42, 2.0, (2.8, 1.7)
"""Radius of a pin, height of the triangle that stands on the ground, length and height of a block [units]."""
ROUND = 24
_TURNS = 7
"""Turns of a coil."""
_TEETH = 12, 90
"""Fewest teeth of the smaller wheel, and most of the larger one that are drawn."""

GAP = np.full((1, 2), np.nan)


def joined(*lines: Array) -> Array:
    """Return lines with gaps between them, (points, k)."""
    gap = np.full((1, lines[0].shape[1]), np.nan)
    return np.concatenate([part for line in lines for part in (line, gap)][:-1])


def circle(radius: float, centre: tuple[float, float] = (0.0, 0.0), count: int = ROUND) -> Array:
    """Return a closed circle, (count + 1, 2)."""
    angle = np.linspace(0.0, 2 * np.pi, count + 1)
    return np.asarray(np.array(centre) + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1))


def box(low: tuple[float, float], high: tuple[float, float]) -> Array:
    """Return a closed rectangle by two corners, (5, 2)."""
    (a, b), (c, d) = low, high
    return np.array([(a, b), (c, b), (c, d), (a, d), (a, b)])


def hatch(start: float, end: float, y: float, u: float) -> Array:
    """Return strokes below a line along x that mark the ground, (points, 2)."""
    count = max(2, round((end - start) / (0.75 * u)))
    feet = np.linspace(start, end, count + 1)[:-1] + (end - start) / (2 * count)
    return joined(*(np.array([[x + 0.25 * u, y], [x - 0.25 * u, y - 0.6 * u]]) for x in feet))


def foot(u: float) -> tuple[Array, Array]:
    """Return the triangle below a pin, and the ground under it."""
    triangle = u * np.array([(0, 0), (1.15, -FOOT), (-1.15, -FOOT), (0, 0)])
    line = u * np.array([(-1.7, -FOOT), (1.7, -FOOT)])
    return triangle, joined(line, hatch(-1.7 * u, 1.7 * u, -FOOT * u, u))


def wall(u: float) -> Array:
    """Return the ground at x = 0 that clamps what is at x > 0."""
    turned = joined(u * np.array([(-1.9, 0), (1.9, 0)]), hatch(-1.9 * u, 1.9 * u, 0.0, u))
    return np.asarray(turned @ np.array([[0.0, -1.0], [1.0, 0.0]]))


def guide(start: float, end: float, u: float, *, hatched: bool) -> Array:
    """Return two rails along x on both sides of a block, the lower one on the ground if it is hatched."""
    half = BLOCK[1] / 2 * u
    rails = [np.array([(start, y), (end, y)]) for y in (half, -half)]
    return joined(*rails, *([hatch(start, end, -half, u)] if hatched else []))


def coil(u: float, start: float = 0.0, end: float = 1.0) -> Array:
    """Return the projection of a helix along x between two leads, stretched from 0 to 1, (points, 2)."""
    angle = np.linspace(0.0, 2 * np.pi * _TURNS, 12 * _TURNS + 1)
    lead = 0.14 * (end - start)
    advance = (end - start - 2 * lead) / (_TURNS + 0.6)
    x = start + lead + advance * (angle / (2 * np.pi) + 0.3 * (1 - np.cos(angle)))
    return np.concatenate([[(start, 0)], np.stack([x, 0.85 * u * np.sin(angle)], axis=1), [(end, 0)]])


def helix(u: float) -> Array:
    """Return a helix about x between two leads, stretched from 0 to 1, (points, 3)."""
    angle = np.linspace(0.0, 2 * np.pi * _TURNS, 10 * _TURNS + 1)
    x = 0.14 + 0.72 * angle / angle[-1]
    turns = np.stack([x, 0.8 * u * np.cos(angle), 0.8 * u * np.sin(angle)], axis=1)
    return np.concatenate([[(0, 0, 0), (0.14, 0, 0)], turns, [(0.86, 0, 0), (1, 0, 0)]])


def spiral(u: float) -> Array:
    """Return the spiral of a torsion spring about its place, (points, 2)."""
    angle = np.linspace(0.0, 2 * np.pi * 2.25, 64)
    radius = u * (0.6 + 1.2 * angle / angle[-1])
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)


def arrow() -> Array:
    """Return an arrow along x from 0 to 1, closed."""
    return np.array([(0, 0.02), (0.7, 0.02), (0.7, 0.11), (1, 0), (0.7, -0.11), (0.7, -0.02), (0, -0.02), (0, 0.02)])


def turning_arrow(sense: float) -> Array:
    """Return an arc of radius 1 with a head, closed; counter-clockwise of a positive sense."""
    angle = np.linspace(-0.25 * np.pi, 0.95 * np.pi, 28)
    ways = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    tip = angle[-1] + 0.42
    head = [1.28 * ways[-1], np.array([np.cos(tip), np.sin(tip)]), 0.72 * ways[-1]]
    outline = np.concatenate([1.05 * ways, head, 0.95 * ways[::-1], 1.05 * ways[:1]])
    return np.asarray(outline * (1.0 if sense > 0 else np.array([-1.0, 1.0])))


def dashpot(stroke: tuple[float, float], u: float) -> tuple[Array, Array] | None:
    """Return the cylinder, along x from one end, and the piston, along x up to 0 at the other [m]; None if too short.

    stroke: smallest and largest distance of the ends [m]: the piston stays in the cylinder.
    """
    least, most = stroke
    begin = max(0.2 * least, min(1.5 * u, 0.4 * least))
    length = most - least + 1.6 * u
    if least <= 0 or begin + length > 0.92 * least:
        return None
    half, y = 0.65 * u, 0.45 * u
    cylinder = joined(
        np.array([(0, 0), (begin, 0)]),
        np.array([(begin + length, half), (begin, half), (begin, -half), (begin + length, -half)]),
    )
    inside = begin + 0.8 * u - least
    piston = joined(np.array([(0, 0), (inside, 0)]), np.array([(inside, y), (inside, -y)]))
    return cylinder, piston


def damper(u: float) -> Array:
    """Return a cylinder with its piston, stretched from 0 to 1, for strokes that are longer than its body."""
    half, y = 0.65 * u, 0.45 * u
    return joined(
        np.array([(0, 0), (0.3, 0)]),
        np.array([(0.7, half), (0.3, half), (0.3, -half), (0.7, -half)]),
        np.array([(0.5, y), (0.5, -y)]),
        np.array([(0.5, 0), (1, 0)]),
    )


def teeth(numerator: int, denominator: int) -> tuple[int, int] | None:
    """Return the teeth of both wheels by their ratio, as many as are drawn; None of too many."""
    times = -(-_TEETH[0] // min(numerator, denominator))
    found = times * numerator, times * denominator
    return found if max(found) <= _TEETH[1] else None


def wheel(radius: float, count: int | None, first: float, *, inside: bool = False) -> Array:
    """Return a toothed wheel, one of whose teeth is at an angle [rad], closed; a circle without a number of teeth.

    inside: whether its teeth point inwards, as those of a ring
    """
    if count is None:
        return circle(radius, count=48)
    height = 2.0 * radius / count * (-1.0 if inside else 1.0)
    pitch = 2 * np.pi / count
    angle = first + pitch * (np.arange(count)[:, None] + [-0.32, -0.14, 0.14, 0.32])
    size = radius + height * np.array([-1.1, 0.9, 0.9, -1.1])
    corners = (size[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=2)).reshape(-1, 2)
    return np.concatenate([corners, corners[:1]])


def hull(places: Array, radius: float) -> Array:
    """Return the outline of a plate or link with rounded corners about some places, closed, (points, 2)."""
    around = circle(radius, count=16)[:-1]
    cloud = np.unique(np.round((places[:, None] + around).reshape(-1, 2), 12), axis=0)
    chains = []
    for ordered in (cloud, cloud[::-1]):  # Andrew's monotone chain
        chain: list[Array] = []
        for point in ordered:
            while len(chain) > 1 and _turn(chain[-2], chain[-1], point) <= 0:
                chain.pop()
            chain.append(point)
        chains += chain[:-1]
    return np.array([*chains, chains[0]])


def _turn(a: Array, b: Array, c: Array) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
