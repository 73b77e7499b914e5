"""Constraints of those joint conditions that the coordinates do not satisfy by themselves, for d = 2 and 3."""

from __future__ import annotations

from shoal.errors import InputError
from shoal.mechanics import joints
from shoal.mechanics.assembly.coordinates import Placement
from shoal.mechanics.assembly.groups import is_stiff
from shoal.mechanics.joints import Along, Geared, Turned
from shoal.scene import Scene


def hold(scene: Scene, result: Placement) -> None:
    """Add the terms of all conditions that bodies do not share. Raises InputError for what a rod cannot keep."""
    for name, joint in scene.joints.items():
        conditions = joints.conditions(joint, scene.dimensions)
        for condition in conditions:
            before = len(result.terms.held)
            _require_able(scene, name, condition)
            if not result.shares(condition, condition is joints.weld_of(conditions)):
                condition.constrain(name, result)
            result.terms.press(name, condition, before)


def _require_able(scene: Scene, name: str, condition: object) -> None:
    """Raise InputError where a flexible rod would have to turn by an angle, or in space to hold a line."""
    flexible = "a flexible rod; weld a rigid body to it instead"
    if isinstance(condition, Turned) and condition.driven:
        if not all(is_stiff(scene, side.body) for side in (condition.first, condition.second)):
            raise InputError(f"joints.{name}: drives the angle of {flexible}")
    elif isinstance(condition, Geared) and scene.dimensions == 2:
        if not all(is_stiff(scene, side.body) for side in condition.sides):
            raise InputError(f"joints.{name}: turns {flexible}")
    elif isinstance(condition, Along) and scene.dimensions == 3 and not condition.is_fixed:
        body = condition.first.body
        if not is_stiff(scene, body):
            raise InputError(f"joints.{name}.first.body: {body} is flexible; in space a line is held by a rigid body")
