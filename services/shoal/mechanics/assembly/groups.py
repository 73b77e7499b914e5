"""Shared points and directions: joints identify points that coincide and directions that turn together."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from shoal.errors import InputError
from shoal.mechanics import joints, plane
from shoal.mechanics.affine import Affine, combined, fixed
from shoal.mechanics.frames import Place
from shoal.mechanics.joints import Along, Meet, Turned
from shoal.mechanics.numerics.tile import Array, Number
from shoal.scene import GROUND, Attachment, Rod, Scene


@dataclass
class JointPoint:
    """Places that joints hold together; `where` is known once a body that has it is placed.

    places: bodies and places in their frames [m]. line: joint, point [m] and unit direction of a fixed line that the
    place stays on, (d, lanes) each.
    """

    name: str
    places: list[tuple[str, Place]]
    where: Affine | None = None
    line: tuple[str, Array, Array] | None = None
    on_line: bool = False
    """Whether `where` was made so that the line holds."""

    def local(self, body: str) -> Place:
        """The place in a body's frame [m]."""
        return next(p for owner, p in self.places if owner == body)

    def touches(self, body: str) -> bool:
        """Return whether a body has this place."""
        return any(owner == body for owner, _ in self.places)


def place_of(scene: Scene, attachment: Attachment) -> tuple[str, Place]:
    """The body (or ground, or moving point of the ground) and the place in its frame [m]."""
    if attachment.body == GROUND and isinstance(attachment.point, str):
        return moving(attachment.point), (0.0,) * scene.dimensions
    return attachment.body, scene.location(attachment)


def moving(point: str) -> str:
    """The name under which a moving point of the ground stands among the bodies."""
    return f"{GROUND}.{point}"


def joint_points(scene: Scene) -> list[JointPoint]:
    """Group the places that joints let coincide, or keep on a line of the ground, transitively."""
    groups: list[JointPoint] = []
    for name, condition in joints.of_scene(scene):
        if isinstance(condition, Meet) and not (condition.within or condition.held):
            _merge(groups, JointPoint(name, [place_of(scene, side) for side in (condition.first, condition.second)]))
        elif isinstance(condition, Along) and condition.is_fixed:
            line = name, plane.vector(*scene.location(condition.first)), _direction(scene, condition)
            _merge(groups, JointPoint(name, [place_of(scene, condition.second)], line=line))
    for group in groups:
        bodies = [body for body, _ in group.places]
        for body in bodies:
            if bodies.count(body) > 1:
                raise InputError(f"joints.{group.name}: two places of {body} cannot be joined into one point")
        grounded = [position for body, position in group.places if body == GROUND]
        if grounded:
            group.where = fixed(plane.vector(*grounded[0]))
    return groups


def _direction(scene: Scene, line: Along) -> Array:
    """The unit direction of a line on the ground, (d, lanes)."""
    if isinstance(line.direction, tuple):
        axis = plane.vector(*line.direction)
        return np.asarray(axis / np.sqrt(sum(axis**2)))
    return plane.vector(*plane.unit(line.direction), *(0.0,) * (scene.dimensions - plane.DIMENSIONS))


def _merge(groups: list[JointPoint], new: JointPoint) -> None:
    bodies = {body for body, _ in new.places}
    for group in [g for g in groups if any(_same(p, q) for p in g.places if p[0] in bodies for q in new.places)]:
        groups.remove(group)
        new.places += [p for p in group.places if not any(_same(p, q) for q in new.places)]
        new.line = new.line or group.line
    groups.append(new)


def _same(one: tuple[str, Place], other: tuple[str, Place]) -> bool:
    near = (np.all(np.abs(np.subtract(a, b)) < 1e-12) for a, b in zip(one[1], other[1], strict=True))
    return one[0] == other[0] and all(near)


@dataclass
class Orientations:
    """Rigid bodies that keep their relative angles.

    of: body -> its root and the rotation (d, d, lanes) from the root's directors to its own, as columns. directors: of
    each root that has them already.
    """

    of: dict[str, tuple[str, Array]] = field(default_factory=dict)
    directors: dict[str, tuple[Affine, ...]] = field(default_factory=dict)
    dimensions: int = plane.DIMENSIONS
    driven: set[str] = field(default_factory=set)
    """Roots whose directors have the length of others' by the cosine and the sine of driven angles between them."""

    def root(self, body: str) -> tuple[str, Array]:
        """Root and relative rotation of a body; a body by itself is its own root."""
        return self.of.get(body, (body, np.eye(self.dimensions)[..., None]))

    def of_body(self, body: str) -> tuple[Affine, ...]:
        """The directors of a body whose root has them."""
        root, relative = self.root(body)
        return rotated(self.directors[root], relative)

    def join(self, name: str, first: str, second: str, turn: Array) -> None:
        """Keep second = first turned. Raises InputError if other joints already keep another angle."""
        (root, a), (other, b) = self.root(first), self.root(second)
        if root == other:
            if np.any(np.abs(b - product(a, turn)) > 1e-9):
                raise InputError(f"joints.{name}: other joints already keep another angle between {first} and {second}")
            return
        if other == GROUND:  # the ground stays a root
            root, other, a, b, turn = other, root, b, a, transposed(turn)
        shift = product(product(a, turn), transposed(b))
        members = [body for body in {*self.of, other} if self.root(body)[0] == other]
        for body in members:
            self.of[body] = (root, product(shift, self.root(body)[1]))


def product(a: Array, b: Array) -> Array:
    """The product of matrices (d, d, lanes)."""
    rows = range(len(a))
    return np.stack([np.stack([sum(a[i, k] * b[k, j] for k in rows) for j in rows]) for i in rows])


def transposed(a: Array) -> Array:
    """A matrix (d, d, lanes), transposed."""
    return a.transpose(1, 0, 2)


def rotated(directors: tuple[Affine, ...], rotation: Array) -> tuple[Affine, ...]:
    """Directors combined by the columns of a rotation (d, d, lanes)."""
    return tuple(combined(directors, tuple(rotation[:, k])) for k in range(len(directors)))


def orientations(scene: Scene) -> Orientations:
    """Group the rigid bodies whose relative angle joints keep; flexible bodies are held by constraints instead."""
    axes = np.eye(plane.DIMENSIONS)[..., None]
    found = Orientations(directors={GROUND: tuple(fixed(axis) for axis in axes)})
    for name, condition in joints.of_scene(scene):
        if isinstance(condition, Turned) and not condition.driven:
            sides = condition.first, condition.second
            if all(is_stiff(scene, side.body) for side in sides):
                found.join(name, sides[0].body, sides[1].body, kept_rotation(scene, condition))
    found.driven = _driven(scene, found)
    return found


def _driven(scene: Scene, turning: Orientations) -> set[str]:
    """All roots but one of those that drives connect; the ground stays, whose directors need no constraint."""
    leaders: dict[str, str] = {}

    def leader(root: str) -> str:
        while root in leaders:
            root = leaders[root]
        return root

    for _, condition in joints.of_scene(scene):
        if isinstance(condition, Turned) and condition.driven:
            sides = condition.first.body, condition.second.body
            one, other = sorted((leader(turning.root(side)[0]) for side in sides), key=lambda root: root != GROUND)
            if one != other:
                leaders[other] = one
    return set(leaders)


def kept_rotation(scene: Scene, condition: Turned) -> Array:
    """The rotation from the first body's directors to the second's that a joint keeps, (d, d, lanes)."""
    ahead = start_angle(scene, condition.second) - start_angle(scene, condition.first)
    return plane.rotation(condition.kept(ahead))


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
    """Return whether a body is the ground or rigid."""
    return body == GROUND or scene.bodies[body].element == "rigid"
