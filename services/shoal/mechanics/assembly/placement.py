"""Scene -> coordinates: which unknowns exist, how every body hangs on them, and where they start.

Bodies are placed by walking the joints from the ground. A flexible rod brings the vectors of its nodes; a rigid body
(a point r and a unit vector e, |e| = 1) is expressed by the joint points it has, so that chains stay banded, and
brings e only if it has fewer than two and no joint keeps its angle to a body that has one. What sharing cannot
express becomes a constraint: closed loops, lines that move, distances, driven motion, slopes of welded rods.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from shoal.errors import InputError
from shoal.mechanics.assembly.affine import Affine, Number, fixed
from shoal.mechanics.assembly.frames import BeamFrame, Frame, PointFrame, RigidFrame, is_on_axis
from shoal.mechanics.assembly.groups import (
    JointPoint,
    Orientations,
    is_stiff,
    joint_points,
    kept_turn,
    moving,
    orientations,
    place_of,
)
from shoal.mechanics.assembly.pose import Pose, as_complex, unit
from shoal.mechanics.elements import ELEMENTS
from shoal.mechanics.least.constraints import Terms
from shoal.mechanics.start.closure import Flags
from shoal.mechanics.start.start import started
from shoal.scene import (
    GROUND,
    Attachment,
    Coupling,
    Distance,
    DrivenAngle,
    Function,
    PointMass,
    Rod,
    Scene,
    Slider,
    Weld,
)


@dataclass
class Placement:
    """All unknowns with their initial values, the frame of every body, and the constraints.

    scene: with the start that agrees with its joints. failed: lanes that have none, (lanes,) or (1,).
    """

    scene: Scene
    failed: Flags
    positions: list[Number] = field(default_factory=list)
    velocities: list[Number] = field(default_factory=list)
    frames: dict[str, Frame] = field(default_factory=dict)
    poses: dict[str, Pose] = field(default_factory=dict)
    drivers: dict[str, Affine] = field(default_factory=dict)
    """Moving points of the ground: pairs of unknowns whose motion is prescribed."""
    terms: Terms = field(default_factory=Terms)

    def new_pair(self, position: Number, velocity: Number) -> Affine:
        """Two more unknowns, the x and y of a vector, with its initial value and rate."""
        first = len(self.positions)
        for part in (np.real, np.imag):
            self.positions.append(part(position))
            self.velocities.append(part(velocity))
        return Affine({first: 1.0 + 0.0j, first + 1: 1.0j})

    def new_along(self, base: Number, direction: Number, position: Number, velocity: Number) -> Affine:
        """One more unknown, the way along a fixed direction from `base`."""
        self.positions.append(np.real(np.conj(direction) * (position - base)))
        self.velocities.append(np.real(np.conj(direction) * velocity))
        return Affine({len(self.positions) - 1: direction}, base)

    def start_of(self, where: Affine) -> tuple[Number, Number]:
        """Initial position and velocity of a vector."""
        position, velocity = where.constant, 0.0
        for unknown, coefficient in where.terms.items():
            position = position + coefficient * self.positions[unknown]
            velocity = velocity + coefficient * self.velocities[unknown]
        return position, velocity

    def point(self, scene: Scene, at: Attachment) -> Affine:
        """The place of an attachment."""
        owner, p = place_of(scene, at)
        if owner == GROUND:
            return fixed(p)
        return self.drivers[owner] if at.body == GROUND else self.frames[owner].point(p)

    def direction(self, scene: Scene, at: Attachment) -> Affine:
        """The direction of the body at an attachment; that of the ground is +X."""
        if at.body == GROUND:
            return fixed(1.0 + 0.0j)
        return self.frames[at.body].direction(as_complex(scene.location(at)))


def place(scene: Scene) -> Placement:
    """Give every body its coordinates and initial state, and state what they must satisfy. Raises InputError."""
    stated = scene
    scene, failed = started(scene)
    result = Placement(scene, failed)
    points, turning = joint_points(scene), orientations(scene)
    for name, path in scene.ground_points.items():
        _place_driver(name, path.x, path.y, points, result)
    touching: dict[str, list[JointPoint]] = {name: [] for name in scene.bodies}
    for point in points:
        for owner in {owner for owner, _ in point.places} & touching.keys():
            touching[owner].append(point)
    waiting = list(scene.bodies)
    while waiting:
        name = _next(stated, waiting, touching, result)
        waiting.remove(name)
        mine = touching[name]
        pose = _pose(scene, name, mine, turning, result)
        result.poses[name] = pose
        body = scene.bodies[name]
        if isinstance(body, PointMass):
            _place_point(name, mine, pose, result)
        elif isinstance(body, Rod) and body.element != "rigid":
            _place_beam(scene, name, body, mine, pose, result)
        else:
            _place_rigid(name, mine, pose, turning, result)
    for point in points:
        if point.line and not point.on_line and point.where is not None:
            joint, base, direction = point.line
            result.terms.cross(joint, fixed(direction), point.where - fixed(base), 1)
    _add_joints(scene, result)
    return result


def _place_driver(name: str, x: Function, y: Function, points: list[JointPoint], result: Placement) -> None:
    """A moving point of the ground is a pair of unknowns that constraints drive."""
    begin, rate = _value_and_rate(x), _value_and_rate(y)
    pair = result.new_pair(begin[0] + 1j * rate[0], begin[1] + 1j * rate[1])
    result.drivers[moving(name)] = pair
    drives = x.through("neg"), y.through("neg")
    result.terms.vanish(f"{GROUND}.{name}", pair, drives)
    for point in points:
        if point.touches(moving(name)):
            if point.where is not None:
                raise InputError(f"joints.{point.name}: joins the moving point {name} to a fixed one")
            point.where = pair


def _value_and_rate(f: Function) -> tuple[float, float]:
    h = 1e-6
    before, now, after = (float(v) for v in f(np.array([0.0, h, 2 * h])))
    return before, (4 * now - 3 * before - after) / (2 * h)


def _next(scene: Scene, waiting: list[str], touching: dict[str, list[JointPoint]], result: Placement) -> str:
    """The next body whose start is known: by a joint point, by its own field, by a slider's line."""
    known: list[Callable[[str], bool]] = [
        lambda name: any(point.where is not None for point in touching[name]),
        lambda name: scene.start(name).position is not None,
        lambda name: any(point.line for point in touching[name]),
        lambda name: _rail(scene, name, result) is not None,
    ]
    for is_known in known:
        for name in waiting:
            if is_known(name):
                return name
    return waiting[0]


def _rail(scene: Scene, name: str, result: Placement) -> tuple[Number, Number, Number] | None:
    """Initial base point and velocity of a slider that the body is on, and the body's place on it."""
    for joint in scene.joints.values():
        if not isinstance(joint, Slider) or joint.second.body != name:
            continue
        if joint.first.body == GROUND or joint.first.body in result.frames:
            position, velocity = result.start_of(result.point(scene, joint.first))
            return position, velocity, as_complex(scene.location(joint.second))
    return None


def _pose(scene: Scene, name: str, mine: list[JointPoint], turning: Orientations, result: Placement) -> Pose:
    start = scene.start(name)
    root, relative = turning.root(name)
    rate = 0.0 if root == GROUND else start.rate
    direction = relative if root == GROUND else unit(start.angle)
    known = [point for point in mine if point.where is not None]
    if known:
        assert known[0].where is not None
        position, velocity = result.start_of(known[0].where)
        p = known[0].local(name)
    elif start.position is not None:
        position, velocity, p = as_complex(start.position), as_complex(start.velocity), 0.0j
    elif lines := [point for point in mine if point.line]:
        assert lines[0].line is not None
        position, velocity, p = lines[0].line[1], 0.0j, lines[0].local(name)
    else:
        rail = _rail(scene, name, result)
        assert rail is not None
        position, velocity, p = rail
    return Pose(position - direction * p, direction, velocity - 1j * rate * direction * p, rate)


def _make(point: JointPoint, position: Number, velocity: Number, result: Placement) -> Affine:
    """The coordinates of a joint point that has none yet."""
    if point.line is None:
        point.where = result.new_pair(position, velocity)
    else:
        _, base, direction = point.line
        point.where, point.on_line = result.new_along(base, direction, position, velocity), True
    return point.where


def _place_point(name: str, mine: list[JointPoint], pose: Pose, result: Placement) -> None:
    for point in mine[:1]:
        point.where = point.where or _make(point, pose.position, pose.velocity, result)
    origin = mine[0].where if mine else result.new_pair(pose.position, pose.velocity)
    assert origin is not None
    result.frames[name] = PointFrame(name, origin)


def _place_rigid(name: str, mine: list[JointPoint], pose: Pose, turning: Orientations, result: Placement) -> None:
    root, relative = turning.root(name)
    ranked = sorted(mine, key=lambda point: (point.where is None, point.line is None))
    anchors = ranked[: 1 if root in turning.axis else 2]
    for point in anchors:
        if point.where is None:
            p = point.local(name)
            _make(point, pose.point(p), pose.point_velocity(p), result)
    wheres = [(point.local(name), point.where) for point in anchors if point.where is not None]
    if not wheres:
        wheres = [(0.0j, result.new_pair(pose.position, pose.velocity))]
    (p, where), *second = wheres
    if root not in turning.axis:
        if second:
            axis = (second[0][1] - where) * (1.0 / (second[0][0] - p))
        else:
            axis = result.new_pair(pose.direction, 1j * pose.rate * pose.direction)
        turning.axis[root] = axis * np.conj(relative)
        result.terms.dot(name, axis, axis, 0, -1.0)
    frame = RigidFrame(where + turning.axis[root] * (-relative * p), turning.axis[root] * relative)
    result.frames[name] = frame
    for point in ranked:
        if point in anchors:
            continue
        here = frame.point(point.local(name))
        if point.where is None:
            point.where = here
        else:
            result.terms.vanish(point.name, point.where - here)


def _place_beam(scene: Scene, name: str, rod: Rod, mine: list[JointPoint], pose: Pose, result: Placement) -> None:
    element = ELEMENTS[rod.element]
    shared: dict[int, JointPoint] = {}
    inner: list[JointPoint] = []
    for point in mine:
        p = point.local(name)
        if point.where is not None:
            _check_fit(name, rod, pose.point(rod.axis(np.real(p))), point, result)
        place = np.real(p) / rod.length * rod.elements
        node = int(np.rint(np.asarray(place).flat[0]))
        if np.any(np.abs(place - node) > 1e-9) or not is_on_axis(p):
            inner.append(point)
        else:
            shared[node] = point
    nodes = []
    for node in range(rod.elements + 1):
        s = rod.length * node / rod.elements
        reference = element.nodal_vectors(rod, s)
        vectors = [(pose.direction * r, 1j * pose.rate * pose.direction * r) for r in reference]
        r, v = pose.point(rod.axis(s)), pose.point_velocity(rod.axis(s))
        joint = shared.get(node)
        position = result.new_pair(r, v) if joint is None else joint.where or _make(joint, r, v, result)
        clamp = _clamp(scene, name, rod, node)
        if clamp is not None and np.any(pose.rate):
            raise InputError(f"initial.{name}.rate: a rod welded to the ground does not turn there; leave the rate out")
        slopes = []
        for number, (value, rate) in enumerate(vectors):
            if clamp is not None and number == element.clamped:
                slopes.append(result.new_along(0.0j, clamp * element.clamp_turn, value, 0.0j))
            else:
                slopes.append(result.new_pair(value, rate))
        nodes.append((position, *slopes))
    frame = BeamFrame(name, element, rod.length, tuple(nodes))
    result.frames[name] = frame
    for point in inner:
        here = frame.point(point.local(name))
        if point.where is None:
            point.where = here
        else:
            result.terms.vanish(point.name, point.where - here)


def _clamp(scene: Scene, name: str, rod: Rod, node: int) -> Number | None:
    """Direction in which a weld to the ground holds the rod at a node."""
    for joint in scene.joints.values():
        if not isinstance(joint, Weld) or {joint.first.body, joint.second.body} != {GROUND, name}:
            continue
        side = joint.second if joint.second.body == name else joint.first
        if np.all(np.abs(scene.location(side)[0] - rod.length * node / rod.elements) < 1e-9 * rod.length):
            turn = kept_turn(scene, joint)
            assert turn is not None
            return turn if joint.second.body == name else np.conj(turn)
    return None


def _check_fit(name: str, rod: Rod, planned: Number, point: JointPoint, result: Placement) -> None:
    """A flexible rod starts in its reference shape: raises InputError if a joint holds it somewhere else."""
    assert point.where is not None
    held, _ = result.start_of(point.where)
    if np.any(np.abs(held - planned) > 1e-6 * rod.length):
        raise InputError(
            f"initial.{name}.angle: joint {point.name} holds {name} {np.max(np.abs(held - planned)):.3g} m away from "
            f"where the unstrained rod would start; a flexible rod starts unstrained"
        )


def _add_joints(scene: Scene, result: Placement) -> None:
    """The joints that sharing could not express."""
    terms = result.terms
    for name, joint in scene.joints.items():
        if isinstance(joint, Coupling):
            total = fixed(0.0j)
            for term in joint.terms:
                axis = 1.0 if term.axis == "x" else -1j
                total = total + result.point(scene, term.at) * (term.factor * axis)
            terms.dot(name, fixed(1.0), total, 1, drive=joint.value.through("neg"))
            continue
        first, second = joint.first, joint.second
        if isinstance(joint, Slider) and (first.body != GROUND or isinstance(first.point, str)):
            line = result.direction(scene, first) * unit(joint.direction)
            terms.cross(name, line, result.point(scene, second) - result.point(scene, first), 1)
        elif isinstance(joint, Distance):
            gap = result.point(scene, second) - result.point(scene, first)
            if joint.length is None:
                terms.dot(name, gap, gap, 2, -(np.abs(result.start_of(gap)[0]) ** 2))
            else:
                terms.dot(name, gap, gap, 2, drive=joint.length.through("square", "neg"))
        elif isinstance(joint, DrivenAngle):
            if not (is_stiff(scene, first.body) and is_stiff(scene, second.body)):
                raise InputError(f"joints.{name}: drives the angle of a flexible rod; weld a rigid body to it instead")
            a, b = result.direction(scene, first), result.direction(scene, second)
            terms.dot(name, a, b, 0, drive=joint.angle.through("cos", "neg"))
            terms.cross(name, a, b, 0, joint.angle.through("sin", "neg"))
        turn = kept_turn(scene, joint)
        flexible = [side for side in (first, second) if not is_stiff(scene, side.body)]
        if turn is not None and flexible and not (isinstance(joint, Weld) and _is_clamp(scene, joint, result)):
            terms.cross(name, result.direction(scene, first) * turn, result.direction(scene, second), 0)


def _is_clamp(scene: Scene, joint: Weld, result: Placement) -> bool:
    """Whether the weld is to the ground at a node, where the slope has one unknown only."""
    sides = {side.body: side for side in (joint.first, joint.second)}
    if GROUND not in sides:
        return False
    side = next(side for body, side in sides.items() if body != GROUND)
    frame = result.frames[side.body]
    return isinstance(frame, BeamFrame) and frame.node(as_complex(scene.location(side))) is not None
