"""What moves: bodies, point masses and their starts."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from shoal.errors import InputError
from shoal.imported.axes import span
from shoal.imported.rounding import numbers
from shoal.imported.source import Source


def rigid(source: Source, body: int) -> dict[str, Any]:
    """A rigid body: mass [kg], centre of mass [m], inertia [kg m^2] about that. Raises InputError without mass."""
    model = source.model
    turn = Rotation.from_quat(model.body_iquat[body], scalar_first=True).as_matrix()
    inertia = turn @ np.diag(model.body_inertia[body]) @ turn.T
    return {
        "kind": "rigid-body",
        "mass": _mass(source, body),
        "inertia": [numbers(row) for row in (inertia + inertia.T) / 2],
        "centre_of_mass": numbers(model.body_ipos[body]),
    }


def mass(source: Source, body: int) -> dict[str, Any]:
    """A point mass [kg]. Raises InputError for a body without mass."""
    return {"kind": "point-mass", "mass": _mass(source, body)}


def _mass(source: Source, body: int) -> float:
    if source.model.body_mass[body] == 0:
        raise InputError(f"{source.names[body]}: moves and has no mass; give it some, with an inertia")
    return float(source.model.body_mass[body])


def is_mass(source: Source, body: int) -> bool:
    """Return whether a body only slides against the ground, each way, and is held and seen at its centre: a point
    mass.
    """
    model, own = source.model, source.own(body)
    slides = len(own) == 3 and np.all(model.jnt_type[own] == int(source.mujoco.mjtJoint.mjJNT_SLIDE))
    if not slides or not span(source, own) or source.owners[model.body_parentid[body]] != 0:
        return False
    held = np.any(
        (model.eq_objtype == int(source.mujoco.mjtObj.mjOBJ_BODY))
        & ((model.eq_obj1id == body) | (model.eq_obj2id == body))
    )
    off = np.any(model.body_ipos[body]) or np.any(model.site_pos[model.site_bodyid == body])
    return not (held or off or np.any(model.body_parentid == body))


def initial(source: Source, body: int, turns: bool) -> dict[str, Any]:
    """A start: rotation [rad] and spin [rad/s] of what turns, position [m] and velocity [m/s] of what slides."""
    start = {}
    speeds = np.zeros(6)
    moves = source.key is not None
    if moves:
        origin = source.mujoco.mjtObj.mjOBJ_XBODY
        source.mujoco.mj_objectVelocity(source.model, source.data, origin, body, speeds, 0)
    if turns:
        turn = Rotation.from_quat(source.data.xquat[body], scalar_first=True)
        start["rotation"] = numbers(turn.as_rotvec())
    if turns and moves:
        start["spin"] = numbers(speeds[:3])
    if slides := _slides(source, body):
        start["position"] = numbers(source.data.xpos[body])
    if slides and moves:
        start["velocity"] = numbers(speeds[3:])
    return start


def _slides(source: Source, body: int) -> bool:
    """Return whether its joints leave the place of a body free."""
    kinds = source.mujoco.mjtJoint
    return bool(np.any(np.isin(source.model.jnt_type[source.own(body)], [kinds.mjJNT_SLIDE, kinds.mjJNT_FREE])))
