"""What accelerometers on a rigid machine in the plane feel along its motion, whichever engine computed that.

The motion of the bodies gives the coordinates and their rates, and Gauss's principle the accelerations.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from shoal.errors import InputError
from shoal.mechanics.analysis.evaluate import Evaluator, points
from shoal.mechanics.assembly.build import build
from shoal.mechanics.assembly.groups import place_of
from shoal.mechanics.frames import RigidFrame
from shoal.mechanics.numerics.tile import Array
from shoal.scene import Attachment, Scene

_TURN = 1.0
"""The turns of angle forces are counted at poses that are no farther apart [rad]."""


@dataclass(frozen=True)
class Course:
    """How the bodies of a scene move, in its order, at increasing times [s], of which the first is the start.

    places [m]: of the origins of their frames, (samples, bodies, 2, lanes), and velocities [m/s]; angles [rad],
    continuous, (samples, bodies, lanes), and rates [rad/s]
    """

    times: Array
    places: Array
    velocities: Array
    angles: Array
    rates: Array


class Felt:
    """One lane of a machine along its motion. Raises InputError if the scene cannot be modelled.

    evaluator: of a model one of whose lanes it is
    """

    def __init__(self, evaluator: Evaluator, course: Course, lane: int, of_model: int = 0) -> None:
        """lane: of the course; of_model: of the evaluator's model."""
        self.evaluator, self.times, self.lane = evaluator, course.times, of_model
        self.scene = scene = evaluator.model.stated
        self.gravity = np.array([float(np.ravel(part)[of_model % np.size(part)]) for part in scene.gravity[:2]])
        numbers = {name: number for number, name in enumerate(scene.bodies)}
        order = [numbers[name] for name in evaluator.model.frames]
        own = (course.places, course.angles, course.velocities, course.rates)
        self._places, self._angles, velocities, rates = (part[..., lane][:, order] for part in own)
        vectors = [vector for frame in evaluator.model.frames.values() for vector in frame.vectors]
        unknowns = evaluator.model.unknowns
        found = points(vectors, unknowns, of_model)
        matrix = found.matrix.reshape(found.constant.size, unknowns)
        if unknowns and np.linalg.matrix_rank(matrix) < unknowns:
            raise InputError("ground_points: sensors of force know no moving point that no body is joined to")
        self._inverse, self._constant = np.linalg.pinv(matrix), found.constant
        self.q = self._coordinates(self._places, self._angles)
        turning = rates[..., None] * quarter(_direction(self._angles))
        self.v = self._stacked(velocities, turning) @ self._inverse.T

    def _coordinates(self, places: Array, angles: Array) -> Array:
        """Of poses of the bodies, (samples, unknowns)."""
        here = self._stacked(places, _direction(angles))
        return np.asarray((here - self._constant.ravel()) @ self._inverse.T)

    def _stacked(self, origins: Array, directors: Array) -> Array:
        """What is known of the vectors of all frames, (samples, 2 vectors)."""
        parts = list[Array]()
        for k, frame in enumerate(self.evaluator.model.frames.values()):
            parts += [origins[:, k], directors[:, k]] if isinstance(frame, RigidFrame) else [origins[:, k]]
        return np.concatenate(parts, axis=1)

    @cached_property
    def _along(self) -> tuple[Array, Array]:
        """Accelerations and turns; between samples that are far apart the bodies turn evenly."""
        way, sample = [self.q[:1]], [0]
        turned = np.max(np.abs(np.diff(self._angles, axis=0)), axis=1, initial=0.0)
        counted = self.evaluator.model.forces.size > 0
        for k, count in enumerate(np.ceil(turned / _TURN).astype(int).tolist(), start=1):
            if counted and count > 1:
                share = np.arange(1, count)[:, None] / count
                place = self._places[k - 1] + share[..., None] * (self._places[k] - self._places[k - 1])
                angle = self._angles[k - 1] + share * (self._angles[k] - self._angles[k - 1])
                way.append(self._coordinates(place, angle))
                sample += [-1] * (count - 1)
            way.append(self.q[k : k + 1])
            sample.append(k)
        return self.evaluator.along(np.concatenate(way), np.array(sample), self.v, np.asarray(self.times, dtype=float))

    @property
    def a(self) -> Array:
        """Accelerations of the coordinates, (samples, unknowns)."""
        return self._along[0]

    @property
    def turns(self) -> Array:
        """The angles that angle forces have counted at every sample [rad], (samples, forces)."""
        return self._along[1]

    def specific_force(self, at: Attachment, tilt: float = 0.0) -> Array:
        """Acceleration less gravity at a place of a body, along axes turned by `tilt` [rad] from its own.

        [m/s^2], (samples, 2): at rest an accelerometer shows gravity upwards.
        """
        model = self.evaluator.model
        name, place = place_of(self.scene, at)
        frame = model.frames[name]
        found = points([frame.point(place), frame.direction(place)], model.unknowns, self.lane)
        acceleration = self.a @ found.matrix[0].T - self.gravity
        x = self.q @ found.matrix[1].T + found.constant[1]
        x = x / np.linalg.norm(x, axis=1, keepdims=True)
        c, s = np.cos(tilt), np.sin(tilt)
        x = c * x + s * quarter(x)
        return np.stack([dot(x, acceleration), dot(quarter(x), acceleration)], axis=1)


def machines(scene: Scene, values: Mapping[str, Array], course: Course, lanes: list[int]) -> Iterator[Felt]:
    """Lanes of a scene along their motion, on one model. Raises InputError."""
    picked = {path: np.asarray(numbers, dtype=float)[lanes] for path, numbers in values.items()}
    model = build(scene.with_lanes(picked), len(lanes), float(course.times[-1]))
    for k, lane in enumerate(lanes):
        yield Felt(Evaluator(model, k), course, lane, k)


def machine(scene: Scene, values: Mapping[str, Array], course: Course, lane: int) -> Felt:
    """A lane of a scene along its motion, on a model of its own. Raises InputError."""
    one = scene.with_values({path: float(numbers[lane]) for path, numbers in values.items()})
    return Felt(Evaluator.of(one, horizon=float(course.times[-1])), course, lane)


def _direction(angle: Array) -> Array:
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def quarter(vectors: Array) -> Array:
    """Turned by a quarter, counter-clockwise, (..., 2)."""
    return np.stack([-vectors[..., 1], vectors[..., 0]], axis=-1)


def dot(a: Array, b: Array) -> Array:
    """Products of vectors, (...,)."""
    return np.asarray(np.sum(a * b, axis=-1))
