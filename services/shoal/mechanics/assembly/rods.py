"""The coordinates of a flexible rod: the vectors of its nodes, of which joints and clamps hold some."""

from __future__ import annotations

import numpy as np

from shoal.errors import InputError
from shoal.mechanics import joints, plane
from shoal.mechanics.assembly.coordinates import Placement, Pose, arm
from shoal.mechanics.assembly.groups import JointPoint, kept_rotation, transposed
from shoal.mechanics.elements import ELEMENTS
from shoal.mechanics.frames import BeamFrame, Place, is_on_axis
from shoal.mechanics.numerics.tile import Array, Number
from shoal.scene import GROUND, Rod, Scene

FIT = 1e-6
"""Distance from its unstrained start, relative to its length, from which a rod does not fit its joints."""


def place_rod(scene: Scene, name: str, rod: Rod, mine: list[JointPoint], pose: Pose, result: Placement) -> None:
    """Give a rod its nodes. Raises InputError where it could not start unstrained."""
    element = ELEMENTS[rod.element]
    shared, inner = joint_nodes(name, rod, mine)
    if scene.initial_from is None:
        for point in mine:
            if point.where is not None:
                require_fit(
                    f"initial.{name}.angle", name, rod, pose.point(rod_axis(rod, point.local(name)[0])), point, result
                )
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


def node_of(rod: Rod, place: Place) -> int | None:
    """The node at a place of a rod, if there is one."""
    number = place[0] / rod.length * rod.elements
    nearest = int(np.rint(np.asarray(number).flat[0]))
    return nearest if np.all(np.abs(number - nearest) < 1e-9) else None


def joint_nodes(name: str, rod: Rod, points: list[JointPoint]) -> tuple[dict[int, JointPoint], list[JointPoint]]:
    """Joint points of a rod that are its nodes, by their number, and those beside or between them."""
    shared: dict[int, JointPoint] = {}
    inner: list[JointPoint] = []
    for point in points:
        p = point.local(name)
        node = node_of(rod, p)
        if node is None or not is_on_axis(p):
            inner.append(point)
        else:
            shared[node] = point
    return shared, inner


def require_fit(field: str, name: str, rod: Rod, planned: Array, point: JointPoint, result: Placement) -> None:
    """Raise InputError if a joint holds a rod elsewhere than where it would start unstrained, in R^d."""
    assert point.where is not None
    apart = np.sqrt(np.sum((result.start_of(point.where)[0] - planned) ** 2, axis=0))
    if np.any(apart > FIT * rod.length):
        raise InputError(
            f"{field}: joint {point.name} holds {name} {np.max(apart):.3g} m away from where the unstrained rod would "
            "start; a flexible rod starts unstrained"
        )
