"""What acts in joints: damping, dry friction, springs and limits, and the laws of springs."""

from __future__ import annotations

from typing import Any

import numpy as np

from shoal.imported.limits import add_stops
from shoal.imported.parts import Parts
from shoal.imported.rounding import ROUNDED, Array, numbers
from shoal.imported.source import Source


def law(stiffness: float, further: Array) -> dict[str, Any]:
    """Of a spring whose force is a polynomial: the coefficient of x, and those of x^2 and x^3.

    In N/m, N/m^2 and N/m^3 along a line, in N m/rad and so on about an axis; what is zero is not there.
    """
    square, cubic = map(float, further)
    found = {"stiffness": float(stiffness), "cubic": cubic, "elastic": f"{square!r} * t**2" if square else 0}
    return {word: value for word, value in found.items() if value}


def add_resistance(source: Source, own: list[int], made: dict[str, Any], parts: Parts) -> None:
    """Add damping, friction and limits to the joint made for others, and springs to the loads; lines for the rest.

    made: a joint of a scene, or its kind alone where nothing can act in it. own: the joints that it stands for.
    """
    for one in own:
        if not _add_bushing(source, one, made, parts):
            _add_friction(source, one, made, parts)
            _add_spring(source, one, made, parts)
        add_stops(source, one, made, _is_simple(source, one, made), parts)
        _add_rotor(source, one, made, parts)


def _add_bushing(source: Source, one: int, made: dict[str, Any], parts: Parts) -> bool:
    """Add the linear spring and damping of a ball that starts at rest as a bushing; return whether they are all."""
    model, name, dof = source.model, source.joint_names[one], source.model.jnt_dofadr[one]
    ball = model.jnt_type[one] == source.mujoco.mjtJoint.mjJNT_BALL and made["kind"] == "spherical"
    further = (model.jnt_stiffnesspoly[one], model.dof_dampingpoly[dof], model.dof_frictionloss[dof])
    at = slice(model.jnt_qposadr[one], model.jnt_qposadr[one] + 4)
    found = {"turn_stiffness": float(model.jnt_stiffness[one]), "turn_damping": float(model.dof_damping[dof])}
    found = {word: value for word, value in found.items() if value}
    if not ball or not found or any(map(np.any, further)):
        return False
    if "turn_stiffness" in found and np.any(np.abs(model.qpos_spring[at] - source.data.qpos[at]) > ROUNDED):
        return False
    sides = {side: made[side] for side in ("first", "second")}
    parts.loads[f"{name}-bushing"] = {"kind": "bushing", **sides, **found}
    parts.origin[f"loads.{name}-bushing"] = f"joint {name}"
    return True


def resists(source: Source, one: int) -> bool:
    """Return whether anything acts in a joint that only a revolute joint or a slider of a scene has."""
    model, dof = source.model, source.model.jnt_dofadr[one]
    sizes = (
        model.jnt_stiffness[one], model.jnt_stiffnesspoly[one], model.dof_damping[dof], model.dof_dampingpoly[dof],
        model.dof_frictionloss[dof], model.dof_armature[dof], float(model.jnt_limited[one]),
    )  # fmt: skip
    return any(map(np.any, sizes))


def _is_simple(source: Source, one: int, made: dict[str, Any]) -> bool:
    """Return whether a joint of a scene has the one coordinate of one of MuJoCo's."""
    kinds = source.mujoco.mjtJoint
    words = {"revolute": kinds.mjJNT_HINGE, "slider": kinds.mjJNT_SLIDE}
    return bool(words.get(made["kind"]) == kinds(source.model.jnt_type[one]))


def _add_friction(source: Source, one: int, made: dict[str, Any], parts: Parts) -> None:
    """Damping and dry friction."""
    model, name, dof = source.model, source.joint_names[one], source.model.jnt_dofadr[one]
    simple = _is_simple(source, one, made)
    square, cubic = map(float, model.dof_dampingpoly[dof])
    for what, value, word in (
        ("damping", float(model.dof_damping[dof]), "friction"),
        ("quadratic damping", square, "drag"),
        ("frictionloss", float(model.dof_frictionloss[dof]), "coulomb"),
    ):
        if value and simple:
            made[word] = value
        elif value:
            parts.left_out.append(f"joint {name}: {what} {value:g}; only a revolute joint or a slider has it")
    if cubic:
        parts.left_out.append(f"joint {name}: cubic damping {cubic:g}")


def _add_spring(source: Source, one: int, made: dict[str, Any], parts: Parts) -> None:
    """Springs."""
    model, name = source.model, source.joint_names[one]
    found = law(model.jnt_stiffness[one], model.jnt_stiffnesspoly[one])
    if "elastic" in found and made["kind"] == "slider":
        parts.left_out.append(f"joint {name}: the part {found.pop('elastic')} of its spring")
    if found and _is_simple(source, one, made):
        parts.origin[f"loads.{name}-spring"] = f"joint {name}"
        parts.loads[f"{name}-spring"] = _spring(source, one, made, parts.away) | found
    elif found:
        told = " and ".join(f"{word} {value}" for word, value in found.items())
        parts.left_out.append(f"joint {name}: its spring ({told}); only a revolute joint or a slider has one")
    if found and (yielding := float(model.jnt_springyield[one])):
        parts.left_out.append(f"joint {name}: that its spring yields at {yielding:g}")


def _add_rotor(source: Source, one: int, made: dict[str, Any], parts: Parts) -> None:
    """Armature."""
    model, name, dof = source.model, source.joint_names[one], source.model.jnt_dofadr[one]
    if not model.dof_armature[dof]:
        return
    if _is_simple(source, one, made):
        made["armature"] = float(model.dof_armature[dof])
    else:
        left = f"joint {name}: its armature {model.dof_armature[dof]:g}; only a revolute joint or a slider has one"
        parts.left_out.append(left)


def _spring(source: Source, one: int, made: dict[str, Any], turned: dict[str, float]) -> dict[str, Any]:
    """What acts between the sides of a revolute joint or a slider, at rest where the file says.

    turned: of torsion springs, the angles [rad] from the start to there; that of this one is added.
    """
    model = source.model
    address = model.jnt_qposadr[one]
    away = float(model.qpos_spring[address] - source.data.qpos[address])
    sides = {side: made[side] for side in ("first", "second")}
    if made["kind"] == "revolute":
        if away:
            turned[f"{source.joint_names[one]}-spring"] = away
        return {"kind": "torsion-spring", **sides, "axis": made["axis"]}
    # Without length it pulls back by the whole way to the place of rest, on both sides of it.
    body, (side, place) = model.jnt_bodyid[one], made["first"].values()
    parent, sign = source.owners[model.body_parentid[body]], -1 if side == source.names[body] else 1
    # A body between two joints of one has the axes of that.
    holder = parent if side == source.at(parent, place)["body"] else body
    point = place + source.axes(holder).T @ made["axis"] * sign * away
    return {"kind": "spring", **sides, "first": {"body": side, "point": numbers(point)}, "length": 0.0}
