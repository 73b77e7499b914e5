"""What moves: bodies, point masses and their starts."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from shoal.errors import InputError
from shoal.imported.axes import span
from shoal.imported.composite import Moments, movable
from shoal.imported.parts import Parts
from shoal.imported.rounding import Array, numbers
from shoal.imported.source import Source
from shoal.imported.springs import resists


def rigid(source: Source, body: int, parts: Parts) -> dict[str, Any]:
    """A rigid body: mass [kg], centre of mass [m], inertia [kg m^2] about that. Raises InputError if it cannot move."""
    own, note, wrong = movable(source.moments[body], source.carried[body], parts.small)
    if wrong or not source.carried[body].mass:
        raise InputError(f"{source.names[body]}: {wrong or 'moves and has no mass; give it some, with an inertia'}")
    if note:
        parts.notes.append(f"body {source.names[body]}: {note}")
    return _rigid(own)


def light(source: Source, body: int, parts: Parts) -> dict[str, Any]:
    """A rigid body between two joints of one, which weighs next to nothing."""
    return _rigid(movable(Moments(), source.carried[body], parts.small)[0])


def _rigid(own: Moments) -> dict[str, Any]:
    return {
        "kind": "rigid-body",
        "mass": own.mass,
        "inertia": [numbers(row) for row in (own.inertia + own.inertia.T) / 2],
        "centre_of_mass": numbers(own.centre),
    }


def mass(source: Source, body: int) -> dict[str, Any]:
    """A point mass [kg]. Raises InputError for a body without mass."""
    if source.moments[body].mass == 0:
        raise InputError(f"{source.names[body]}: moves and has no mass; give it some, with an inertia")
    return {"kind": "point-mass", "mass": source.moments[body].mass}


def is_mass(source: Source, body: int) -> bool:
    """Return whether a body only slides against the ground, each way, and is held and seen at its centre: a point
    mass.
    """
    model, own = source.model, source.own(body)
    slides = len(own) == 3 and np.all(model.jnt_type[own] == int(source.mujoco.mjtJoint.mjJNT_SLIDE))
    if not slides or not span(source, own) or source.owners[model.body_parentid[body]] != 0:
        return False
    if any(resists(source, one) for one in own):
        return False
    held = np.any(
        (model.eq_objtype == int(source.mujoco.mjtObj.mjOBJ_BODY))
        & ((model.eq_obj1id == body) | (model.eq_obj2id == body))
    )
    off = np.any(source.moments[body].first) or np.any(model.site_pos[model.site_bodyid == body])
    return not (held or off or np.any(model.body_parentid == body))


def initial(source: Source, body: int, turns: bool = True, joints: int | None = None) -> dict[str, Any]:
    """A start: rotation [rad] and spin [rad/s] of what turns, position [m] and velocity [m/s] of what slides.

    joints: of a body between two joints of one, how many of them are before it
    """
    own = source.own(body)
    first = own if joints is None else own[:joints]
    start = {}
    speeds = np.zeros(6)
    moves = source.key is not None
    if moves:
        origin = source.mujoco.mjtObj.mjOBJ_XBODY
        source.mujoco.mj_objectVelocity(source.model, source.data, origin, body, speeds, 0)
        speeds -= sum((_rate(source, body, one) for one in own[len(first) :]), np.zeros(6))
    if turns:
        turn = Rotation.from_quat(source.data.xquat[body], scalar_first=True)
        start["rotation"] = numbers(turn.as_rotvec())
    if turns and moves:
        start["spin"] = numbers(speeds[:3])
    if slides := _slides(source, first):
        start["position"] = numbers(source.data.xpos[body])
    if slides and moves:
        start["velocity"] = numbers(speeds[3:])
    return start


def _rate(source: Source, body: int, joint: int) -> Array:
    """Return the spin [rad/s] and the velocity [m/s] of the origin of a body by a joint of its own."""
    model, data, kinds = source.model, source.data, source.mujoco.mjtJoint
    kind, address = model.jnt_type[joint], model.jnt_dofadr[joint]
    if kind == kinds.mjJNT_SLIDE:
        return np.concatenate([np.zeros(3), data.xaxis[joint] * data.qvel[address]])
    if kind == kinds.mjJNT_HINGE:
        spin = data.xaxis[joint] * data.qvel[address]
    else:
        spin = data.xmat[body].reshape(3, 3) @ data.qvel[address : address + 3]
    return np.concatenate([spin, np.cross(spin, data.xpos[body] - data.xanchor[joint])])


def _slides(source: Source, joints: list[int]) -> bool:
    """Return whether joints leave the place of a body free."""
    kinds = source.mujoco.mjtJoint
    return bool(np.any(np.isin(source.model.jnt_type[joints], [kinds.mjJNT_SLIDE, kinds.mjJNT_FREE])))
