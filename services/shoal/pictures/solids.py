"""Solids of a machine in space: bars with their sections, joints, axes of joints."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from shoal.pictures.links import At
from shoal.pictures.outline import INSIDE
from shoal.scene import GROUND, Attachment, Body, RigidBody, Rod, Scene
from shoal.scene.joints import Coupling, Cylindrical, Joint, Planar, Revolute, Slider, Universal
from shoal.trajectory import Array

_LEAST = 1e-9
"""A cuboid thinner than this share of its length is none."""
_ALIKE = 1e-6
"""Moments of inertia that differ by less are those of a cylinder."""
_ROUND = ("round", "tube")


@dataclass(frozen=True)
class Bar:
    """A bar of rectangular or round section; of round one where its rotation about its axis is unknown.

    axis: points along it [m], (frames, points, 3); side: unit vector along the height of its section, (frames, 1, 3),
    or one for each point; size: height and width at each point [m], (points, 2)
    stands_for: whether it is a rigid body's cuboid or cylinder, which has its mass and inertia, not its shape
    round: whether its section is round, of the height and width as diameters
    """

    axis: Array
    side: Array | None
    size: Array
    stands_for: bool = False
    round: bool = False

    @property
    def edges(self) -> Array:
        """Its edges as one line with gaps (nan) [m], (frames, points, 3); the axis where it is round."""
        if self.side is None:
            return self.axis
        chord = self.axis[:, -1:] - self.axis[:, :1]
        third = np.cross(chord / np.linalg.norm(chord, axis=2, keepdims=True), self.side)
        angle = 2 * np.pi * np.arange(12) / 12
        turns = np.stack([np.cos(angle), np.sin(angle)], axis=1) / 2
        ring = turns if self.round else np.array([(1, 1), (1, -1), (-1, -1), (-1, 1)]) / 2
        height, width = self.size.T[:, None, :, None]
        corners = [self.axis + a * height * self.side + b * width * third for a, b in ring]
        gap = np.full_like(corners[0][:, :1], np.nan)
        rings = [np.stack([corner[:, k] for corner in (*corners, corners[0])], axis=1) for k in (0, -1)]
        along = corners[::3] if self.round else corners
        return np.concatenate([part for line in (*along, *rings) for part in (line, gap)], axis=1)


class MarkedScene:
    """The scene with markers at bars, joints and axes.

    Markers do not change a model: bodies have their coordinates from joints.
    """

    def __init__(self, traced: Scene, outlines: Mapping[str, list[str]], original: Scene) -> None:
        self._outlines, self._original, self._markers = outlines, original, dict[str, dict[str, Any]]()
        self._attitudes: dict[str, tuple[list[str], float]] = {}
        self._bars = {name: bar for name, body in original.bodies.items() if (bar := self._bar(name, body))}
        self._axes = [axis for name, joint in original.joints.items() for axis in self._axes_of(name, joint)]
        data = traced.model_dump(mode="json")
        data["markers"] |= self._markers
        self.scene = Scene.parse(data, traced.name)

    def shown(self, at: At, frames: int) -> dict[str, Any]:
        """Return bars of the bodies, and of each axis of a joint a point [m] and the direction, (frames, 2, 3).

        at: the path of an added marker, (frames, 3).
        """

        def pair(*ends: Callable[[At], Array]) -> Array:
            return np.stack([np.broadcast_to(end(at), (frames, 3)) for end in ends], axis=1)

        return {
            "bars": {name: bar(at) for name, bar in self._bars.items()},
            "axes": {name: pair(place, way) for name, place, way in self._axes},
        }

    def _add(self, body: str, point: Any) -> str:
        name = f"{INSIDE}-solid-{len(self._markers)}"
        self._markers[name] = {"body": body, "point": [float(x) for x in point]}
        return name

    def _bar(self, name: str, body: Body) -> Callable[[At], Bar] | None:
        if isinstance(body, Rod):
            names = self._outlines[name]
            section = body.section_at(np.linspace(0.0, 1.0, len(names)))
            size = np.column_stack([side * np.ones(len(names)) for side in (section.height, section.width)])
            across = None if body.element != "rigid" else self._add(name, (0.0, body.length, 0.0))
            is_round = body.section in _ROUND
            return lambda at: _bar(at, names, across, size, body.length, is_round=is_round)
        if not isinstance(body, RigidBody):
            return None
        moments, axes = np.linalg.eigh(body.inertia_matrix)
        # Of a cuboid with sides a, b, c: I_a = m (b^2 + c^2) / 12. The smallest moment is about its longest side.
        sides = np.sqrt(np.maximum(0.0, 6.0 / body.mass * (moments.sum() - 2.0 * moments)))
        if (found := _cylinder(moments, axes, body.mass)) is not None:
            sides, axes = found
        if sides[0] <= 0 or sides[1] <= _LEAST * sides[0]:
            return None
        middle = np.array([*body.centre_of_mass, 0.0][:3])
        half = sides[0] / 2 * axes[:, 0]
        ends = [self._add(name, middle - half), self._add(name, middle + half)]
        side = self._add(name, middle - half + sides[0] * axes[:, 1])
        size = np.tile(sides[1:], (2, 1))
        is_round = found is not None
        return lambda at: _bar(at, ends, side, size, float(sides[0]), stands_for=True, is_round=is_round)

    def _place(self, side: Attachment) -> Callable[[At], Array] | None:
        """Return the position of an attachment; None for a moving point of the ground."""
        if side.body != GROUND:
            name = self._add(side.body, self._original.location(side))
            return lambda at: at(name)
        fixed = None if isinstance(side.point, str) else np.array([self._original.location(side)])
        return None if fixed is None else lambda _: fixed

    def _axes_of(self, name: str, joint: Joint) -> list[tuple[str, Callable[[At], Array], Callable[[At], Array]]]:
        """The axes of a joint, each with the body that carries it."""
        carried: list[tuple[Attachment, Any]] = []
        if isinstance(joint, Universal):
            carried = [(joint.first, joint.axis), (joint.second, joint.second_axis)]
        elif isinstance(joint, Revolute | Cylindrical | Planar | Slider) and (rigid := self._rigid(joint)):
            carried = [(rigid, joint.axis)]
        if not carried or isinstance(joint, Coupling):
            return []
        place, own = self._place(joint.first), joint.direction if isinstance(joint, Slider) and not joint.axis else None
        if place is None:
            return []
        return [(f"{name}{k or ''}", place, self._direction(at, axis, own)) for k, (at, axis) in enumerate(carried)]

    def _rigid(self, joint: Any) -> Attachment | None:
        """The side that carries the axis: a flexible rod carries none."""
        sides = (joint.first,) if isinstance(joint, Slider | Planar) else (joint.first, joint.second)
        bodies = self._original.bodies
        rigid = (at for at in sides if at.body == GROUND or bodies[at.body].element == "rigid")
        return next((at for at in rigid if at.body == GROUND or bodies[at.body].kind != "point-mass"), None)

    def _direction(self, side: Attachment, axis: Any, own: float | None) -> Callable[[At], Array]:
        """Unit vector of an axis that a body carries; own: its angle in the body's frame, else that of the start."""
        way = np.array([np.cos(own), np.sin(own), 0.0]) if own is not None else np.array(axis, dtype=float)
        way = way / np.linalg.norm(way)
        if side.body == GROUND:
            return lambda _: way[None]

        def turned(at: At) -> Array:
            frames = self._attitude(side.body, at)
            return np.asarray(frames @ (way if own is not None else frames[0].T @ way))

        self._attitude_markers(side.body)
        return turned

    def _attitude_markers(self, body: str) -> tuple[list[str], float]:
        if body not in self._attitudes:
            record = self._original.bodies[body]
            # As far away as its own size, so that differences keep their digits.
            size = record.length if isinstance(record, Rod) else 1.0
            places = ((0.0, 0.0, 0.0), (size, 0.0, 0.0), (0.0, size, 0.0))
            self._attitudes[body] = [self._add(body, place) for place in places], size
        return self._attitudes[body]

    def _attitude(self, body: str, at: At) -> Array:
        """Axes of a rigid body as columns, (frames, 3, 3)."""
        names, size = self._attitude_markers(body)
        origin, x, y = (at(name) for name in names)
        x, y = (x - origin) / size, (y - origin) / size
        return np.stack([x, y, np.cross(x, y)], axis=2)


def _cylinder(moments: Array, axes: Array, mass: float) -> tuple[Array, Array] | None:
    """Return length and diameters of the cylinder with some moments of inertia, and its axes; None if two differ.

    About its axis m r^2 / 2, across it m (3 r^2 + h^2) / 12.
    """
    low, middle, high = moments
    flat, long = (np.isclose(middle, one, rtol=_ALIKE) for one in (low, high))
    if flat == long:
        return None
    k = 2 if flat else 0
    radius = np.sqrt(2.0 * moments[k] / mass)
    height = np.sqrt(max(0.0, 12.0 * middle / mass - 3.0 * radius**2))
    order = [k, *(n for n in range(3) if n != k)]
    return np.array([height, 2 * radius, 2 * radius]), axes[:, order]


def _bar(
    at: At, along: list[str], across: str | None, size: Array, away: float, *, stands_for: bool = False,
    is_round: bool = False,
) -> Bar:  # fmt: skip
    """From the markers along it, and one that is away [m] across it from the first."""
    axis = np.stack([at(name) for name in along], axis=1)
    side = None if across is None else ((at(across) - axis[:, 0]) / away)[:, None]
    return Bar(axis, side, size, stands_for, is_round)
