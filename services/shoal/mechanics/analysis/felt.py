"""Virtual sensors along a motion; accelerations of all coordinates follow from Gauss's principle."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import cached_property

import numpy as np

from shoal.mechanics import plane
from shoal.mechanics import rotation as turns_of
from shoal.mechanics.affine import Affine, points
from shoal.mechanics.analysis import triads
from shoal.mechanics.analysis.evaluate import Evaluator, Pressing
from shoal.mechanics.assembly.build import build
from shoal.mechanics.assembly.groups import place_of
from shoal.mechanics.ended import named_turns, start_angles
from shoal.mechanics.frames import BeamFrame, Frame, PointFrame
from shoal.mechanics.machine import Machine
from shoal.mechanics.model import Model
from shoal.mechanics.numerics.tile import Array, Index
from shoal.mechanics.states import States
from shoal.scene import Attachment, Scene
from shoal.scene.dimensions import padded
from shoal.scene.signals import refuse_sampled

TURN = 1.0
"""The turns of angle forces are counted at poses that are no farther apart [rad]."""
HELD = "reactions and virtual sensors know no held values yet; take a continuous controller"
"""Why machines with sampled signals are refused."""
_GAUGE = 1e-3
"""Length of a strain gauge over that of its rod."""

Tilt = float | tuple[float, ...]
"""Angle [rad] of a sensor's axes against those of its body, about z, or in space a rotation vector."""


class Felt:
    """One lane of a machine along its motion.

    evaluator: of a model one of whose lanes it is; times [s]: of the samples, the first is the start; q, v: coordinates
    and rates, (samples, unknowns); way: returns poses from the start on, see `Evaluator.along`; lane: of the model;
    contacts: what they do, see `States`, (samples, contacts, KEPT)
    """

    def __init__(
        self, evaluator: Evaluator, times: Array, q: Array, v: Array, way: Callable[[], tuple[Array, Index]], lane: int,
        contacts: Array,
    ) -> None:  # fmt: skip
        self.evaluator, self.times, self.q, self.v, self.lane = evaluator, times, q, v, lane
        self._contacts = contacts
        self._way = way
        self.scene = scene = evaluator.model.stated
        stated = padded(scene.gravity, scene.dimensions)
        self.gravity = np.array([float(np.ravel(part)[lane % np.size(part)]) for part in stated])

    @cached_property
    def _along(self) -> tuple[Array, Array, list[Pressing], list[dict[str, float]]]:
        """Accelerations, turns, what contacts exert and what loads follow."""
        refuse_sampled(self.scene, HELD)
        counted = self.evaluator.model.forces.size > 0 or len(self.evaluator.signal_turns) > 0
        way, sample = self._way() if counted else (self.q, np.arange(len(self.q)))
        return self.evaluator.along(way, sample, self.v, np.asarray(self.times, dtype=float), self._contacts)

    @property
    def a(self) -> Array:
        """Accelerations of the coordinates, (samples, unknowns)."""
        return self._along[0]

    @property
    def turns(self) -> Array:
        """The angles that angle forces have counted at every sample [rad], (samples, forces)."""
        return self._along[1]

    @property
    def pressing(self) -> list[Pressing]:
        """Forces of contacts at every sample."""
        return self._along[2]

    @property
    def strengths(self) -> list[dict[str, float]]:
        """Values of what loads follow at every sample, by their fields."""
        return self._along[3]

    def specific_force(self, at: Attachment, tilt: Tilt = 0.0) -> Array:
        """Acceleration less gravity at a place of a body, along axes turned by `tilt` from its own.

        [m/s^2], (samples, d): at rest an accelerometer shows gravity upwards.
        """
        name, place = place_of(self.scene, at)
        frame = self._frame(name)
        found = points([frame.point(place), frame.direction(place)], self.evaluator.model.unknowns, self.lane)
        acceleration = self.a @ found.matrix[0].T - self.gravity
        if self.scene.dimensions != plane.DIMENSIONS:
            axes, _ = self._axes(frame, place)
            felt: Array = np.einsum("ij,njk,nk->ni", _sensor(tilt), axes, acceleration)
            return felt
        assert not isinstance(tilt, tuple)
        x = self.q @ found.matrix[1].T + found.constant[1]
        x = x / np.linalg.norm(x, axis=1, keepdims=True)
        c, s = np.cos(tilt), np.sin(tilt)
        x = c * x + s * quarter(x)
        return np.stack([dot(x, acceleration), dot(quarter(x), acceleration)], axis=1)

    def spin(self, at: Attachment, tilt: Tilt = 0.0) -> Array:
        """Angular velocity in space along the same axes [rad/s], (samples, 3)."""
        name, place = place_of(self.scene, at)
        axes, change = self._axes(self._frame(name), place)
        own = [dot(change[:, i], axes[:, j]) for i, j in ((1, 2), (2, 0), (0, 1))]
        return np.asarray(np.stack(own, axis=1) @ _sensor(tilt).T)

    def strain(self, at: Attachment, height: float, side: float) -> Array:
        """Return the axial strain of a straight rod at a height (local y) and side (z) of its section [m], (samples,).

        In space for director rods.
        """
        name, place = place_of(self.scene, at)
        frame = self._frame(name)
        assert isinstance(frame, BeamFrame)
        length = float(np.ravel(frame.length)[self.lane % np.size(frame.length)])
        gauge = _GAUGE * length
        middle = min(max(float(place[0]), gauge / 2), length - gauge / 2)
        ends = [(middle + sign * gauge / 2, *(0.0,) * (len(place) - 1)) for sign in (-1.0, 1.0)]
        vectors = [*(frame.point(end) for end in ends), *(frame.direction(end) for end in ends)]
        found = points(vectors, self.evaluator.model.unknowns, self.lane)
        begin, end, here, there = (self.q @ found.matrix[k].T + found.constant[k] for k in range(4))
        if self.scene.dimensions == plane.DIMENSIONS:
            turned = np.arctan2(plane.cross(here.T, there.T), dot(here, there))
            return np.asarray((np.linalg.norm(end - begin, axis=1) - height * turned) / gauge - 1.0)
        before, behind = (self._axes(frame, one)[0] for one in ends)
        change, mean = (behind - before) / gauge, (behind + before) / 2
        about_y, about_z = dot(change[:, 2], mean[:, 0]), dot(change[:, 0], mean[:, 1])
        return np.asarray(np.linalg.norm(end - begin, axis=1) / gauge - 1.0 - height * about_z + side * about_y)

    def _frame(self, body: str) -> Frame:
        return self.evaluator.model.frames[body]

    def _axes(self, frame: Frame, place: tuple[float, ...]) -> tuple[Array, Array]:
        """Unit vectors along the axes of a body at a place in space, as rows, and their rates, (samples, 3, 3)."""
        if isinstance(frame, PointFrame):
            fixed = np.broadcast_to(np.eye(3), (len(self.q), 3, 3))
            return fixed, np.zeros_like(fixed)
        return triads.along(frame, place, self.q, self.v, self.lane)


def lanes_of(states: States, times: Array, lanes: list[int]) -> Iterator[Felt]:
    """Lanes of a motion whose states are known, on its model."""
    model = states.model
    if model.slowed:  # what moves more slowly than it would is felt as it would move
        free = build(model.stated, model.lanes, float(times[-1]))
        turned = model.signal_angles
        model = replace(free, q0=model.q0, v0=model.v0, start_angles=model.start_angles, signal_angles=turned)
    for lane in lanes:
        yield _quantities(Evaluator(model, lane, one_sided=True), states, times, lane, lane)


def lane_of(states: States, times: Array, scene: Scene, values: Mapping[str, Array], lane: int) -> Felt:
    """A lane of a motion whose states are known, on a model of its own. Raises InputError."""
    one = scene.with_values({path: float(numbers[lane]) for path, numbers in values.items()})
    model = lane_start(states, Machine.of(one).model(float(times[-1])), lane)
    return _quantities(Evaluator(model, one_sided=True), states, times, lane, 0)


def lane_start(states: States, model: Model, lane: int) -> Model:
    """Return a model of one lane that begins where the motion does, be that elsewhere than stated, with its turns."""
    begun = states.model
    turns = named_turns(begun, begun.start_angles[:, lane % begun.start_angles.shape[1]])
    q, v = (part[0, :, lane, None].copy() for part in (states.q, states.v))
    turned = model.signal_angles.copy()
    turned[: len(begun.signal_angles)] = begun.signal_angles[:, [lane % begun.signal_angles.shape[1]]]
    angles = start_angles(model, [turns])
    return replace(model, q0=q, v0=v, start_angles=angles, signal_angles=turned, shared_tiles={})


def _quantities(evaluator: Evaluator, states: States, times: Array, lane: int, of_model: int) -> Felt:
    q, v = states.q[..., lane], states.v[..., lane]
    contacts = states.contacts[..., lane]
    return Felt(evaluator, times, q, v, lambda: way_between(evaluator, times, q, v, of_model), of_model, contacts)


def way_between(evaluator: Evaluator, times: Array, q: Array, v: Array, lane: int) -> tuple[Array, Index]:
    """Poses close enough to count turns: those far apart are joined by cubics."""
    found = points(_directions(evaluator), evaluator.model.unknowns, lane)
    line, change = (np.einsum("kdu,nu->nkd", found.matrix, one) for one in (q, v))
    line = line + found.constant
    speed = np.max(np.linalg.norm(change, axis=-1) / np.linalg.norm(line, axis=-1), axis=1, initial=0.0)
    way, sample = [q[:1]], [0]
    for k, step in enumerate(np.diff(times).tolist(), start=1):
        count = int(np.ceil(step * max(speed[k - 1], speed[k]) / TURN))
        if count > 1:
            x = np.arange(1, count)[:, None] / count
            left, right = (1 + 2 * x) * (1 - x) ** 2 * q[k - 1], x**2 * (3 - 2 * x) * q[k]
            way.append(left + right + step * (x * (1 - x) ** 2 * v[k - 1] + x**2 * (x - 1) * v[k]))
            sample += [-1] * (count - 1)
        way.append(q[k : k + 1])
        sample.append(k)
    return np.concatenate(way), np.array(sample)


def _directions(evaluator: Evaluator) -> list[Affine]:
    """Return the directions of all bodies, of flexible ones at every node."""
    found = list[Affine]()
    for frame in evaluator.model.frames.values():
        if isinstance(frame, BeamFrame):
            found += [node[1] for node in frame.nodes]
        elif not isinstance(frame, PointFrame):
            found += frame.directors
    return found


def _sensor(tilt: Tilt) -> Array:
    """The axes of a sensor as rows, along those of its body."""
    vector = np.array(tilt if isinstance(tilt, tuple) else (0.0, 0.0, tilt))
    return np.asarray(turns_of.of_vector(vector[:, None])[..., 0]).T


def quarter(vectors: Array) -> Array:
    """Turned by a quarter, counter-clockwise, (..., 2)."""
    return np.stack([-vectors[..., 1], vectors[..., 0]], axis=-1)


def dot(a: Array, b: Array) -> Array:
    """Products of vectors, (...,)."""
    return np.asarray(np.sum(a * b, axis=-1))
