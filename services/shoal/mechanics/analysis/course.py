"""Motion of a planar rigid machine from any engine, and the native coordinates that follow from it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from shoal.errors import InputError
from shoal.mechanics.affine import points
from shoal.mechanics.analysis.evaluate import Evaluator
from shoal.mechanics.analysis.felt import TURN, Felt, quarter
from shoal.mechanics.assembly.build import build
from shoal.mechanics.frames import RigidFrame
from shoal.mechanics.gaps import KEPT
from shoal.mechanics.numerics.tile import Array, Index
from shoal.scene import Scene
from shoal.scene.function import Function

_STEP = 1e-6
"""Of time, for the rates of moving points [s]."""


@dataclass(frozen=True)
class Course:
    """Motion of the bodies of a scene, in its order, at increasing times [s], of which the first is the start.

    places [m]: of the origins of their frames, (samples, bodies, 2, lanes), and velocities [m/s]; angles [rad],
    continuous, (samples, bodies, lanes), and rates [rad/s]
    """

    times: Array
    places: Array
    velocities: Array
    angles: Array
    rates: Array


class _Rigid:
    """The coordinates of one lane of a course."""

    def __init__(self, evaluator: Evaluator, course: Course, lane: int, of_model: int) -> None:
        """lane: of the course; of_model: of the evaluator's model."""
        model = evaluator.model
        numbers = {name: number for number, name in enumerate(model.stated.bodies)}
        order = [numbers[name] for name in model.frames]
        own = (course.places, course.angles, course.velocities, course.rates)
        self._places, self._angles, velocities, rates = (part[..., lane][:, order] for part in own)
        self._frames = list(model.frames.values())
        stated = [np.ravel(model.scene.start(name).angle) for name in model.frames]
        self._stated = np.array([angle[of_model % angle.size] for angle in stated])
        found = points([vector for frame in self._frames for vector in frame.vectors], model.unknowns, of_model)
        matrix = found.matrix.reshape(found.constant.size, model.unknowns)
        # Moving points of the ground are the first unknowns (`place`), known by their functions.
        paths = [f for path in model.stated.ground_points.values() for f in (path.x, path.y)]
        self._driven, driven_rates = _followed(paths, course.times)
        matrix = np.concatenate([matrix, np.eye(len(paths), model.unknowns)])
        self._inverse = np.linalg.pinv(matrix)
        self._constant = np.append(found.constant.ravel(), np.zeros(len(paths)))
        self.q = self._coordinates(self._places, self._angles, self._driven)
        turning = rates[..., None] * quarter(_direction(self._angles))
        self.v = np.concatenate([self._stacked(velocities, turning), driven_rates], axis=1) @ self._inverse.T

    def _coordinates(self, places: Array, angles: Array, driven: Array) -> Array:
        """Return the coordinates of poses of the bodies and positions of moving points, (samples, unknowns)."""
        here = np.concatenate([self._stacked(places, _direction(angles)), driven], axis=1)
        return np.asarray((here - self._constant.ravel()) @ self._inverse.T)

    def _stacked(self, origins: Array, directors: Array) -> Array:
        """Stack the known vectors of all frames, (samples, 2 vectors)."""
        parts = list[Array]()
        for k, frame in enumerate(self._frames):
            parts += [origins[:, k], directors[:, k]] if isinstance(frame, RigidFrame) else [origins[:, k]]
        return np.concatenate(parts, axis=1)

    def way(self) -> tuple[Array, Index]:
        """Poses close enough to count turns, see `Evaluator.along`: far ones are joined by even turns.

        They begin with the bodies turned as stated, where the motion may not begin.
        """
        angles = np.concatenate([self._stated[None], self._angles])
        places, driven = (np.concatenate([part[:1], part]) for part in (self._places, self._driven))
        way, sample = [self._coordinates(places[:1], angles[:1], driven[:1])], [-1]
        turned = np.max(np.abs(np.diff(angles, axis=0)), axis=1, initial=0.0)
        for k, count in enumerate(np.ceil(turned / TURN).astype(int).tolist()):
            if count > 1:
                share = np.arange(1, count)[:, None] / count
                place = places[k] + share[..., None] * (places[k + 1] - places[k])
                angle = angles[k] + share * (angles[k + 1] - angles[k])
                moved = driven[k] + share * (driven[k + 1] - driven[k])
                way.append(self._coordinates(place, angle, moved))
                sample += [-1] * (count - 1)
            way.append(self.q[k : k + 1])
            sample.append(k)
        return np.concatenate(way), np.array(sample)


def machines(scene: Scene, values: Mapping[str, Array], course: Course, lanes: list[int]) -> Iterator[Felt]:
    """Lanes of a scene along their motion, on one model. Raises InputError."""
    _refuse_states(scene)
    picked = {path: np.asarray(numbers, dtype=float)[lanes] for path, numbers in values.items()}
    model = build(scene.with_lanes(picked), len(lanes), float(course.times[-1]))
    for k, lane in enumerate(lanes):
        yield _quantities(Evaluator(model, k), course, lane, k)


def machine(scene: Scene, values: Mapping[str, Array], course: Course, lane: int) -> Felt:
    """A lane of a scene along its motion, on a model of its own. Raises InputError."""
    _refuse_states(scene)
    one = scene.with_values({path: float(numbers[lane]) for path, numbers in values.items()})
    return _quantities(Evaluator.of(one, horizon=float(course.times[-1])), course, lane, 0)


def _refuse_states(scene: Scene) -> None:
    """Raises InputError for states, which places and angles of bodies do not tell."""
    for name in scene.states:
        raise InputError(f"states.{name}: accelerations and forces by the places of bodies know no states; use gauss")


def _quantities(evaluator: Evaluator, course: Course, lane: int, of_model: int) -> Felt:
    rigid = _Rigid(evaluator, course, lane, of_model)
    none = np.zeros((len(course.times), 0, KEPT))  # machines with contacts are told by their states
    return Felt(evaluator, course.times, rigid.q, rigid.v, rigid.way, of_model, none)


def _followed(paths: list[Function], times: Array) -> tuple[Array, Array]:
    """Values of functions of time at some times, (times, functions), and their rates."""
    before = np.maximum(times - _STEP, 0.0)
    now, ahead, behind = (
        np.array([f(t) for f in paths]).reshape(-1, len(times)).T for t in (times, times + _STEP, before)
    )
    return now, (ahead - behind) / (times + _STEP - before)[:, None]


def _direction(angle: Array) -> Array:
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)
