"""Added markers at places of bodies, each once: how places and axes move, for all that is drawn on them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from shoal.mechanics.reach import span
from shoal.pictures.links import At
from shoal.pictures.machine.drawing import Carrier
from shoal.pictures.outline import INSIDE
from shoal.scene import GROUND, Attachment, PointMass, Rod, Scene
from shoal.trajectory import Array

Path = Callable[[At, Array], Array]
"""Places over time [m], (frames, d), or (1, d) of what stands still, of paths of markers and times [s]."""
Motion = Callable[[At, Array], Carrier]
_NEAR = 0.01
"""Distance between two markers that show the tangent of a flexible rod, over its length."""
STILL = "still"


class Marks:
    """The markers that symbols of a scene need; markers do not change a model. kind: of their names."""

    def __init__(self, scene: Scene, kind: str = "symbol") -> None:
        self.scene, self._kind = scene, kind
        self.markers: dict[str, dict[str, Any]] = {}
        self._names: dict[Any, str] = {}
        self._away = span(scene)

    def point(self, side: Attachment) -> Path:
        """Return how a place moves."""
        if side.body != GROUND:
            return self._path(side.body, self.scene.location(side))
        if isinstance(side.point, str):
            moving = self.scene.ground_points[side.point]
            axes = (moving.x, moving.y, moving.z)[: self.scene.dimensions]
            return lambda _, times: np.stack([axis(times) for axis in axes], axis=1)
        fixed = np.array([self.scene.location(side)], dtype=float)
        return lambda _at, _times: fixed

    def frame(self, side: Attachment) -> tuple[str, Array, Motion]:
        """Return what carries a place: its name, the place in its coordinates [m], (d,), and how it moves.

        A rigid body carries all of its places; a rod that bends has a carrier for each, along its tangent there; a
        point mass and a moving point do not turn.
        """
        place, d = np.array(self.scene.location(side), dtype=float), self.scene.dimensions
        eye = np.eye(d)[None]
        if side.body == GROUND and not isinstance(side.point, str):
            return STILL, place, lambda _at, _times: Carrier(np.zeros((1, d)), eye)
        if side.body == GROUND or isinstance(self.scene.bodies[side.body], PointMass):
            moves = self.point(side)
            name = f"{side.body} {side.point}" if side.body == GROUND else side.body
            return name, np.zeros(d), lambda at, times: Carrier(moves(at, times), eye)
        if not self.is_rigid(side.body):
            return f"{side.body} {float(place[0]):.6g}", np.zeros(d), self._along(side.body, place)
        places = [np.zeros(d), *(self._away * np.eye(d)[: d - 1])]
        paths = [self._path(side.body, one) for one in places]

        def moved(at: At, times: Array) -> Carrier:
            origin, *ends = (path(at, times) for path in paths)
            return Carrier(origin, completed([(end - origin) / self._away for end in ends]))

        return side.body, place, moved

    def is_rigid(self, body: str) -> bool:
        """Return whether a body has axes of its own."""
        return body == GROUND or self.scene.bodies[body].element == "rigid"

    def _along(self, body: str, place: Array) -> Motion:
        """Return how the place on a rod that bends moves, with the tangent as its first axis."""
        rod, here = self.scene.bodies[body], self._path(body, place)
        if not isinstance(rod, Rod):
            eye = np.eye(len(place))[None]
            return lambda at, times: Carrier(here(at, times), eye)
        start = max(0.0, min(float(place[0]) - _NEAR * rod.length / 2, (1 - _NEAR) * rod.length))
        ends = [self._path(body, (s, *(0.0,) * (len(place) - 1))) for s in (start, start + _NEAR * rod.length)]

        def moved(at: At, times: Array) -> Carrier:
            one, other = (end(at, times) for end in ends)
            tangent = unit(other - one)
            return Carrier(here(at, times), completed([tangent] if len(place) == 2 else [tangent, across(tangent)]))

        return moved

    def _path(self, body: str, place: Any) -> Path:
        key = body, tuple(float(x) for x in place)
        if key not in self._names:
            self._names[key] = name = f"{INSIDE}-{self._kind}-{len(self.markers)}"
            self.markers[name] = {"body": body, "point": list(key[1])}
        name = self._names[key]
        return lambda at, _: at(name)


def unit(vectors: Array) -> Array:
    """Return vectors, (frames, d), of length one; where one is zero, that before."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    known = np.where(length[:, 0] > 0, np.arange(len(vectors)), -1)
    known = np.maximum.accumulate(known)
    first = int(np.argmax(known >= 0))
    known[:first] = known[first] if known[first] >= 0 else 0
    size = length[known]
    return np.asarray(vectors[known] / np.where(size > 0, size, 1.0))


def across(ways: Array) -> Array:
    """Return unit vectors at a right angle to some in space, (frames, 3), that turn with them."""
    helper = np.eye(3)[int(np.argmin(np.max(np.abs(ways), axis=0)))]
    return unit(np.cross(np.cross(ways, helper), ways))


def completed(axes: list[Array]) -> Array:
    """Return all axes of a right-handed system of its first ones, (frames, d, d); the last is as long as that before.

    In the plane of one vector, in space of two at a right angle.
    """
    first = axes[0]
    if len(axes) == 1:
        return np.stack([first, np.stack([-first[:, 1], first[:, 0]], axis=1)], axis=1)
    size = np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, axes[1], np.cross(first, axes[1]) / np.where(size > 0, size, 1.0)], axis=1)


def between(one: Array, other: Array) -> Carrier:
    """Return what is stretched along its first axis from one place to another [m], (frames, d); the others stay."""
    way = other - one
    if way.shape[1] == 2:
        along = unit(way)
        return Carrier(one, np.stack([way, np.stack([-along[:, 1], along[:, 0]], axis=1)], axis=1))
    second = across(unit(way))
    return Carrier(one, np.stack([way, second, np.cross(unit(way), second)], axis=1))
