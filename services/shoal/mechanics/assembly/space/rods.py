"""The coordinates of a flexible rod in space."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from shoal.errors import InputError
from shoal.mechanics import joints
from shoal.mechanics import rotation as turns
from shoal.mechanics.affine import Affine, fixed
from shoal.mechanics.assembly.coordinates import Pose, arm
from shoal.mechanics.assembly.groups import JointPoint
from shoal.mechanics.assembly.rods import FIT, joint_nodes, node_of, require_fit
from shoal.mechanics.assembly.space.coordinates import SpatialPlacement
from shoal.mechanics.assembly.space.sections import ALIGNED, arc, material
from shoal.mechanics.assembly.space.strained import guessed, section_at
from shoal.mechanics.frames import BeamFrame
from shoal.mechanics.joints import Turned
from shoal.mechanics.numerics.tile import Array
from shoal.mechanics.start.strained import gives_way, require_numbers
from shoal.scene import GROUND, Attachment, Rod, Scene


def place_rod(scene: Scene, name: str, rod: Rod, mine: list[JointPoint], pose: Pose, result: SpatialPlacement) -> None:
    """Give a rod its nodes; they start unstrained, if joints allow it. Raises InputError where they cannot."""
    element = result.elements[name]
    shared, inner = joint_nodes(name, rod, mine)
    strained, clamps = gives_way(scene), _ground_clamps(scene, name, rod, result)
    known = {node: result.start_of(point.where)[0] for node, point in shared.items() if point.where is not None}
    guess = guessed(scene, name, rod, pose, known, result) if strained else []
    result.strained |= {(name, node): one.turn for node, one in enumerate(guess)}
    nodes = []
    for node in range(rod.elements + 1):
        s = arc(rod, node)
        at = material(scene, name, (s, 0.0, 0.0))
        joint = shared.get(node)
        r, v = pose.point(at), pose.point_velocity(at)
        if strained:
            if np.max(np.abs(guess[node].place - r)) > FIT * np.max(rod.length):
                require_numbers(scene)
            r = guess[node].place
        elif joint is not None and joint.where is not None:
            require_fit(f"initial.{name}", name, rod, r, joint, result)
        position = result.new_vector(r, v) if joint is None else joint.where or result.make(joint, r, v)
        vectors = [
            (arm(pose.directors, tuple(vector)), arm(pose.turning, tuple(vector)))
            for vector in element.nodal_vectors(rod, s)
        ]
        if strained:
            vectors = [(turns.turned(guess[node].turn, value), rate) for value, rate in vectors]
        nodes.append((position, *_directions(scene, name, rod, node, vectors, result, clamps.get(node, []))))
    frame = BeamFrame(name, element, rod.length, tuple(nodes))
    result.frames[name] = frame
    for point in [*shared.values(), *inner]:
        place = point.local(name)
        node_there = frame.node(place)
        if point in inner or point.where is not frame.nodes[node_there or 0][0]:
            result.share(point, frame.point(place))


def _directions(
    scene: Scene, name: str, rod: Rod, node: int, vectors: list[tuple[Array, Array]], result: SpatialPlacement,
    clamps: list[_Clamp],
) -> list[Affine]:  # fmt: skip
    """The vectors of a node besides its place: a clamp on the ground or an axis shared with a joint holds some."""
    element = result.elements[name]
    (value, rate), *others = vectors
    if clamp := _ground_clamp(scene, clamps, result):
        if np.any([turning for _, turning in vectors]):
            raise InputError(f"initial.{name}.spin: a rod welded to the ground does not turn there; leave it out")
        result.held.add(clamp)
        slope = result.new_along(0.0 * value, value, value, rate)
        return [slope, *(fixed(other) if element.director else result.new_vector(other, rate) for other, _ in others)]
    axis = next((one for one in result.axes if one.touches((name, node))), None)
    if axis is None or element.director is None:
        found = [result.new_vector(value, rate) for value, rate in vectors]
        for i, j, product in element.products:
            result.terms.dot(name, found[i], found[j], 0, -product)
        return found
    sign = axis.local((name, node))[element.director]
    director = others[0]
    if axis.where is None:
        axis.where = result.new_vector(sign * director[0], sign * director[1])
        result.terms.dot(name, axis.where, axis.where, 0, -1.0)
    axis.holders.add((name, node))
    held = axis.where if np.all(sign == 1.0) else axis.where * sign
    if held.terms:
        slope = result.new_vector(value, rate)
        result.terms.dot(name, slope, held, 0)
        return [slope, held]
    one, other = turns.across(held.constant)
    return [
        result.new_along(0.0 * one, one, value, rate) + result.new_along(0.0 * other, other, value, rate),
        held,
    ]


class _Clamp(NamedTuple):
    """A condition that holds the direction of a rod against what is fixed to the ground. side: of the rod."""

    joint: str
    condition: Turned
    side: Attachment
    other: Attachment


def _ground_clamps(scene: Scene, name: str, rod: Rod, result: SpatialPlacement) -> dict[int, list[_Clamp]]:
    """Return those of a rod by node."""
    found: dict[int, list[_Clamp]] = {}
    for joint, condition in joints.of_scene(scene):
        if not isinstance(condition, Turned) or condition.driven:
            continue
        mine = [side for side in (condition.first, condition.second) if side.body == name]
        others = [side for side in (condition.first, condition.second) if side.body != name]
        if len(mine) != 1 or result.attitudes.kept.root(others[0].body)[0] != GROUND:
            continue
        if (node := node_of(rod, scene.location(mine[0]))) is not None:
            found.setdefault(node, []).append(_Clamp(joint, condition, mine[0], others[0]))
    return found


def _ground_clamp(scene: Scene, clamps: list[_Clamp], result: SpatialPlacement) -> str | None:
    """The joint that welds a node to the ground as the rod starts."""
    for joint, condition, side, other in clamps:
        if condition.angle is not None:
            turn = turns.about_z(condition.angle if side is condition.second else -np.asarray(condition.angle))
            wanted = turns.product(result.attitudes.rotation(other.body), turn)
            if np.any(np.abs(wanted - section_at(scene, result, side)) > ALIGNED):
                continue
        return joint
    return None
