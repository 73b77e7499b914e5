"""The coordinates of a flexible rod: the vectors of its nodes, of which joints and clamps hold some."""

from __future__ import annotations

import numpy as np

from shoal.errors import InputError
from shoal.mechanics import joints, plane
from shoal.mechanics.assembly.coordinates import Placement
from shoal.mechanics.assembly.groups import JointPoint, kept_rotation, transposed
from shoal.mechanics.assembly.pose import Pose, arm
from shoal.mechanics.elements import ELEMENTS
from shoal.mechanics.frames import BeamFrame, Place, is_on_axis
from shoal.mechanics.numerics.tile import Array, Number
from shoal.scene import GROUND, Rod, Scene


def place_rod(scene: Scene, name: str, rod: Rod, mine: list[JointPoint], pose: Pose, result: Placement) -> None:
    """Give a rod its nodes. Raises InputError where it could not start unstrained."""
    element = ELEMENTS[rod.element]
    shared: dict[int, JointPoint] = {}
    inner: list[JointPoint] = []
    for point in mine:
        p = point.local(name)
        if point.where is not None and scene.initial_from is None:
            _check_fit(name, rod, pose.point(rod_axis(rod, p[0])), point, result)
        place = p[0] / rod.length * rod.elements
        node = int(np.rint(np.asarray(place).flat[0]))
        if np.any(np.abs(place - node) > 1e-9) or not is_on_axis(p):
            inner.append(point)
        else:
            shared[node] = point
    nodes = []
    for node in range(rod.elements + 1):
        s = rod.length * node / rod.elements
        vectors = [(arm(pose.directors, tuple(r)), arm(pose.turning, tuple(r))) for r in element.nodal_vectors(rod, s)]
        r, v = pose.point(rod_axis(rod, s)), pose.point_velocity(rod_axis(rod, s))
        joint = shared.get(node)
        position = result.new_vector(r, v) if joint is None else joint.where or result.make(joint, r, v)
        clamp = _clamp(scene, name, rod, node)
        if clamp is not None and np.any(pose.turning) and scene.initial_from is None:
            raise InputError(f"initial.{name}.rate: a rod welded to the ground does not turn there; leave the rate out")
        slopes = []
        for number, (value, rate) in enumerate(vectors):
            if clamp is not None and number == element.clamped:
                held = plane.quarter(clamp) if element.normal else clamp
                slopes.append(result.new_along(0.0 * held, held, value, 0.0 * value))
            else:
                slopes.append(result.new_vector(value, rate))
        nodes.append((position, *slopes))
    frame = BeamFrame(name, element, rod.length, tuple(nodes))
    result.frames[name] = frame
    for point in inner:
        result.share(point, frame.point(point.local(name)))


def rod_axis(rod: Rod, s: Number) -> Place:
    """The place of the unstrained axis at the arc length s [m] in the rod's own frame."""
    where = rod.axis(s)
    return np.real(where), np.imag(where)


def _clamp(scene: Scene, name: str, rod: Rod, node: int) -> Array | None:
    """Direction in which a weld to the ground holds the rod at a node, (d, lanes)."""
    for joint in scene.joints.values():
        weld = joints.weld_of(joints.conditions(joint))
        if weld is None or {weld.first.body, weld.second.body} != {GROUND, name}:
            continue
        side = weld.second if weld.second.body == name else weld.first
        if np.all(np.abs(scene.location(side)[0] - rod.length * node / rod.elements) < 1e-9 * rod.length):
            turn = kept_rotation(scene, weld)
            return (turn if weld.second.body == name else transposed(turn))[:, 0]
    return None


def _check_fit(name: str, rod: Rod, planned: Array, point: JointPoint, result: Placement) -> None:
    """A flexible rod starts in its reference shape: raises InputError if a joint holds it somewhere else."""
    assert point.where is not None
    held, _ = result.start_of(point.where)
    away = np.hypot(*(held - planned))
    if np.any(away > 1e-6 * rod.length):
        raise InputError(
            f"initial.{name}.angle: joint {point.name} holds {name} {np.max(away):.3g} m away from "
            f"where the unstrained rod would start; a flexible rod starts unstrained"
        )
