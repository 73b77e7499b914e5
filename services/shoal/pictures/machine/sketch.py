"""All symbols of a scene: the markers that they need, and the drawing of a motion."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from shoal.pictures.links import At
from shoal.pictures.machine import spatial, spatial_loads
from shoal.pictures.machine.bodies import bodies
from shoal.pictures.machine.drawing import Drawing
from shoal.pictures.machine.gears import gears
from shoal.pictures.machine.joints import joints
from shoal.pictures.machine.loads import loads
from shoal.pictures.machine.marks import Marks
from shoal.pictures.machine.ropes import ropes
from shoal.pictures.machine.sheet import Part, Sheet, unit_of
from shoal.pictures.machine.surfaces import surfaces
from shoal.scene import Scene
from shoal.trajectory import Array


class Sketch:
    """The symbols of a scene in the plane or in space."""

    def __init__(self, scene: Scene) -> None:
        self._scene, self._marks = scene, Marks(scene)
        plane, space = (
            (bodies, gears, joints, ropes, surfaces, loads),
            (spatial.masses, spatial.joints, spatial.surfaces, spatial_loads.loads),
        )
        kinds = plane if scene.dimensions == 2 else space
        self._parts: list[Part] = [part for kind in kinds for part in kind(self._marks)]

    @property
    def markers(self) -> dict[str, dict[str, Any]]:
        """The markers that the symbols need, beside those of the scene."""
        return self._marks.markers

    def drawing(self, at: At, times: Array, outlines: Iterable[Array], links: Iterable[Array]) -> Drawing:
        """Return the drawing of a motion.

        at: paths of markers; times [s]; outlines and links: of the bodies and of springs [m], (frames, points, d)
        """
        bodies = list(outlines)
        every = [path.reshape(-1, self._scene.dimensions) for path in (*bodies, *links)]
        size = float(np.max(np.ptp(np.concatenate(every), axis=0))) if every else 1.0
        extents = (float(np.max(np.ptp(outline[0], axis=0))) for outline in bodies)
        sheet = Sheet(at, times, unit_of(size or 1.0, extents), downwards(self._scene))
        for draw in self._parts:
            draw(sheet)
        return sheet.drawing


def downwards(scene: Scene) -> Array:
    """Return the axis along which gravity points most nearly; without gravity against y, in space against z."""
    gravity = np.array([*scene.gravity, 0.0, 0.0][: scene.dimensions], dtype=float)
    k = int(np.argmax(np.abs(gravity))) if np.any(gravity) else scene.dimensions - 1
    way: Array = np.zeros(scene.dimensions)
    way[k] = 1.0 if gravity[k] > 0 else -1.0
    return way
