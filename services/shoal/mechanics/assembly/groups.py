"""What joints make common before any coordinate exists: places that coincide, directions that turn together."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from shoal.errors import InputError
from shoal.mechanics.assembly.affine import Affine, Number
from shoal.mechanics.assembly.pose import as_complex, unit
from shoal.scene import GROUND, Attachment, Coupling, Parallel, Perpendicular, Revolute, Rod, Scene, Slider, Weld

Place = tuple[str, Number]


@dataclass
class JointPoint:
    """Places that joints hold together; `where` is known once a body that has it is placed.

    line: joint, point [m] and unit direction of a fixed line that the place stays on.
    """

    name: str
    places: list[Place]
    where: Affine | None = None
    line: tuple[str, Number, Number] | None = None
    on_line: bool = False
    """Whether `where` was made so that the line holds."""

    def local(self, body: str) -> Number:
        """The place in a body's frame [m]."""
        return next(p for owner, p in self.places if owner == body)

    def touches(self, body: str) -> bool:
        """Whether a body has this place."""
        return any(owner == body for owner, _ in self.places)


def place_of(scene: Scene, attachment: Attachment) -> Place:
    """The body (or ground, or moving point of the ground) and the place in its frame [m]."""
    if attachment.body == GROUND and isinstance(attachment.point, str):
        return moving(attachment.point), 0.0j
    return attachment.body, as_complex(scene.location(attachment))


def moving(point: str) -> str:
    """The name under which a moving point of the ground stands among the bodies."""
    return f"{GROUND}.{point}"


def joint_points(scene: Scene) -> list[JointPoint]:
    """Group the places that revolute joints, welds and sliders on the ground name, transitively."""
    groups: list[JointPoint] = []
    for name, joint in scene.joints.items():
        if isinstance(joint, Revolute | Weld):
            _merge(groups, JointPoint(name, [place_of(scene, joint.first), place_of(scene, joint.second)]))
        elif isinstance(joint, Slider) and joint.first.body == GROUND and not isinstance(joint.first.point, str):
            _, base = place_of(scene, joint.first)
            line = (name, base, unit(joint.direction))
            _merge(groups, JointPoint(name, [place_of(scene, joint.second)], line=line))
    for group in groups:
        bodies = [body for body, _ in group.places]
        for body in bodies:
            if bodies.count(body) > 1:
                raise InputError(f"joints.{group.name}: two places of {body} cannot be joined into one point")
        grounded = [position for body, position in group.places if body == GROUND]
        if grounded:
            group.where = Affine({}, grounded[0])
    return groups


def _merge(groups: list[JointPoint], new: JointPoint) -> None:
    for group in [g for g in groups if any(_same(p, q) for p in g.places for q in new.places)]:
        groups.remove(group)
        new.places += [p for p in group.places if not any(_same(p, q) for q in new.places)]
        new.line = new.line or group.line
    groups.append(new)


def _same(one: Place, other: Place) -> bool:
    return one[0] == other[0] and bool(np.all(np.abs(one[1] - other[1]) < 1e-12))


@dataclass
class Orientations:
    """Rigid bodies that keep their relative angles: body -> (root, exp(i angle) from the root's axis to its own)."""

    of: dict[str, tuple[str, Number]] = field(default_factory=dict)
    axis: dict[str, Affine] = field(default_factory=dict)
    """Axis of each root that has one already."""

    def root(self, body: str) -> tuple[str, Number]:
        """Root and relative direction of a body; a body by itself is its own root."""
        return self.of.get(body, (body, 1.0 + 0.0j))

    def join(self, name: str, first: str, second: str, turn: Number) -> None:
        """Keep second = turn * first. Raises InputError if other joints already keep another angle."""
        (root, a), (other, b) = self.root(first), self.root(second)
        if root == other:
            if np.any(np.abs(b - a * turn) > 1e-9):
                raise InputError(f"joints.{name}: other joints already keep another angle between {first} and {second}")
            return
        if other == GROUND:  # the ground stays a root
            root, other, a, b, turn = other, root, b, a, np.conj(turn)
        shift = a * turn * np.conj(b)
        members = [body for body in {*self.of, other} if self.root(body)[0] == other]
        for body in members:
            self.of[body] = (root, shift * self.root(body)[1])


def orientations(scene: Scene) -> Orientations:
    """Group the rigid bodies whose relative angle joints keep; flexible bodies are held by constraints instead."""
    found = Orientations(axis={GROUND: Affine({}, 1.0 + 0.0j)})
    for name, joint in scene.joints.items():
        turn = kept_turn(scene, joint)
        if (
            turn is not None
            and not isinstance(joint, Coupling)
            and all(is_stiff(scene, side.body) for side in (joint.first, joint.second))
        ):
            found.join(name, joint.first.body, joint.second.body, turn)
    return found


def kept_turn(scene: Scene, joint: object) -> Number | None:
    """exp(i angle) from the first body's direction to the second's, if the joint keeps it."""
    if isinstance(joint, Weld):
        return unit(joint.angle) if joint.angle is not None else _start_turn(scene, joint)
    if isinstance(joint, Slider) and joint.rotation == "locked":
        return _start_turn(scene, joint)
    if isinstance(joint, Parallel):
        return np.sign(np.real(_start_turn(scene, joint)) + 1e-12)
    if isinstance(joint, Perpendicular):
        return 1j * np.sign(np.imag(_start_turn(scene, joint)) + 1e-12)
    return None


def _start_turn(scene: Scene, joint: Weld | Slider | Parallel | Perpendicular) -> Number:
    first, second = (unit(start_angle(scene, side)) for side in (joint.first, joint.second))
    return np.conj(first) * second


def start_angle(scene: Scene, side: Attachment) -> Number:
    """Direction [rad] of a body at an attachment at time zero, as the scene states it."""
    if side.body == GROUND:
        return 0.0
    body = scene.bodies[side.body]
    angle: Number = scene.start(side.body).angle
    if isinstance(body, Rod) and body.element != "rigid" and body.curvature:
        angle = angle + body.turn(scene.location(side)[0])
    return angle


def is_stiff(scene: Scene, body: str) -> bool:
    """Whether a body is the ground or rigid."""
    return body == GROUND or scene.bodies[body].element == "rigid"
