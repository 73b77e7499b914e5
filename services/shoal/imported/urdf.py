"""URDF as a specification of MuJoCo's: links that are fixed together become one body, and what weighs nothing no file.

The format leaves open whether the root is held, and what a link without <inertial> weighs; notes say what was assumed.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from scipy.spatial.transform import Rotation

from shoal.errors import InputError
from shoal.imported.composite import Moments, movable
from shoal.imported.markup import XmlElement
from shoal.imported.packages import resolve
from shoal.imported.rounding import Array

Root = Literal["fixed", "floating"]
_WORLD = "world"
_DENSITY = 1000.0
"""Of shapes of links without <inertial> [kg/m^3], as MuJoCo assumes."""
_FREEDOMS = {
    "revolute": "hinge",
    "continuous": "hinge",
    "prismatic": "slide",
    "spherical": "ball",
    "ball": "ball",
    "floating": "free",
    "planar": "planar",
    "fixed": "",
}


@dataclass(frozen=True)
class Pose:
    """A frame in another: its axes as columns, and its origin [m]."""

    turn: Array = field(default_factory=lambda: np.eye(3))
    place: Array = field(default_factory=lambda: np.zeros(3))

    @property
    def inverse(self) -> Pose:
        """Return the pose of the other frame in this one."""
        return Pose(self.turn.T, -self.turn.T @ self.place)

    def then(self, other: Pose) -> Pose:
        """Return the pose of a frame that is posed so in this one."""
        return Pose(self.turn @ other.turn, self.turn @ other.place + self.place)


@dataclass(frozen=True)
class UrdfJoint:
    """A joint between two links. pose: of its frame in the parent; within: in the child, whose own it is in URDF."""

    element: XmlElement
    name: str
    kind: str
    parent: str
    child: str
    pose: Pose
    axis: Array
    within: Pose = field(default_factory=Pose)


@dataclass
class Composite:
    """Links that are fixed together, by the pose of each in the frame of the first; joint: by which that one hangs."""

    name: str
    joint: UrdfJoint | None = None
    parent: str = ""
    pose: Pose = field(default_factory=Pose)
    members: dict[str, Pose] = field(default_factory=dict)
    moments: Moments = field(default_factory=Moments)
    carried: Moments = field(default_factory=Moments)


@dataclass(frozen=True)
class Loop:
    """A joint that closes a loop: of two bodies, with its frame in each, and its axis in the first frame."""

    element: XmlElement
    name: str
    kind: str
    bodies: tuple[str, str]
    poses: tuple[Pose, Pose]
    axis: Array


@dataclass
class Robot:
    """What a file says: a specification that MuJoCo compiles, loops beside its tree, and what is to be reported."""

    spec: Any
    loops: list[Loop] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)


def urdf_robot(mujoco: Any, file: Path, root: XmlElement, held: Root | None) -> Robot:
    """Return the machine of a URDF file. Raises InputError that names what is wrong with it.

    held: whether the root is fixed to the ground or floats; by default it floats if nothing else moves
    """
    links, joints = _links(file, root), _joints(file, root)
    for one in joints:
        for name in (one.parent, one.child):
            if name not in links and name != _WORLD:
                raise InputError(f"{file}: {one.element}: no link {name!r}; there are {', '.join(links)[:200]}")
    tree, closing = _hung(joints)
    roots = [name for name in links if name not in tree and name != _WORLD]
    moves = any(one.kind != "fixed" for one in tree.values())
    floats = held == "floating" or (held is None and not moves)
    bodies = _composites(tree, roots, floats)
    if lost := [name for name in links if not any(name in body.members for body in bodies.values())]:
        raise InputError(f"{file}: {links[lost[0]]}: hangs on itself, by {', '.join(lost)[:200]}")
    robot = Robot(_base(mujoco, root))
    _weigh(mujoco, file, links, bodies, robot)
    _note_roots(links, roots, bodies, floats, held, robot)
    _grow(mujoco, file, links, bodies, floats, robot)
    frames = {name: (body.name, pose) for body in bodies.values() for name, pose in body.members.items()}
    _couple(mujoco, joints, robot)
    for one in closing:
        sides = one.parent, one.child
        robot.loops.append(_loop(one.element, one.name, one.kind, sides, (one.pose, one.within), one.axis, frames))
    for element in root.named("loop_joint"):
        robot.loops += _stated_loop(file, element, links, frames)
    return robot


def numbers_of(file: Path, element: XmlElement, name: str, default: str, count: int) -> Array:
    """Return the numbers of an attribute. Raises InputError that names it."""
    text = element.attributes.get(name, default)
    try:
        found = np.array([float(word) for word in text.split()])
    except ValueError:
        found = np.array([np.nan])
    if len(found) != count or not np.all(np.isfinite(found)):
        what = "a number" if count == 1 else f"{count} numbers"
        raise InputError(f"{file}: {element}: {name}: must be {what}, found {text[:40]!r}")
    return found


def _pose(file: Path, element: XmlElement | None) -> Pose:
    """Return the pose that an <origin> states; rpy are angles about the fixed axes x, y and z [rad]."""
    if element is None:
        return Pose()
    angles = numbers_of(file, element, "rpy", "0 0 0", 3)
    return Pose(Rotation.from_euler("xyz", angles).as_matrix(), numbers_of(file, element, "xyz", "0 0 0", 3))


def _inside(element: XmlElement, tag: str) -> XmlElement | None:
    return next(element.named(tag), None)


def _links(file: Path, root: XmlElement) -> dict[str, XmlElement]:
    links: dict[str, XmlElement] = {}
    for link in root.named("link"):
        name = link.attributes.get("name", "")
        if not name or name in links:
            raise InputError(f"{file}: {link}: {'another link has this name' if name else 'has no name'}")
        links[name] = link
    return links


def _joints(file: Path, root: XmlElement) -> list[UrdfJoint]:
    found = []
    for number, element in enumerate(root.named("joint")):
        kind = element.attributes.get("type", "")
        if kind not in _FREEDOMS:
            raise InputError(f"{file}: {element}: type: must be one of {', '.join(_FREEDOMS)}, found {kind[:40]!r}")
        axis = _axis(file, element) if _FREEDOMS[kind] in ("hinge", "slide", "planar") else np.eye(3)[0]
        parent, child = (
            next((one.attributes.get("link", "") for one in element.named(side)), "") for side in ("parent", "child")
        )
        name, pose = element.attributes.get("name") or f"joint{number}", _pose(file, _inside(element, "origin"))
        within = _pose(file, _inside(element, "within"))
        found.append(UrdfJoint(element, name, kind, parent, child, pose, axis, within))
    return found


def _axis(file: Path, element: XmlElement) -> Array:
    stated = _inside(element, "axis")
    axis = np.array([1.0, 0.0, 0.0]) if stated is None else numbers_of(file, stated, "xyz", "1 0 0", 3)
    if not np.any(axis):
        raise InputError(f"{file}: {element}: axis: has no direction, found {stated.attributes.get('xyz')!r}")  # type: ignore[union-attr]
    return np.asarray(axis / np.linalg.norm(axis))


def _hung(joints: list[UrdfJoint]) -> tuple[dict[str, UrdfJoint], list[UrdfJoint]]:
    """Return the joint on which each link hangs, and joints of links that hang already, which close loops."""
    tree, closing = dict[str, UrdfJoint](), list[UrdfJoint]()
    for one in joints:
        if one.child in tree or one.child == _WORLD:
            closing.append(one)
        else:
            tree[one.child] = one
    return tree, closing


def _composites(tree: dict[str, UrdfJoint], roots: list[str], floats: bool) -> dict[str, Composite]:
    """Return the bodies by the names of their first links, from the ground on."""
    below: dict[str, list[UrdfJoint]] = {}
    for one in tree.values():
        below.setdefault(one.parent, []).append(one)
    ground = Composite(_WORLD)
    bodies = {_WORLD: ground}
    waiting: list[tuple[str, Composite, Pose]] = [(_WORLD, ground, Pose())]
    for name in roots:
        if floats:
            bodies[name] = Composite(name, parent=_WORLD)
        waiting.append((name, bodies[name] if floats else ground, Pose()))
    while waiting:
        name, body, pose = waiting.pop(0)
        body.members[name] = pose
        for one in below.get(name, []):
            there = pose.then(one.pose).then(one.within.inverse)
            if one.kind == "fixed":
                waiting.append((one.child, body, there))
            else:
                bodies[one.child] = Composite(one.child, one, body.name, there)
                waiting.append((one.child, bodies[one.child], Pose()))
    return bodies


def _weigh(mujoco: Any, file: Path, links: dict[str, XmlElement], bodies: dict[str, Composite], robot: Robot) -> None:
    """Add the mass of links to their bodies, and that of bodies to those which carry them."""
    for body in [*bodies.values()][1:]:
        unknown = []
        for name, pose in body.members.items():
            link = links[name]
            if (inertial := _inside(link, "inertial")) is not None:
                own = _stated(file, link, inertial)
            else:
                own, absent = _of_shapes(mujoco, file, link)
                unknown += [f"{link}: no <inertial>, and its shape {one} is not found" for one in absent]
                if own.mass:
                    shapes = "no <inertial>; its mass is that of its collision shapes at 1000 kg/m^3, as MuJoCo assumes"
                    robot.notes.append(f"{link}: {shapes}")
            body.moments += own.moved(pose.turn, pose.place)
        if unknown and not body.moments.mass:
            looked = "looked for beside and above the file, and in ROS_PACKAGE_PATH and AMENT_PREFIX_PATH"
            raise InputError(f"{file}: {unknown[0]} ({looked}); state an <inertial> to do without it")
        robot.notes += [f"{one}; it counts as without mass" for one in unknown]
        body.carried += body.moments
    for body in reversed([*bodies.values()][1:]):
        if body.parent != _WORLD and (body.joint is None or body.joint.kind != "floating"):
            bodies[body.parent].carried += body.carried.moved(body.pose.turn, body.pose.place)


def _stated(file: Path, link: XmlElement, inertial: XmlElement) -> Moments:
    weight, spread = _inside(inertial, "mass"), _inside(inertial, "inertia")
    mass = 0.0 if weight is None else float(numbers_of(file, weight, "value", "0", 1)[0])
    if mass < 0.0:
        raise InputError(f"{file}: {link}: mass: must not be negative, found {mass:g}")
    inertia = np.zeros((3, 3))
    for word, (i, j) in {
        "ixx": (0, 0),
        "iyy": (1, 1),
        "izz": (2, 2),
        "ixy": (0, 1),
        "ixz": (0, 2),
        "iyz": (1, 2),
    }.items():
        if spread is not None:
            inertia[i, j] = inertia[j, i] = numbers_of(file, spread, word, "0", 1)[0]
    pose = _pose(file, _inside(inertial, "origin"))
    # A frame that is given an inertia without a mass weighs nothing.
    own = Moments.of(mass, np.zeros(3), inertia) if mass else Moments()
    return own.moved(pose.turn, pose.place)


def _of_shapes(mujoco: Any, file: Path, link: XmlElement) -> tuple[Moments, list[str]]:
    """Return the moments of a link's collision shapes in its frame, and the files of those that are not found."""
    spec, absent = mujoco.MjSpec(), list[str]()
    body = spec.worldbody.add_body(name="link")
    for number, collision in enumerate(link.named("collision")):
        name = _add_shape(mujoco, file, spec, body, collision, f"{number}", density=_DENSITY)
        absent += [name] if name else []
    if not list(body.geoms):
        return Moments(), absent
    try:
        model = spec.compile()
    except ValueError as error:
        raise InputError(f"{file}: {link}: its mass follows from its shapes: {' '.join(str(error).split())}") from None
    turn = Rotation.from_quat(model.body_iquat[1], scalar_first=True).as_matrix()
    inertia = turn @ np.diag(model.body_inertia[1]) @ turn.T
    return Moments.of(float(model.body_mass[1]), model.body_ipos[1].copy(), inertia), absent


def _add_shape(
    mujoco: Any, file: Path, spec: Any, body: Any, collision: XmlElement, name: str, density: float
) -> str | None:
    """Add a <collision> to a body; the name of a mesh that is not found is returned."""
    pose, shape = _pose(file, _inside(collision, "origin")), _inside(collision, "geometry")
    if shape is None or not shape.children:
        return None
    one = shape.children[0]
    kinds = mujoco.mjtGeom
    found: dict[str, Any] = {}
    if one.tag == "sphere":
        found = {"type": kinds.mjGEOM_SPHERE, "size": [numbers_of(file, one, "radius", "", 1)[0], 0, 0]}
    elif one.tag == "box":
        found = {"type": kinds.mjGEOM_BOX, "size": numbers_of(file, one, "size", "", 3) / 2}
    elif one.tag in ("cylinder", "capsule"):
        radius, length = (numbers_of(file, one, word, "", 1)[0] for word in ("radius", "length"))
        kind = kinds.mjGEOM_CYLINDER if one.tag == "cylinder" else kinds.mjGEOM_CAPSULE
        found = {"type": kind, "size": [radius, length / 2, 0]}
    elif one.tag == "mesh":
        written = one.attributes.get("filename", "")
        path = resolve(written, file)
        if path is None or path.suffix.lower() not in (".stl", ".obj", ".msh"):
            return f"{written!r}"
        spec.add_mesh(name=name, file=str(path.resolve()), scale=numbers_of(file, one, "scale", "1 1 1", 3))
        found = {"type": kinds.mjGEOM_MESH, "meshname": name}
    if found and found.get("size", [1.0])[0] > 0.0:
        quaternion = Rotation.from_matrix(pose.turn).as_quat(scalar_first=True)
        body.add_geom(pos=pose.place, quat=quaternion, density=density, **found)
    return None


def _note_roots(
    links: dict[str, XmlElement], roots: list[str], bodies: dict[str, Composite], floats: bool, held: Root | None,
    robot: Robot,
) -> None:  # fmt: skip
    """Note whether the ground holds the roots, which URDF leaves open."""
    if held is not None:
        return
    for name in roots:
        if floats:
            robot.notes.append(f"{links[name]}: nothing holds it: it floats; --root fixed fixes it to the ground")
        elif _inside(links[name], "inertial") is not None:
            robot.notes.append(f"{links[name]}: the root is fixed to the ground; --root floating frees it")


def _base(mujoco: Any, root: XmlElement) -> Any:
    """Return an empty specification with the options that a file states for MuJoCo."""
    stated = "".join(_written(child) for one in root.named("mujoco") for child in one.named("option"))
    spec = mujoco.MjSpec.from_string(f"<mujoco>{stated}</mujoco>")
    spec.modelname = root.attributes.get("name", "robot")
    spec.compiler.degree = False
    return spec


def _written(element: XmlElement) -> str:
    attributes = "".join(f' {name}="{value}"' for name, value in element.attributes.items())
    return f"<{element.tag}{attributes}>{''.join(map(_written, element.children))}</{element.tag}>"


def _grow(
    mujoco: Any, file: Path, links: dict[str, XmlElement], bodies: dict[str, Composite], floats: bool, robot: Robot
) -> None:
    """Add the bodies that move, with their joints; what has no mass, nor carries any, is left out."""
    made = {_WORLD: robot.spec.worldbody}
    for body in [*bodies.values()][1:]:
        link = links[body.name]
        if not body.carried.mass:
            by = f"; {body.joint.element} moves nothing that has mass" if body.joint else ""
            robot.left_out.append(f"{link}: has no mass, so that it acts on nothing{by}")
            continue
        moments, note, wrong = movable(body.moments, body.carried)
        if wrong:
            raise InputError(f"{file}: {link}: {wrong}")
        robot.notes += [f"{link}: {note}"] if note else []
        free = body.joint is None or body.joint.kind == "floating"
        place = _from_ground(body, bodies) if free else body.pose
        inertia = moments.inertia[np.array([0, 1, 2, 0, 0, 1]), np.array([0, 1, 2, 1, 2, 2])]
        made[body.name] = (made[_WORLD] if free else made[body.parent]).add_body(
            name=body.name,
            pos=place.place,
            quat=Rotation.from_matrix(place.turn).as_quat(scalar_first=True),
            mass=moments.mass,
            ipos=moments.centre,
            fullinertia=inertia,
            explicitinertial=True,
        )
        _add_joints(mujoco, file, body, made[body.name], robot)
        for name, pose in body.members.items():
            if name != body.name:
                made[body.name].add_site(name=name, pos=pose.place)


def _from_ground(body: Composite, bodies: dict[str, Composite]) -> Pose:
    """Return the pose of a body in the ground at the start."""
    pose = body.pose
    while body.parent != _WORLD and body.parent:
        body = bodies[body.parent]
        pose = body.pose.then(pose)
    return pose


def _add_joints(mujoco: Any, file: Path, body: Composite, made: Any, robot: Robot) -> None:
    """Add the joints by which a body hangs, with their damping, friction and limits."""
    kinds, joint = mujoco.mjtJoint, body.joint
    if joint is None:
        made.add_freejoint(name=f"{body.name}-root")
        return
    axis = joint.within.turn @ joint.axis
    freedom = _FREEDOMS[joint.kind]
    if freedom == "planar":
        across = np.linalg.svd(axis[None])[2][1:]
        ways = [(f"{joint.name}-{letter}", kinds.mjJNT_SLIDE, one) for letter, one in zip("xy", across, strict=True)]
        ways.append((joint.name, kinds.mjJNT_HINGE, axis))
    else:
        ways = [(joint.name, getattr(kinds, f"mjJNT_{freedom.upper()}"), axis)]
    damping, friction = _resistance(file, joint)
    for name, kind, along in ways:
        one = made.add_joint(name=name, type=kind, pos=joint.within.place, axis=along, frictionloss=friction)
        one.damping[0] = damping
        if (limit := _inside(joint.element, "limit")) is not None and joint.kind in ("revolute", "prismatic"):
            low, high = (float(numbers_of(file, limit, word, "0", 1)[0]) for word in ("lower", "upper"))
            if low < high:
                one.limited, one.range = mujoco.mjtLimited.mjLIMITED_TRUE, [low, high]
            else:
                robot.left_out.append(f"{joint.element}: its limits {low:g} to {high:g}, which leave no way")


def _resistance(file: Path, joint: UrdfJoint) -> tuple[float, float]:
    stated = _inside(joint.element, "dynamics")
    if stated is None:
        return 0.0, 0.0
    damping, friction = (float(numbers_of(file, stated, word, "0", 1)[0]) for word in ("damping", "friction"))
    return damping, friction


def _couple(mujoco: Any, joints: list[UrdfJoint], robot: Robot) -> None:
    """Add an equality for each <mimic>: a joint follows another."""
    there = {one.name for one in robot.spec.joints}
    for one in joints:
        mimic = _inside(one.element, "mimic")
        if mimic is None:
            continue
        other = mimic.attributes.get("joint", "")
        if one.name not in there or other not in there:
            robot.left_out.append(f"{one.element}: follows {other}; one of them is not in the scene")
            continue
        equality = robot.spec.add_equality(
            name=f"{one.name}-mimic", type=mujoco.mjtEq.mjEQ_JOINT, name1=one.name, name2=other,
            objtype=mujoco.mjtObj.mjOBJ_JOINT,
        )  # fmt: skip
        factor, offset = (
            float(mimic.attributes.get(word, default)) for word, default in (("multiplier", 1), ("offset", 0))
        )
        equality.data[:5] = [offset, factor, 0, 0, 0]


def _loop(
    element: XmlElement, name: str, kind: str, sides: tuple[str, str], poses: tuple[Pose, Pose], axis: Array,
    frames: dict[str, tuple[str, Pose]],
) -> Loop:  # fmt: skip
    """Return a loop by the bodies of two links. poses: of the joint's frame in the links."""
    ground = (_WORLD, Pose())
    (one, first), (other, second) = (frames.get(side, ground) for side in sides)
    return Loop(element, name, kind, (one, other), (first.then(poses[0]), second.then(poses[1])), axis)


def _stated_loop(
    file: Path, element: XmlElement, links: dict[str, XmlElement], frames: dict[str, tuple[str, Pose]]
) -> Iterator[Loop]:
    """Yield the loop of Drake's <loop_joint>, which states its frame in both links."""
    kind = element.attributes.get("type", "")
    ends = [_inside(element, tag) for tag in ("link1", "link2")]
    names = [end.attributes.get("link", "") if end is not None else "" for end in ends]
    if kind not in _FREEDOMS or any(name not in links and name != _WORLD for name in names):
        raise InputError(f"{file}: {element}: names no two links, or no type of {', '.join(_FREEDOMS)}")
    poses = tuple(_pose(file, end) for end in ends)
    name = element.attributes.get("name") or "loop"
    yield _loop(element, name, kind, (names[0], names[1]), (poses[0], poses[1]), _axis(file, element), frames)
