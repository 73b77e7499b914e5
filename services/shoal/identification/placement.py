"""Channels at time zero without placing a machine again: of an open chain they are linear in cos and sin of its angles.

Positions are c_0 + sum of A_k cos(angle_k) + B_k sin(angle_k), directions c_0 + sum of S_k angle_k, over the angles k
that are sought. The coefficients follow from poses by right angles, which turn bodies exactly.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from shoal.identification.parametrization import Parametrization
from shoal.identification.problem import Problem
from shoal.identification.recording.measurement import Recording
from shoal.identification.recording.source import Channel
from shoal.mechanics.start.start import is_direct
from shoal.scene import Scene
from shoal.trajectory import Array

Place = Callable[[Array], Array]
"""Channels at time zero, (points, channels), of points (points, parameters)."""


@dataclass(frozen=True)
class AngleSensitivity:
    """Channels as functions of the angles at the start, all other parameters being constant.

    angles: components of the angles; base: the point that determines the others, (parameters,); rest: (channels,);
    along, across, turning: A, B and S, (angles, channels)
    """

    angles: Sequence[int]
    base: Array
    rest: Array
    along: Array
    across: Array
    turning: Array

    @classmethod
    def of(cls, place: Place, channels: Sequence[Channel], angles: Sequence[int], point: Array) -> AngleSensitivity:
        """From 1 + 2 angles poses about a point; channels: x, y and angles of bodies."""
        count, base = len(angles), point.copy()
        base[list(angles)] = 0.0
        poses = np.repeat(base[None], 1 + 2 * count, axis=0)
        for k, angle in enumerate(angles):
            poses[1 + k, angle], poses[1 + count + k, angle] = np.pi / 2, -np.pi / 2
        seen = place(poses)
        first, upwards, downwards = seen[0], seen[1 : 1 + count], seen[1 + count :]
        turned = np.array([channel.quantity == "angle" for channel in channels])
        along = np.where(turned, 0.0, first - (upwards + downwards) / 2)
        across = np.where(turned, 0.0, (upwards - downwards) / 2)
        turning = np.where(turned, (upwards - downwards) / np.pi, 0.0)
        return cls(angles, base, first - along.sum(axis=0), along, across, turning)

    def knows(self, points: Array) -> bool:
        """Return whether points differ by angles alone."""
        others = np.ones(len(self.base), dtype=bool)
        others[list(self.angles)] = False
        return bool(np.all(points[:, others] == self.base[others]))

    def __call__(self, points: Array) -> Array:
        """Channels at time zero, (points, channels)."""
        angles = points[:, list(self.angles)]
        found = self.rest + np.cos(angles) @ self.along + np.sin(angles) @ self.across + angles @ self.turning
        return np.asarray(found)


def placement(
    problem: Problem,
    parameters: Parametrization,
    scene: Scene,
    name: str,
    recording: Recording,
    points: Array,
    place: Place,
) -> AngleSensitivity | None:
    """Return that of points that differ in their angles alone, for a recording; None for others, and other machines.

    The machine has to be an open chain that stands at its stated angles, and to be seen by what is linear in its pose.
    """
    angles = list(parameters.indices(name, ".angle").values())
    states = [path for path in parameters.paths if path.startswith("initial.")]
    seen = all(channel.quantity in ("x", "y", "angle") and channel.to is None for channel in recording.channels)
    if problem.ties or not angles or not seen or not all(path.endswith((".angle", ".rate")) for path in states):
        return None
    late = parameters.measurement_values(points[:1], name, recording.stated)["delay"][0] > 0.0
    scene = scene.with_values(recording.stated.known) if recording.stated.known else scene
    if late or scene.initial_from is not None or not is_direct(scene):
        return None
    found = AngleSensitivity.of(place, recording.channels, angles, points[0])
    return found if found.knows(points) and np.all(np.isfinite(found.rest)) else None
