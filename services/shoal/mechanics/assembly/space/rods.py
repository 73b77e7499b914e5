"""The coordinates of a flexible rod in space, and what joints hold of its direction."""

from __future__ import annotations

import numpy as np

from shoal.errors import InputError
from shoal.mechanics import joints
from shoal.mechanics import rotation as turns
from shoal.mechanics.affine import Affine, fixed
from shoal.mechanics.assembly.groups import JointPoint, is_stiff, product, transposed
from shoal.mechanics.assembly.pose import Pose, arm
from shoal.mechanics.assembly.space.coordinates import SpatialPlacement
from shoal.mechanics.assembly.space.holding import direction, of_image
from shoal.mechanics.assembly.space.sections import ALIGNED, arc, image, material, node_of, turn_of
from shoal.mechanics.frames import BeamFrame, is_on_axis
from shoal.mechanics.joints import Aligned, Turned
from shoal.mechanics.numerics.tile import Array
from shoal.scene import GROUND, Attachment, Rod, Scene


def place_rod(scene: Scene, name: str, rod: Rod, mine: list[JointPoint], pose: Pose, result: SpatialPlacement) -> None:
    """Give a rod its nodes; they start unstrained. Raises InputError where they cannot."""
    element = result.elements[name]
    shared: dict[int, JointPoint] = {}
    inner: list[JointPoint] = []
    for point in mine:
        p = point.local(name)
        node = node_of(rod, p)
        if node is None or not is_on_axis(p):
            inner.append(point)
        else:
            shared[node] = point
    nodes = []
    for node in range(rod.elements + 1):
        s = arc(rod, node)
        at = material(scene, name, (s, 0.0, 0.0))
        joint = shared.get(node)
        r, v = pose.point(at), pose.point_velocity(at)
        if joint is not None and joint.where is not None:
            _check_fit(name, rod, r, joint, result)
        position = result.new_vector(r, v) if joint is None else joint.where or result.make(joint, r, v)
        vectors = [
            (arm(pose.directors, tuple(vector)), arm(pose.turning, tuple(vector)))
            for vector in element.nodal_vectors(rod, s)
        ]
        nodes.append((position, *_directions(scene, name, rod, node, vectors, result)))
    frame = BeamFrame(name, element, rod.length, tuple(nodes))
    result.frames[name] = frame
    for point in [*shared.values(), *inner]:
        place = point.local(name)
        node_there = frame.node(place)
        if point in inner or point.where is not frame.nodes[node_there or 0][0]:
            result.share(point, frame.point(place))


def _directions(
    scene: Scene, name: str, rod: Rod, node: int, vectors: list[tuple[Array, Array]], result: SpatialPlacement
) -> list[Affine]:
    """The vectors of a node besides its place: a clamp on the ground or an axis shared with a joint holds some."""
    element = result.elements[name]
    (value, rate), *others = vectors
    if clamp := _ground_clamp(scene, name, rod, node, result):
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


def _ground_clamp(scene: Scene, name: str, rod: Rod, node: int, result: SpatialPlacement) -> str | None:
    """The joint that welds a node to the ground as the unstrained rod starts."""
    for joint, condition in joints.of_scene(scene):
        if not isinstance(condition, Turned) or condition.driven:
            continue
        mine = [side for side in (condition.first, condition.second) if side.body == name]
        others = [side for side in (condition.first, condition.second) if side.body != name]
        if len(mine) != 1 or result.attitudes.kept.root(others[0].body)[0] != GROUND:
            continue
        if node_of(rod, scene.location(mine[0])) != node:
            continue
        if condition.angle is not None:
            turn = turns.about_z(condition.angle if mine[0] is condition.second else -np.asarray(condition.angle))
            wanted = turns.product(result.attitudes.rotation(others[0].body), turn)
            if np.any(np.abs(wanted - turn_of(result.attitudes, scene, mine[0])) > ALIGNED):
                continue
        return joint
    return None


def _check_fit(name: str, rod: Rod, planned: Array, point: JointPoint, result: SpatialPlacement) -> None:
    """Raises InputError if a joint holds a rod somewhere else than where it would start unstrained."""
    assert point.where is not None
    apart = np.sqrt(np.sum((result.start_of(point.where)[0] - planned) ** 2, axis=0))
    away = np.max(apart)
    if np.any(apart > 1e-6 * rod.length):
        raise InputError(
            f"initial.{name}: joint {point.name} holds {name} {away:.3g} m away from where the unstrained rod would "
            "start"
        )


def hold_rod(scene: Scene, name: str, condition: Aligned | Turned, result: SpatialPlacement) -> None:
    """What a joint holds of the direction of a flexible rod: of a cable the axis only, since no section can turn.

    Raises InputError for what a rod cannot be held by.
    """
    sides = [condition.first, condition.second]
    rods = [side for side in sides if not is_stiff(scene, side.body)]
    if isinstance(condition, Turned):
        _clamp(scene, name, condition, result)
    elif len(rods) == 1:
        _hold_axis(scene, name, condition, next(side for side in sides if side is not rods[0]), rods[0], result)
    elif any(_director(scene, result, side) is not None for side in rods):
        _hold_common(scene, name, condition, result)


def _hold_axis(
    scene: Scene, name: str, condition: Aligned, held: Attachment, rod: Attachment, result: SpatialPlacement
) -> None:
    """An axis of a rigid body or the ground is one of a rod."""
    slope, here = result.direction(scene, rod), image(scene, result.attitudes, rod, condition.axis)
    cosine = float(np.max(np.abs(here[0])))
    if cosine < ALIGNED:
        axis = direction(result, held.body, condition.axis)
        result.terms.dot(name, axis, slope, 0)
        if (mine := _director(scene, result, rod)) is not None:
            vector, number = mine
            result.terms.dot(name, axis, vector, 0, -here[number])
    elif cosine > 1.0 - ALIGNED:
        for normal in turns.across(result.attitudes.image(held.body, condition.axis)):
            result.terms.dot(name, of_image(result, held.body, normal), slope, 0)
    else:
        raise InputError(
            f"joints.{name}.axis: is neither along the rod {rod.body} nor at a right angle to it; put a small rigid "
            "body between them that holds the axis"
        )


def _hold_common(scene: Scene, name: str, condition: Aligned, result: SpatialPlacement) -> None:
    """An axis that two flexible rods have in common is the director of one of them."""
    for one, other in ((condition.first, condition.second), (condition.second, condition.first)):
        mine, theirs = _director(scene, result, one), _director(scene, result, other)
        if mine is None:
            continue
        here, there = (image(scene, result.attitudes, side, condition.axis) for side in (one, other))
        if np.all(np.abs(here[mine[1]]) > 1.0 - ALIGNED) and np.all(np.abs(there[0]) < ALIGNED):
            result.terms.dot(name, mine[0], result.direction(scene, other), 0)
            if theirs is not None:
                result.terms.dot(name, mine[0], theirs[0], 0, -there[theirs[1]] * np.sign(here[mine[1]]))
            return
    raise InputError(
        f"joints.{name}.axis: is along no axis y or z of the sections of {condition.first.body} or "
        f"{condition.second.body} that they could share; put a small rigid body between them that holds the axis"
    )


def _director(scene: Scene, result: SpatialPlacement, side: Attachment) -> tuple[Affine, int] | None:
    """The director of a rod at a place, and which axis of the section it is; None: the rod is a cable.

    Raises InputError for a place between the nodes.
    """
    frame = result.frames.get(side.body)
    if not isinstance(frame, BeamFrame) or frame.element.director is None:
        return None
    place = scene.location(side)
    if (node := frame.node(place)) is None:
        count = len(frame.nodes) - 1
        raise InputError(
            f"{side.body}: a joint that holds the section of a director-rod sits on a node, and {place[0]:g} m is none "
            f"of {count} elements; use a point at a multiple of {float(np.max(frame.element_length)):g} m"
        )
    return frame.nodes[node][2], frame.element.director


def _clamp(scene: Scene, name: str, weld: Turned, result: SpatialPlacement) -> None:
    """A section keeps its direction in another body; a cable goes on in the line of another cable."""
    first, second = weld.first, weld.second
    attitudes = result.attitudes
    if not is_stiff(scene, first.body) and not is_stiff(scene, second.body):
        one, other = (result.direction(scene, side) for side in (first, second))
        t1, t2 = (turn_of(attitudes, scene, side)[:, 0, 0] for side in (first, second))
        directors = any(_director(scene, result, side) is not None for side in (first, second))
        if abs(float(t1 @ t2)) < 1.0 - ALIGNED or weld.angle or directors:
            what = "two rods whose sections hold each other" if directors else "two rods that are not in one line"
            raise InputError(f"joints.{name}: welds {what}; put a rigid body between them")
        for skew in turns.skew(np.eye(3)).transpose(2, 0, 1):
            result.terms.form(name, one, other, skew, 0)
        return
    held, rod = (first, second) if is_stiff(scene, first.body) else (second, first)
    relative = product(transposed(attitudes.rotation(held.body)), turn_of(attitudes, scene, rod))
    if weld.angle is not None:
        relative = turns.about_z(weld.angle if held is first else -np.asarray(weld.angle))
    slope = result.direction(scene, rod)
    for normal in turns.across(relative[:, 0]):
        result.terms.dot(name, of_image(result, held.body, normal), slope, 0)
    if (mine := _director(scene, result, rod)) is not None:
        vector, number = mine
        normal = turns.cross(relative[:, 0], relative[:, number])
        result.terms.dot(name, of_image(result, held.body, normal), vector, 0)
