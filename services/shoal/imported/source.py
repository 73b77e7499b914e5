"""What is read: a model of MuJoCo's, and the places of its bodies."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from shoal.imported.composite import Moments
from shoal.imported.rounding import Array, numbers
from shoal.scene import GROUND


@dataclass(frozen=True)
class Source:
    """A compiled model of MuJoCo's at its start. Bodies, joints and sites are numbers, as MuJoCo counts them."""

    mujoco: Any
    """The module."""
    model: Any
    """What MuJoCo compiled of the file."""
    data: Any
    """The model's positions [m, rad] and rates [m/s, rad/s] at its start, and what follows from them."""
    names: list[str]
    """Those of the bodies, as a scene may have them."""
    joint_names: list[str]
    owners: list[int]
    """Of each body, the one that it is a part of: what no joint moves against its parent is part of that."""
    moments: list[Moments]
    """Of each body with its parts, in its frame."""
    carried: list[Moments]
    """Of each body with all that hangs on it, in its frame at the start."""
    key: int | None
    """The keyframe that the rates of the start are from; None is a start from rest."""

    @classmethod
    def of(cls, mujoco: Any, model: Any) -> Source:
        """A model in the pose in which its file draws it, with the rates of a keyframe `start` in that pose."""
        data, key = mujoco.MjData(model), _start(mujoco, model)
        _couple(mujoco, model, data)
        if key is not None:
            data.qvel[:] = model.key_qvel[key]
        mujoco.mj_forward(model, data)
        names = _called(mujoco, model, mujoco.mjtObj.mjOBJ_BODY, model.nbody, "body")
        joints = _called(mujoco, model, mujoco.mjtObj.mjOBJ_JOINT, model.njnt, "joint")
        owners = _owners(model)
        parts = [(owners[body], body) for body in range(1, model.nbody)]
        hung = [(owners[model.body_parentid[body]], body) for body in range(1, model.nbody) if owners[body] == body]
        moments = _gathered(model, data, parts)
        carried = [one + Moments() for one in moments]
        for parent, body in reversed(hung):
            carried[parent] += _seen(data, carried[body], body, parent)
        return cls(mujoco, model, data, names, joints, owners, moments, carried, key)

    def called(self, kind: Any, count: int, what: str) -> list[str]:
        """Names of all objects of a kind (mjtObj), each once and as a scene may have them; `what` and a number else."""
        return _called(self.mujoco, self.model, kind, count, what)

    def own(self, body: int) -> list[int]:
        """The joints by which a body hangs on its parent."""
        first = self.model.body_jntadr[body]
        return list(range(first, first + self.model.body_jntnum[body]))

    def axes(self, body: int) -> Array:
        """The axes of a body in those of the ground, in columns."""
        axes: Array = self.data.xmat[body].reshape(3, 3)
        return axes

    def at(self, body: int, place: Array) -> dict[str, Any]:
        """A place of the ground's axes [m] on a body, as an attachment."""
        owner = self.owners[body]
        if owner == 0:
            return {"body": GROUND, "point": numbers(place)}
        local = self.axes(owner).T @ (place - self.data.xpos[owner])
        return {"body": self.names[owner], "point": numbers(local)}

    def at_site(self, site: int) -> dict[str, Any]:
        """The place of a site, as an attachment."""
        return self.at(self.model.site_bodyid[site], self.data.site_xpos[site])


def _start(mujoco: Any, model: Any) -> int | None:
    """The keyframe `start`, if it has the rates of a machine that stands as the file draws it."""
    for key in range(model.nkey):
        if mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_KEY, key) != "start":
            continue
        if np.array_equal(model.key_qpos[key], model.qpos0):
            return key
    return None


def _couple(mujoco: Any, model: Any, data: Any) -> None:
    """Move joints that equalities let follow others to where those want them at the start."""
    for _ in range(model.neq):
        for number in np.flatnonzero((model.eq_type == int(mujoco.mjtEq.mjEQ_JOINT)) & (model.eq_active0 != 0)):
            driven, driving = int(model.eq_obj1id[number]), int(model.eq_obj2id[number])
            here = model.jnt_qposadr[driven]
            there = model.jnt_qposadr[driving] if driving >= 0 else here
            moved = data.qpos[there] - model.qpos0[there] if driving >= 0 else 0.0
            data.qpos[here] = model.qpos0[here] + np.polyval(model.eq_data[number][4::-1], moved)


def _called(mujoco: Any, model: Any, kind: Any, count: int, what: str) -> list[str]:
    found: list[str] = []
    for number in range(count):
        name = mujoco.mj_id2name(model, kind, number) or f"{what}{number}"
        name = re.sub(r"[^A-Za-z0-9_-]", "-", name)
        name = name if name[0].isalpha() and name != GROUND else f"{what}-{name}"
        found.append(name if name not in found else f"{name}-{number}")
    return found


def _owners(model: Any) -> list[int]:
    owners = [0]
    for body in range(1, model.nbody):
        owners.append(body if model.body_jntnum[body] else owners[model.body_parentid[body]])
    return owners


def _gathered(model: Any, data: Any, parts: list[tuple[int, int]]) -> list[Moments]:
    """Return the moments of bodies with their parts. parts: (body, part) each."""
    found = [Moments() for _ in range(model.nbody)]
    for body, part in parts:
        turn = Rotation.from_quat(model.body_iquat[part], scalar_first=True).as_matrix()
        inertia = turn @ np.diag(model.body_inertia[part]) @ turn.T
        own = Moments.of(float(model.body_mass[part]), model.body_ipos[part], inertia)
        found[body] += _seen(data, own, part, body)
    return found


def _seen(data: Any, own: Moments, body: int, other: int) -> Moments:
    """Return moments in the frame of one body in that of another."""
    axes = data.xmat[other].reshape(3, 3)
    place = axes.T @ (data.xpos[body] - data.xpos[other])
    return own if body == other else own.moved(axes.T @ data.xmat[body].reshape(3, 3), place)
