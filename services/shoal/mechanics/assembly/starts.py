"""Starts of an open chain without walking along its joints again: they are linear in the directions of its bodies.

q = q_c + sum of A_b cos(angle_b) + B_b sin(angle_b) over the bodies b, v = v_c + the rate of this. The matrices are
found from starts by right angles, which turn bodies exactly.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from shoal.mechanics import plane
from shoal.mechanics.assembly.build import with_start
from shoal.mechanics.model import Model
from shoal.mechanics.numerics.tile import Array
from shoal.mechanics.start.start import is_direct
from shoal.scene import Scene


@dataclass(frozen=True)
class _Law:
    """Dependence of a start on the angles of the bodies.

    place, drift: coordinates and rates that do not, (unknowns,); along, across: A and B, (unknowns, bodies);
    turned, turns: relative angles of force elements at angles zero and their derivatives, (forces,), (forces, bodies)
    """

    place: Array
    drift: Array
    along: Array
    across: Array
    turned: Array
    turns: Array


class Starts:
    """The models of a scene that start in other ways, many lanes at once."""

    def __init__(self, scene: Scene, model: Model) -> None:
        self._scene, self._model = scene, model
        self._angles = [f"initial.{name}.angle" for name in scene.bodies]
        self._rates = [f"initial.{name}.rate" for name in scene.bodies]
        self._known = {*self._angles, *self._rates} if is_direct(scene) else set()
        self._row = {path: row for row, path in enumerate((*self._angles, *self._rates))}

    def at(self, values: Mapping[str, Array], lanes: int) -> Model:
        """Return the model with lanes that start with these numbers: path of an initial value -> (lanes,)."""
        scene = self._scene.with_lanes(values)
        if not values.keys() <= self._known:
            return with_start(self._model, scene, lanes)
        law = self._law
        found = np.repeat(self._stated, lanes, axis=1)
        for path, numbers in values.items():
            found[self._row[path]] = numbers
        angle, rate = np.split(found, 2)
        x, y = plane.rotation(angle)[:, 0]
        return replace(
            self._model,
            scene=scene,
            lanes=lanes,
            q0=law.place[:, None] + law.along @ x + law.across @ y,
            v0=law.drift[:, None] + law.across @ (rate * x) - law.along @ (rate * y),
            start_angles=law.turned[:, None] + law.turns @ angle,
        )

    @cached_property
    def _stated(self) -> Array:
        """Angles and rates of the bodies as the scene states them, (2 bodies, 1)."""
        start = [self._scene.start(name) for name in self._scene.bodies]
        return np.array([s.angle for s in start] + [s.rate for s in start])[:, None]

    @cached_property
    def _law(self) -> _Law:
        count = len(self._angles)
        lanes = 2 * count + 1
        # All bodies along x; then, one after the other, each of them upwards, and each of them backwards.
        turns = np.concatenate([np.zeros((1, count)), np.pi / 2 * np.eye(count), np.pi * np.eye(count)]).T
        values = dict(zip(self._angles, turns, strict=True)) | dict.fromkeys(self._rates, np.zeros(lanes))
        model = with_start(self._model, self._scene.with_lanes(values), lanes)
        places, rates, angles = (
            np.broadcast_to(rows, (len(rows), lanes)) for rows in (model.q0, model.v0, model.start_angles)
        )
        first, upwards, backwards = places[:, :1], places[:, 1 : 1 + count], places[:, 1 + count :]
        along = (first - backwards) / 2
        across = upwards - first + along
        turned = angles[:, 0]
        slopes = (angles[:, 1 + count :] - angles[:, :1]) / np.pi
        return _Law(first[:, 0] - along.sum(axis=1), rates[:, 0], along, across, turned, slopes)
