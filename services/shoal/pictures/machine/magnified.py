"""Deflections of rods magnified about their undeformed shape in a rigid position.

A rod that is joined at one place is undeformed along its tangent there; any other one through both of its ends, so
that it stays joined at them.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from shoal.errors import InputError
from shoal.pictures.links import At
from shoal.pictures.machine.marks import Marks
from shoal.scene import Attachment, Rod, Scene
from shoal.scene.joints import places
from shoal.trajectory import Array

_NEAR = 1e-6
"""Distance of two places that show the tangent of a rod, over its length."""


class Magnified:
    """The paths of markers where deflections are magnified."""

    def __init__(self, scene: Scene, factor: float) -> None:
        self._scene, self._factor, self._marks = scene, factor, Marks(scene, "magnified")
        self._ends = {name: self._fixed(name, rod) for name, rod in scene.flexible_rods.items()}
        if scene.dimensions == 3:
            for name, rod in scene.flexible_rods.items():
                if rod.curvature or rod.side_curvature or rod.twist:
                    raise InputError(
                        f"magnify: bodies.{name} is curved in space; deflections of straight rods are known"
                    )

    @property
    def markers(self) -> dict[str, dict[str, Any]]:
        """The markers that it needs."""
        return self._marks.markers

    def of(self, at: At, placed: dict[str, Any]) -> At:
        """Return the paths with magnified deflections; placed: body and point of every marker, by its name."""

        def moved(name: str) -> Array:
            body, point = placed[name]["body"], placed[name]["point"]
            if body not in self._ends:
                return at(name)
            rod = self._scene.bodies[body]
            assert isinstance(rod, Rod)
            side = Attachment(body=body, point=point if isinstance(point, str) else tuple(point))
            reference = self._reference(body, rod, float(self._scene.location(side)[0]), at)
            return np.asarray(reference + self._factor * (at(name) - reference))

        return moved

    def _fixed(self, name: str, rod: Rod) -> tuple[float, float, Any, Any]:
        """Return two places on a rod [m], whose line the undeformed rod has, and how they move."""
        sides = [side for joint in self._scene.joints.values() for side in places(joint) if side.body == name]
        joined = {float(self._scene.location(side)[0]) for side in sides}
        first, second = 0.0, rod.length
        if len(joined) == 1:
            first = min(*joined, (1 - _NEAR) * rod.length)
            second = first + _NEAR * rod.length
        one, other = (self._marks.point(self._side(name, s)) for s in (first, second))
        return first, second, one, other

    def _side(self, name: str, s: float) -> Attachment:
        return Attachment(body=name, point=(s, *(0.0,) * (self._scene.dimensions - 1)))

    def _reference(self, body: str, rod: Rod, s: float, at: At) -> Array:
        """Return the place of the undeformed rod at an arc length [m], (frames, d).

        A line through both places; where they are the ends, stretched with their distance.
        """
        begin, end, first, second = self._ends[body]
        none = np.zeros(1)
        one, other = first(at, none), second(at, none)
        if self._scene.dimensions == 3:
            return np.asarray(one + (s - begin) / (end - begin) * (other - one))
        axis = [complex(rod.axis(place)) if rod.curvature else complex(place) for place in (begin, end, s)]
        share = (axis[2] - axis[0]) / (axis[1] - axis[0])
        chord = other - one
        return np.asarray(one + share.real * chord + share.imag * np.stack([-chord[:, 1], chord[:, 0]], axis=1))
