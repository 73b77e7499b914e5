"""Initial guess of the nodes of a flexible rod that starts strained, between points and sections held by joints.

From one held place to the next the unstrained shape is displaced by a cubic of the arc length, which turns with the
sections that are held, and the sections between them turn evenly; a rod that is too long bulges to its softer side,
towards positive y or z of its section. Statics goes on from there.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from shoal.mechanics import joints
from shoal.mechanics import rotation as turns
from shoal.mechanics.assembly.coordinates import Pose
from shoal.mechanics.assembly.groups import transposed
from shoal.mechanics.assembly.rods import node_of
from shoal.mechanics.assembly.space.coordinates import SpatialPlacement
from shoal.mechanics.assembly.space.sections import arc, flexible, material, turn_of
from shoal.mechanics.elements.unstrained import unstrained
from shoal.mechanics.joints import Turned
from shoal.mechanics.numerics.tile import Array
from shoal.scene import Attachment, Rod, Scene

_NONE = np.eye(3)[..., None]


class NodeGuess(NamedTuple):
    """A node's place [m], (3, lanes), and the rotation of its section from the unstrained start, (3, 3, lanes)."""

    place: Array
    turn: Array


def guessed(
    scene: Scene, name: str, rod: Rod, pose: Pose, places: dict[int, Array], result: SpatialPlacement
) -> list[NodeGuess]:
    """The nodes of a rod in their order. places: of nodes that joints hold at places known already [m], (3, lanes)."""
    sections = _held_sections(scene, name, rod, result)
    only = next(iter(sections.values()), _NONE) if len(places) < 2 else _NONE
    nodes = range(rod.elements + 1)
    plain = [pose.point(material(scene, name, (arc(rod, node), 0.0, 0.0))) for node in nodes]
    places = places or {0: plain[0]}
    held = sorted(places)
    found = {}
    for node in nodes:
        near = held[0] if node <= held[0] else held[-1]
        turn = sections.get(near, only)
        found[node] = NodeGuess(places[near] + turns.turned(turn, plain[node] - plain[near]), turn)
    axes = transposed(pose.directors)
    for first, last in pairwise(held):
        between = range(first, last + 1)
        frames = [turns.product(axes, unstrained(rod, arc(rod, node))[1]) for node in between]
        moved = places[first] - plain[first], places[last] - plain[last]
        ways = [
            None if end not in sections else turns.turned(sections[end], frame[:, 0]) - frame[:, 0]
            for end, frame in ((first, frames[0]), (last, frames[-1]))
        ]
        length, x = arc(rod, last - first), [(node - first) / (last - first) for node in between]
        shifts = [_displaced(part, length, moved, ways) for part in x]
        curve = np.stack([plain[node] + shift for node, (shift, _) in zip(between, shifts, strict=True)])
        short = np.maximum(length - np.sum(np.sqrt(np.sum(np.diff(curve, axis=0) ** 2, axis=1)), axis=0), 0.0)
        bulge = 2.0 / np.pi * np.sqrt(short * length)
        section = rod.section_at(0.5)
        soft = 1 if np.all(section.bending <= section.side) else 2
        for node, part, frame, (shift, slope) in zip(between, x, frames, shifts, strict=True):
            turn = _evenly(part, sections.get(first), sections.get(last))
            side = turns.turned(turn, frame[:, soft]) * bulge
            place = plain[node] + shift + side * np.sin(np.pi * part) ** 2
            slope = frame[:, 0] + slope + side * (np.pi / length * np.sin(2 * np.pi * part))
            found[node] = NodeGuess(place, _aligned(turn, frame[:, 0], slope))
    return [found[node] for node in nodes]


def section_at(scene: Scene, result: SpatialPlacement, side: Attachment) -> Array:
    """The axes of a body, or of the section at a node, as they start, (3, 3, lanes)."""
    plain, rod = turn_of(result.attitudes, scene, side), flexible(scene, side.body)
    turn = None if rod is None else result.strained.get((side.body, node_of(rod, scene.location(side))))
    return plain if turn is None else turns.product(turn, plain)


def _held_sections(scene: Scene, name: str, rod: Rod, result: SpatialPlacement) -> dict[int, Array]:
    """Return the rotations of sections by welds, from the unstrained start."""
    found = {}
    for _, weld in joints.of_scene(scene):
        if not isinstance(weld, Turned) or weld.driven:
            continue
        for mine, other, sense in ((weld.first, weld.second, -1.0), (weld.second, weld.first, 1.0)):
            node = node_of(rod, scene.location(mine)) if mine.body == name else None
            if node is None:
                continue
            if weld.angle is None:
                found[node] = _NONE
                continue
            wanted = turns.product(section_at(scene, result, other), turns.about_z(sense * np.asarray(weld.angle)))
            found[node] = turns.product(wanted, transposed(turn_of(result.attitudes, scene, mine)))
    return found


def _displaced(x: float, length: Array, ends: tuple[Array, Array], slopes: list[Array | None]) -> tuple[Array, Array]:
    """Value and slope at the fraction x of a cubic of that length; an end without a slope is not bent."""
    (a, b), (p, q) = ends, slopes
    mean = (b - a) / length
    if p is None:
        p = mean if q is None else 0.5 * (3.0 * mean - q)
    if q is None:
        q = 0.5 * (3.0 * mean - p)
    bend, skew = p - mean, q - mean
    value = a + (b - a) * x + length * x * (1 - x) * (bend * (1 - x) - skew * x)
    return value, mean + bend * (1 - x) * (1 - 3 * x) + skew * x * (3 * x - 2)


def _evenly(x: float, first: Array | None, last: Array | None) -> Array:
    """The rotation at the fraction x of the way from one to the other; where one is None, the other."""
    if first is None or last is None:
        return next((one for one in (first, last) if one is not None), _NONE)
    between = turns.product(last, transposed(first))
    way = np.stack([turns.vector_of(between[..., lane]) for lane in range(between.shape[-1])], axis=1)
    return turns.product(turns.of_vector(x * way), first)


def _aligned(turn: Array, plain: Array, slope: Array) -> Array:
    """A rotation, turned on by the least so that it takes a unit vector along a slope."""
    now = turns.turned(turn, plain)
    axis = turns.cross(now, slope)
    sine, cosine = np.sqrt(np.sum(axis**2, axis=0)), np.sum(now * slope, axis=0)
    way = axis * (np.arctan2(sine, cosine) / np.maximum(sine, 1e-300))
    return turns.product(turns.of_vector(way), turn)
