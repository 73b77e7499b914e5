"""What the joints of a rigid machine exert along its motion.

As `joint_reactions` at one state, by the balance of every body by itself, at all samples at once.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from shoal.errors import InputError
from shoal.mechanics import joints, plane
from shoal.mechanics.affine import Affine
from shoal.mechanics.analysis.evaluate import points
from shoal.mechanics.analysis.felt import Felt, dot, quarter
from shoal.mechanics.analysis.free_bodies import FreeBodies
from shoal.mechanics.analysis.joint_reactions import RANK
from shoal.mechanics.analysis.singular import SHARE
from shoal.mechanics.frames import RigidFrame
from shoal.mechanics.joints import Along, Apart, Geared, Meet, Sum, Turned
from shoal.mechanics.numerics.tile import Array
from shoal.mechanics.reach import span
from shoal.mechanics.rubbing import ROUNDS, SETTLED
from shoal.scene import GROUND, Attachment, Revolute, Slider
from shoal.scene.joints import DrivenAngle


class Reaction(NamedTuple):
    """What a joint exerts on its second body, friction included, at every sample.

    force [N], (samples, d); torque [N m], (samples,), in space a vector, (samples, 3); drive: in space that of a drive
    about its axis, (samples,)
    """

    force: Array
    torque: Array
    drive: Array | None = None


def reactions_along(felt: Felt, names: tuple[str, ...], kind: type[Balance]) -> dict[str, Reaction]:
    """What some joints exert; the model has one lane. Raises InputError, see `not_unique`.

    kind: how forces and torques act on its bodies, of the plane or of space
    """
    bodies = FreeBodies(felt.evaluator, float(felt.times[-1]))
    rubbing = felt.evaluator.model.forces.size - bodies.evaluator.model.forces.size
    at, rate, change = bodies.state(felt.q, felt.v, felt.a)
    balance = kind(bodies, at, rate, float(np.ravel(span(bodies.scene))[0]))
    force = np.empty_like(at)
    for k, (q, v, t) in enumerate(zip(at, rate, felt.times, strict=True)):
        bodies.evaluator.turns = felt.turns[k, rubbing:]
        force[k] = bodies.evaluator.force(q, v, float(t))
    missing = balance.wrenches((bodies.mass @ change.T).T - force)
    unknown = list(balance.components())
    columns = np.stack([part.wrench for part in unknown], axis=-1)
    _require_unique(bodies.scene.name, columns[-1], unknown, names)
    inverse = np.linalg.pinv(columns, rcond=RANK)
    held: dict[str, Array] = {}
    for _ in range(ROUNDS):
        rubbed = {part.joint: part for part in balance.friction(held)}
        left = missing - sum((part.wrench for part in rubbed.values()), np.zeros(1))
        size = np.einsum("nkw,nw->nk", inverse, left)
        last, held = held, balance.held(unknown, size)
        if all(np.all(np.abs(now - last.get(name, 0.0)) <= SETTLED * now) for name, now in held.items()):
            break
    found = {}
    for name in names:
        mine = [(size[:, k], part) for k, part in enumerate(unknown) if part.joint == name]
        mine += [(np.ones(len(at)), rubbed[name])] if name in rubbed else []
        acting = [part.times(much) for much, part in mine]
        force, torque = (np.sum([getattr(one, side) for one in acting], axis=0) for side in ("force", "torque"))
        driven = torque.ndim > 1 and isinstance(bodies.scene.joints[name], DrivenAngle)
        found[name] = Reaction(force, torque, mine[0][0] if driven else None)
    return found


def _require_unique(scene: str, columns: Array, unknown: list[Part], names: tuple[str, ...]) -> None:
    """Of the forces of some joints, by what all exert per unit, (rows of the bodies, unknowns). Raises InputError."""
    _, sizes, right = np.linalg.svd(columns, full_matrices=True)
    rank = int(np.sum(sizes > RANK * sizes[0]))
    for name in names:
        mine = [k for k, part in enumerate(unknown) if part.joint == name]
        if np.any(np.abs(right[rank:, mine]) > SHARE):
            raise not_unique(scene, name)


def not_unique(scene: str, joint: str) -> InputError:
    """The refusal of a joint's forces in a machine that cannot tell them from those of others."""
    return InputError(
        f"channels: the forces of joint {joint} are not unique: {scene} holds itself more than it needs to; "
        "measure another joint, or leave out what is redundant"
    )


class Part(NamedTuple):
    """What acts in a joint: on all bodies by itself, (samples, rows of the bodies), and as told of the second body."""

    joint: str
    wrench: Array
    force: Array
    torque: Array

    def times(self, factor: Array) -> Part:
        """Scaled at every sample, (samples,)."""
        return Part(self.joint, *((factor * np.asarray(one).T).T for one in (self.wrench, self.force, self.torque)))


class Balance:
    """Forces and torques on free bodies along a motion; a wrench is force and torque over the lever, (3,) of a body.

    at, rate: of the free bodies' coordinates, (samples, unknowns); lever [m]: the machine's size
    """

    def __init__(self, bodies: FreeBodies, at: Array, rate: Array, lever: float) -> None:
        self.at, self.rate = at, rate
        self._bodies, self._lever = bodies, lever
        self._frames = bodies.placement.frames
        self._numbers = {name: number for number, name in enumerate(self._frames)}
        self._origins = {name: self._value(frame.vectors[0]) for name, frame in self._frames.items()}

    def _value(self, vector: Affine) -> Array:
        found = points([vector], self._bodies.unknowns)
        return np.asarray(self.at @ found.matrix[0].T + found.constant[0])

    def _speed(self, vector: Affine) -> Array:
        return np.asarray(self.rate @ points([vector], self._bodies.unknowns).matrix[0].T)

    def _place(self, side: Attachment) -> Array:
        return self._value(self._bodies.placement.point(self._bodies.scene, side))

    def wrenches(self, force: Array) -> Array:
        """Of generalised forces on the free bodies, (samples, unknowns)."""
        found = np.zeros((len(force), 3 * len(self._frames)))
        for name, frame in self._frames.items():
            first = 3 * self._numbers[name]
            found[:, first : first + 2] = force[:, list(frame.vectors[0].own or ())]
            if isinstance(frame, RigidFrame):
                director = self._value(frame.directors[0])
                on = force[:, list(frame.directors[0].own or ())]
                found[:, first + 2] = dot(quarter(director), on) / self._lever
        return found

    def _on(self, *acting: tuple[str, Array, Array, Array | float]) -> Array:
        """The wrench of (body, place, force, torque)."""
        found = np.zeros((len(self.at), 3 * len(self._frames)))
        for body, place, force, torque in acting:
            if body == GROUND:
                continue
            first = 3 * self._numbers[body]
            found[:, first : first + 2] += force
            if isinstance(self._frames[body], RigidFrame):
                moment = plane.cross((place - self._origins[body]).T, force.T)
                found[:, first + 2] += (moment + torque) / self._lever
        return found

    def _pair(self, name: str, first: Attachment, second: Attachment, where: Array, force: Array) -> Part:
        """A force on the second body at a place, and its opposite on the first there."""
        wrench = self._on((second.body, where, force, 0.0), (first.body, where, -force, 0.0))
        return Part(name, wrench, force, np.zeros(len(force)))

    def _torques(self, name: str, sides: tuple[Attachment, ...], factors: tuple[float, ...]) -> Part:
        none = np.zeros((len(self.at), 2))
        acting = [(side.body, none, none, factor) for side, factor in zip(sides, factors, strict=True)]
        return Part(name, self._on(*acting), none, np.full(len(self.at), factors[0]))

    def components(self) -> Iterator[Part]:
        """The unknowns of all joints, per unit."""
        ones = np.ones((len(self.at), 1))
        for name, one in joints.of_scene(self._bodies.scene):
            match one:
                case Meet():
                    where = self._place(one.second)
                    for axis in np.eye(2):
                        yield self._pair(name, one.first, one.second, where, ones * axis)
                case Turned():
                    yield self._torques(name, (one.second, one.first), (1.0, -1.0))
                case Geared():
                    yield self._torques(name, one.sides, one.factors)
                case Along():
                    across = quarter(self._line(one.first, one.direction))
                    yield self._pair(name, one.first, one.second, self._place(one.second), across)
                case Apart():
                    way = self._place(one.second) - self._place(one.first)
                    yield self._pair(name, one.first, one.second, self._place(one.second), unit(way))
                case Sum():
                    axes = [np.eye(2)["xy".index(term.axis)] for term in one.terms]
                    acting = [
                        (term.at.body, self._place(term.at), ones * term.factor * axis, 0.0)
                        for term, axis in zip(one.terms, axes, strict=True)
                    ]
                    yield Part(name, self._on(*acting), acting[0][2], np.zeros(len(self.at)))
                case _:
                    raise joints.unknown(one)

    def _line(self, first: Attachment, turn: object) -> Array:
        """Unit vector of a slider's line."""
        direction = self._bodies.placement.direction(self._bodies.scene, first)
        return unit(self._value(direction.turned(plane.rotation(turn))))

    def _turning(self, side: Attachment) -> Array:
        """The rate of a side's direction [rad/s]."""
        direction = self._bodies.placement.direction(self._bodies.scene, side)
        line = self._value(direction)
        return np.asarray(plane.cross(line.T, self._speed(direction).T) / dot(line, line))

    def held(self, unknown: list[Part], size: Array) -> dict[str, Array]:
        """The force of each joint whose friction depends on it [N], (samples,)."""
        found = {}
        for name, joint in self._bodies.scene.joints.items():
            if isinstance(joint, Revolute | Slider) and joint.share:
                parts = [size[:, [k]] * part.force for k, part in enumerate(unknown) if part.joint == name]
                found[name] = np.linalg.norm(np.sum(parts, axis=0), axis=1)
        return found

    def friction(self, held: Mapping[str, Array]) -> Iterator[Part]:
        """What rubs in every joint; held: as `held` found it, where it is known."""
        for name, joint in self._bodies.scene.joints.items():
            if not isinstance(joint, Revolute | Slider) or not joint.resists:
                continue
            placement, scene = self._bodies.placement, self._bodies.scene
            if isinstance(joint, Revolute):
                speed = self._turning(joint.second) - self._turning(joint.first)
                one = self._torques(name, (joint.second, joint.first), (1.0, -1.0))
            else:
                line = self._line(joint.first, joint.direction)
                here, there = placement.point(scene, joint.first), placement.point(scene, joint.second)
                way, moving = self._value(there) - self._value(here), self._speed(there) - self._speed(here)
                carried = self._turning(joint.first)[:, None] * quarter(way)
                speed = dot(line, moving - carried)
                one = self._pair(name, joint.first, joint.second, self._place(joint.second), line)
            yield one.times(-joint.resistance(speed, held.get(name, 0.0)))


def unit(vectors: Array) -> Array:
    """Vectors (..., d) of length one along some."""
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))
