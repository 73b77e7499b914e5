"""Loops that close, by `connect` and `weld` of bodies."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from shoal.imported.parts import Parts
from shoal.imported.rounding import ROUNDED
from shoal.imported.source import Array, Source


def add_equalities(source: Source, parts: Parts) -> None:
    """Adds the joints of loops, after the tendons: welds and balls that are closed at the start; lines for others."""
    model, kinds = source.model, source.mujoco.mjtEq
    for number, name in enumerate(source.called(source.mujoco.mjtObj.mjOBJ_EQUALITY, model.neq, "loop")):
        if number in parts.kept:
            continue
        kind = kinds(model.eq_type[number])
        what = f"equality {name}: {kind.name.removeprefix('mjEQ_').lower()}"
        of_bodies = model.eq_objtype[number] == source.mujoco.mjtObj.mjOBJ_BODY
        if kind not in (kinds.mjEQ_CONNECT, kinds.mjEQ_WELD) or not of_bodies:
            parts.left_out.append(what)
        elif not model.eq_active0[number]:
            parts.left_out.append(f"{what}, not active")
        elif (joint := _joint(source, number, kind == kinds.mjEQ_WELD)) is None:
            parts.left_out.append(f"{what} in another pose than that of the start")
        else:
            parts.joints[name if name not in parts.joints else f"loop-{name}"] = joint


def _joint(source: Source, number: int, weld: bool) -> dict[str, Any] | None:
    """The joint of an equality of two bodies, if they stand as it holds them. A weld without torque is a ball."""
    model = source.model
    one, other, data = model.eq_obj1id[number], model.eq_obj2id[number], model.eq_data[number]
    # The anchor of a weld lies in the second body, that of a connection in the first; then follows the other's.
    near, far = (data[3:6], data[:3]) if weld else (data[:3], data[3:6])
    place = _place(source, one, near)
    rigid = weld and data[10] != 0
    gap = np.linalg.norm(place - _place(source, other, far))
    if gap > ROUNDED or (rigid and _turned(source, one, other, data[6:10]) > ROUNDED):
        return None
    return {
        "kind": "weld" if rigid else "spherical",
        "first": source.at(one, place),
        "second": source.at(other, place),
    }


def _place(source: Source, body: int, local: Array) -> Array:
    """A place of a body's axes [m] in those of the ground."""
    place: Array = source.data.xpos[body] + source.axes(body) @ local
    return place


def _turned(source: Source, one: int, other: int, relative: Array) -> float:
    """The angle [rad] by which the second body's rotation against the first is off a relative one."""
    first, second = (Rotation.from_quat(source.data.xquat[body], scalar_first=True) for body in (one, other))
    off = (first * Rotation.from_quat(relative, scalar_first=True)).inv() * second
    return float(off.magnitude())
