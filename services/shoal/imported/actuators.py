"""Constant forces and torques: actuators at sites that nothing controls."""

from __future__ import annotations

from typing import Any

import numpy as np

from shoal.imported.parts import Parts
from shoal.imported.rounding import numbers
from shoal.imported.source import Source
from shoal.imported.switches import disables
from shoal.scene import GROUND


def add_actuators(source: Source, parts: Parts) -> None:
    """Adds the forces [N] and torques [N m] of actuators that are constant; a line with the number of the others."""
    left = []
    # nu counts control signals, of which an actuator may have several or none.
    count = len(source.model.actuator_trntype)
    names = source.called(source.mujoco.mjtObj.mjOBJ_ACTUATOR, count, "actuator")
    for number, name in enumerate(names):
        load = _load(source, number)
        if load is None:
            left.append(name)
        else:
            called = name if name not in parts.loads else f"{name}-push"
            parts.loads[called], parts.origin[f"loads.{called}"] = load, f"actuator {name}"
    if left:
        parts.left_out.append(f"actuators: {len(left)}; what they do moves or holds the machine: {', '.join(left)}")


def _load(source: Source, number: int) -> dict[str, Any] | None:
    """What an actuator does, if that is one force or one torque on a body that moves."""
    gear = source.model.actuator_gear[number]
    pushes, turns = np.any(gear[:3]), np.any(gear[3:])
    if not _is_constant(source, number) or (pushes and turns):
        return None
    if source.at_site(source.model.actuator_trnid[number][0])["body"] == GROUND:
        return None
    return _torque(source, number) if turns else _force(source, number)


def _is_constant(source: Source, number: int) -> bool:
    model, mujoco = source.model, source.mujoco
    return bool(
        model.actuator_trntype[number] == mujoco.mjtTrn.mjTRN_SITE
        and model.actuator_dyntype[number] == mujoco.mjtDyn.mjDYN_NONE
        and model.actuator_gaintype[number] == mujoco.mjtGain.mjGAIN_FIXED
        and model.actuator_biastype[number] == mujoco.mjtBias.mjBIAS_AFFINE
        and not model.actuator_gainprm[number][0]
        and not np.any(model.actuator_biasprm[number][1:])
        and not model.actuator_forcelimited[number]
        and not model.actuator_damping[number]
        and not np.any(model.actuator_dampingpoly[number])
        and not model.actuator_armature[number]
        and not disables(model, mujoco.mjtDisableBit.mjDSBL_ACTUATION)
        and not model.opt.disableactuator >> int(model.actuator_group[number]) & 1
    )


def _torque(source: Source, number: int) -> dict[str, Any] | None:
    """About an axis of the second site, on whose body it reacts."""
    model = source.model
    site, other = model.actuator_trnid[number]
    if other < 0:
        return None
    axis = source.data.site_xmat[other].reshape(3, 3) @ model.actuator_gear[number][3:]
    reaction = source.at_site(other)
    held = {} if reaction["body"] == GROUND else {"reaction": reaction}
    torque = float(model.actuator_biasprm[number][0]) * float(np.linalg.norm(axis))
    return {"kind": "torque", "at": source.at_site(site), "torque": torque, "axis": numbers(axis), **held}


def _force(source: Source, number: int) -> dict[str, Any] | None:
    """Along axes of the ground, or of the site's own body, which it follows."""
    model = source.model
    site, other = model.actuator_trnid[number]
    if other >= 0 and source.owners[model.site_bodyid[other]] != 0:
        return None
    axes = source.data.site_xmat[site if other < 0 else other].reshape(3, 3)
    if other < 0:
        axes = source.axes(source.owners[model.site_bodyid[site]]).T @ axes
    force = numbers(float(model.actuator_biasprm[number][0]) * (axes @ model.actuator_gear[number][:3]))
    follows = {"follows": True} if other < 0 else {}
    return {"kind": "force", "at": source.at_site(site), "force": force, **follows}
