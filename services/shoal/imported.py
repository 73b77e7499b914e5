"""Scenes from URDF and MJCF files, parsed by MuJoCo, and what of a file has no counterpart in a scene."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from shoal.errors import InputError
from shoal.scene import GROUND, Scene

Array = npt.NDArray[np.float64]
SQUARE = 1e-6
"""Cosine below which two axes are at a right angle."""


@dataclass(frozen=True)
class Imported:
    """A scene as data, and a line for everything of its file that is not in it."""

    scene: dict[str, Any]
    left_out: tuple[str, ...]


def read(file: Path) -> Imported:
    """The scene of a URDF or MJCF file at its own start. Raises InputError, ModuleNotFoundError without MuJoCo."""
    import mujoco

    if not file.is_file():
        raise InputError(f"{file}: no such file")
    try:
        model = mujoco.MjSpec.from_file(str(file)).compile()
    except ValueError as error:
        raise InputError(f"{file}: {' '.join(str(error).split())}") from None
    reading = _Reading(mujoco, model)
    scene = reading.scene(re.sub(r"[^A-Za-z0-9_-]", "-", file.stem))
    Scene.parse(scene, str(file))
    return Imported(scene, tuple(reading.left_out))


@dataclass
class _Reading:
    """One model of MuJoCo's. owners: of each body, the one that has it as a place of its own, by number."""

    mujoco: Any
    model: Any
    left_out: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.data = self.mujoco.MjData(self.model)
        self.mujoco.mj_kinematics(self.model, self.data)
        self.names = self._names(self.mujoco.mjtObj.mjOBJ_BODY, self.model.nbody, "body")
        self.joint_names = self._names(self.mujoco.mjtObj.mjOBJ_JOINT, self.model.njnt, "joint")
        self.owners = [0]
        for body in range(1, self.model.nbody):
            # A frame without mass that is fixed to its parent is a place on it.
            alias = self.model.body_mass[body] == 0 and self.model.body_jntnum[body] == 0
            self.owners.append(self.owners[self.model.body_parentid[body]] if alias else body)

    def _names(self, kind: Any, count: int, what: str) -> list[str]:
        found: list[str] = []
        for number in range(count):
            name = self.mujoco.mj_id2name(self.model, kind, number) or f"{what}{number}"
            name = re.sub(r"[^A-Za-z0-9_-]", "-", name)
            name = name if name[0].isalpha() and name != GROUND else f"{what}-{name}"
            found.append(name if name not in found else f"{name}-{number}")
        return found

    def scene(self, name: str) -> dict[str, Any]:
        """The whole, as a scene's data."""
        model = self.model
        bodies: dict[str, Any] = {}
        initial: dict[str, Any] = {}
        joints: dict[str, Any] = {}
        loads: dict[str, Any] = {}
        for body in range(1, model.nbody):
            if self.owners[body] != body:
                continue
            if model.body_mass[body] == 0:
                raise InputError(f"{self.names[body]}: moves and has no mass; give it some, with an inertia")
            bodies[self.names[body]] = self._body(body)
            turn = Rotation.from_quat(self.data.xquat[body], scalar_first=True)
            initial[self.names[body]] = {"rotation": _numbers(turn.as_rotvec())}
            self._hang(body, joints, loads, initial)
        self._equalities(joints)
        self.left_out += self._counted()
        markers = {name: {"body": name} for name in bodies}
        for site, marker in enumerate(self._names(self.mujoco.mjtObj.mjOBJ_SITE, model.nsite, "site")):
            at = self._at(model.site_bodyid[site], self.data.site_xpos[site])
            if at["body"] != GROUND:
                markers[marker if marker not in markers else f"site-{marker}"] = at
        return {
            "name": name if name[:1].isalpha() else f"scene-{name}",
            "dimensions": 3,
            "gravity": _numbers(model.opt.gravity),
            "bodies": bodies,
            "joints": joints,
            **({"loads": loads} if loads else {}),
            "markers": markers,
            "initial": initial,
        }

    def _body(self, body: int) -> dict[str, Any]:
        model = self.model
        turn = Rotation.from_quat(model.body_iquat[body], scalar_first=True).as_matrix()
        inertia = turn @ np.diag(model.body_inertia[body]) @ turn.T
        return {
            "kind": "rigid-body",
            "mass": float(model.body_mass[body]),
            "inertia": [_numbers(row) for row in (inertia + inertia.T) / 2],
            "centre_of_mass": _numbers(model.body_ipos[body]),
        }

    def _at(self, body: int, place: Array) -> dict[str, Any]:
        """A place of the ground's axes [m] on a body of MuJoCo's, as an attachment."""
        owner = self.owners[body]
        if owner == 0:
            return {"body": GROUND, "point": _numbers(place)}
        local = self.data.xmat[owner].reshape(3, 3).T @ (place - self.data.xpos[owner])
        return {"body": self.names[owner], "point": _numbers(local)}

    def _hang(self, body: int, joints: dict[str, Any], loads: dict[str, Any], initial: dict[str, Any]) -> None:
        """How a body hangs on its parent. Raises InputError for several joints that no single one stands for."""
        model, kinds = self.model, self.mujoco.mjtJoint
        first, count = model.body_jntadr[body], model.body_jntnum[body]
        own = list(range(first, first + count))
        found = [kinds(model.jnt_type[one]) for one in own]
        parent, name = model.body_parentid[body], self.names[body]
        if found == [kinds.mjJNT_FREE]:
            initial[name]["position"] = _numbers(self.data.xpos[body])
            return
        place = self.data.xanchor[own[0]] if own else self.data.xpos[body]
        made: dict[str, Any] = {"first": self._at(parent, place), "second": self._at(body, place)}
        axes = [self.data.xaxis[one] for one in own]
        hinge, slide = kinds.mjJNT_HINGE, kinds.mjJNT_SLIDE
        if not own:
            made |= {"kind": "weld"}
        elif found == [hinge]:
            made |= {"kind": "revolute", "axis": _numbers(axes[0])}
        elif found == [slide]:
            made |= {"kind": "slider", "axis": _numbers(axes[0]), "rotation": "locked"}
        elif found == [kinds.mjJNT_BALL] or (found == [hinge] * 3 and self._meet(own)):
            made |= {"kind": "spherical"}
        elif found == [hinge] * 2 and self._meet(own) and abs(axes[0] @ axes[1]) < SQUARE:
            made |= {"kind": "universal", "axis": _numbers(axes[0]), "second_axis": _numbers(axes[1])}
        elif len(found) == 2 and {*found} == {hinge, slide} and np.linalg.norm(np.cross(*axes)) < SQUARE:
            made |= {"kind": "cylindrical", "axis": _numbers(axes[0])}
        else:
            raise InputError(f"{name}: no joint of a scene stands for its {len(own)} joints; put bodies between them")
        self._friction(own, made, loads)
        joints[self.joint_names[own[0]] if own else f"{name}-weld"] = made

    def _meet(self, own: list[int]) -> bool:
        """Whether joints are in one place."""
        return all(np.allclose(self.data.xanchor[one], self.data.xanchor[own[0]], atol=1e-9) for one in own)

    def _friction(self, own: list[int], made: dict[str, Any], loads: dict[str, Any]) -> None:
        """Damping, dry friction and springs of joints, and lines for what is left out of them."""
        model = self.model
        for one in own:
            name, dof = self.joint_names[one], model.jnt_dofadr[one]
            simple = made["kind"] in ("revolute", "slider")
            for what, value, word in (
                ("damping", float(model.dof_damping[dof]), "friction"),
                ("frictionloss", float(model.dof_frictionloss[dof]), "coulomb"),
            ):
                if value and simple:
                    made[word] = value
                elif value:
                    self.left_out.append(f"joint {name}: {what} {value:g}; a {made['kind']} joint has none")
            stiffness = float(np.ravel(model.jnt_stiffness[one])[0])
            address = model.jnt_qposadr[one]
            away = float(model.qpos_spring[address] - model.qpos0[address])
            if stiffness and made["kind"] == "revolute" and away == 0.0:
                sides = {side: made[side] for side in ("first", "second")}
                loads[f"{name}-spring"] = {
                    "kind": "torsion-spring",
                    **sides,
                    "stiffness": stiffness,
                    "axis": made["axis"],
                }
            elif stiffness:
                self.left_out.append(f"joint {name}: its spring of {stiffness:g} about another place or kind of joint")
            if model.jnt_limited[one]:
                low, high = model.jnt_range[one]
                self.left_out.append(f"joint {name}: its limits {low:g} to {high:g}")
            if model.dof_armature[dof]:
                self.left_out.append(f"joint {name}: its armature {model.dof_armature[dof]:g}")

    def _equalities(self, joints: dict[str, Any]) -> None:
        """Loops that close, by `connect` and `weld` of bodies."""
        model, kinds = self.model, self.mujoco.mjtEq
        for number, name in enumerate(self._names(self.mujoco.mjtObj.mjOBJ_EQUALITY, model.neq, "loop")):
            kind, of_bodies = model.eq_type[number], model.eq_objtype[number] == self.mujoco.mjtObj.mjOBJ_BODY
            word = {kinds.mjEQ_CONNECT: "spherical", kinds.mjEQ_WELD: "weld"}.get(kinds(kind))
            if word is None or not of_bodies or not model.eq_active0[number]:
                self.left_out.append(f"equality {name}: {kinds(kind).name.removeprefix('mjEQ_').lower()}")
                continue
            one, other = model.eq_obj1id[number], model.eq_obj2id[number]
            # The anchor of a weld lies in the second body, that of a connection in the first.
            holder = other if word == "weld" else one
            place = self.data.xpos[holder] + self.data.xmat[holder].reshape(3, 3) @ model.eq_data[number][:3]
            joints[name if name not in joints else f"loop-{name}"] = {
                "kind": word,
                "first": self._at(one, place),
                "second": self._at(other, place),
            }

    def _counted(self) -> Iterator[str]:
        """Lines for what a scene has not at all."""
        model = self.model
        colliding = int(np.sum((model.geom_contype != 0) | (model.geom_conaffinity != 0)))
        if colliding and model.ngeom:
            yield f"geoms: {colliding} that touch others; a scene has no contacts"
        if model.ngeom - colliding:
            yield f"geoms: {model.ngeom - colliding} that are only seen"
        counts = (("tendon", "ntendon"), ("actuator", "nu"), ("sensor", "nsensor"), ("keyframe", "nkey"))
        for what, count in (*counts, ("camera", "ncam"), ("light", "nlight"), ("flexible body", "nflex")):
            if number := getattr(model, count):
                yield f"{what}s: {number}" if what != "flexible body" else f"flexible bodies: {number}"
        if model.opt.density or model.opt.viscosity:
            yield f"the medium: density {model.opt.density:g}, viscosity {model.opt.viscosity:g}"
        if np.any(model.body_gravcomp):
            yield "gravity compensation of bodies"


def _numbers(values: Any) -> list[float]:
    """Numbers without the last digits of rounding."""
    return [float(f"{x:.15g}") if abs(x) > 1e-15 else 0.0 for x in np.ravel(values)]
