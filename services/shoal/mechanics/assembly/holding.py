"""What sharing could not express of the joints, as constraints."""

from __future__ import annotations

import numpy as np

from shoal.errors import InputError
from shoal.mechanics import joints, plane
from shoal.mechanics.assembly.coordinates import Placement
from shoal.mechanics.assembly.distances import keep_distance, keep_sum
from shoal.mechanics.assembly.groups import is_stiff, kept_rotation
from shoal.mechanics.frames import BeamFrame
from shoal.mechanics.joints import Along, Apart, Geared, Meet, Sum, Turned
from shoal.scene import GROUND, Function, Scene


def hold(scene: Scene, result: Placement) -> None:
    """What sharing could not express of the joints' conditions."""
    for name, joint in scene.joints.items():
        conditions = joints.conditions(joint)
        for condition in conditions:
            before = len(result.terms.held)
            if isinstance(condition, Turned):
                clamped = condition is joints.weld_of(conditions) and _is_clamp(scene, condition, result)
                _keep_turn(scene, name, condition, clamped, result)
            elif isinstance(condition, Geared):
                _keep_mesh(scene, name, condition, result)
            else:
                _keep(scene, name, condition, result)
            result.terms.press(name, condition, before)


def _keep(scene: Scene, name: str, condition: Meet | Along | Apart | Sum, result: Placement) -> None:
    terms = result.terms
    if isinstance(condition, Along):
        if not condition.is_fixed:
            line = result.direction(scene, condition.first).turned(plane.rotation(condition.direction))
            terms.cross(name, line, result.gap(scene, condition), 1)
    elif isinstance(condition, Apart):
        keep_distance(scene, name, condition, result)
    elif isinstance(condition, Sum):
        keep_sum(scene, name, condition, result)
    elif not isinstance(condition, Meet):  # which is shared, or a constraint where its loop closes
        raise joints.unknown(condition)
    elif condition.within or condition.held:
        terms.vanish(name, result.gap(scene, condition))


def _keep_turn(scene: Scene, name: str, condition: Turned, clamped: bool, result: Placement) -> None:
    first, second = condition.first, condition.second
    stiff = is_stiff(scene, first.body) and is_stiff(scene, second.body)
    if isinstance(condition.angle, Function):
        if not stiff:
            raise InputError(f"joints.{name}: drives the angle of a flexible rod; weld a rigid body to it instead")
        a, b = result.direction(scene, first), result.direction(scene, second)
        result.terms.dot(name, a, b, 0, drive=condition.angle.through("cos", "neg"))
        result.terms.cross(name, a, b, 0, condition.angle.through("sin", "neg"))
    elif not stiff and not clamped:
        held = result.direction(scene, first).turned(kept_rotation(scene, condition))
        result.terms.cross(name, held, result.direction(scene, second), 0)


def _keep_mesh(scene: Scene, name: str, condition: Geared, result: Placement) -> None:
    if not all(is_stiff(scene, side.body) for side in condition.sides):
        raise InputError(f"joints.{name}: turns a flexible rod; weld a rigid body to it instead")
    directions = [result.direction(scene, side) for side in condition.sides]
    starts = [plane.angle(result.start_of(one)[0]) for one in directions]
    begin = sum(factor * angle for factor, angle in zip(condition.factors, starts, strict=True))
    parts = tuple((factor, one) for factor, one in zip(condition.factors, directions, strict=True) if factor)
    result.terms.mesh(name, parts, -begin, 2 * np.pi / condition.most)


def _is_clamp(scene: Scene, weld: Turned, result: Placement) -> bool:
    """Return whether the weld is to the ground at a node, where the slope has one unknown only."""
    sides = {side.body: side for side in (weld.first, weld.second)}
    if GROUND not in sides:
        return False
    side = next(side for body, side in sides.items() if body != GROUND)
    frame = result.frames[side.body]
    return isinstance(frame, BeamFrame) and frame.node(scene.location(side)) is not None
