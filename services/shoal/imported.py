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
ROUNDED = 1e-5
"""Of an angle [rad] or a length [m] as a file's rounding may leave it: 3.1416 is 7e-6 off half a turn."""


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
    _rest(scene, Scene.parse(scene, str(file)), reading.away)
    return Imported(scene, tuple(reading.left_out))


def _rest(data: dict[str, Any], scene: Scene, away: dict[str, float]) -> None:
    """States the angles [rad], as the mechanics counts them, of torsion springs that rest so far from the start."""
    from shoal.mechanics.assembly.loads import Loads
    from shoal.mechanics.assembly.placement import place
    from shoal.mechanics.assembly.rows import Rows

    if away:
        loads = Loads(scene, place(scene), Rows(0), 0.0)
        start = dict(zip(loads.names, loads.angles, strict=True))
        for name, angle in away.items():
            data["loads"][name]["angle"] = float(np.ravel(start[name])[0]) + angle


@dataclass
class _Reading:
    """One model of MuJoCo's. owners: of each body, the one that has it as a place of its own, by number."""

    mujoco: Any
    model: Any
    left_out: list[str] = field(default_factory=list)
    kept: set[int] = field(default_factory=set)
    """Equalities that joints stand for already."""
    away: dict[str, float] = field(default_factory=dict)
    """Of torsion springs that do not rest at the start, the angle [rad] from there to where they do."""
    axes: list[Array] = field(default_factory=list)
    """Those of joints so far that others should agree with, of parallel ones the first."""

    def __post_init__(self) -> None:
        self._switch_off()
        self.data = self.mujoco.MjData(self.model)
        self.key = self._start()
        self.mujoco.mj_forward(self.model, self.data)
        self.names = self._names(self.mujoco.mjtObj.mjOBJ_BODY, self.model.nbody, "body")
        self.joint_names = self._names(self.mujoco.mjtObj.mjOBJ_JOINT, self.model.njnt, "joint")
        self.owners = [0]
        for body in range(1, self.model.nbody):
            # A frame without mass that is fixed to its parent is a place on it.
            alias = self.model.body_mass[body] == 0 and self.model.body_jntnum[body] == 0
            self.owners.append(self.owners[self.model.body_parentid[body]] if alias else body)

    def _switch_off(self) -> None:
        """Takes out of the model what its flags disable."""
        model, bits = self.model, self.mujoco.mjtDisableBit
        constraints = {
            bits.mjDSBL_EQUALITY: ["eq_active0"],
            bits.mjDSBL_FRICTIONLOSS: ["dof_frictionloss", "tendon_frictionloss"],
            bits.mjDSBL_LIMIT: ["jnt_limited", "tendon_limited"],
            bits.mjDSBL_CONTACT: ["geom_contype", "geom_conaffinity"],
        }
        stiff = ["jnt_stiffness", "jnt_stiffnesspoly", "tendon_stiffness", "tendon_stiffnesspoly"]
        damped = ["dof_damping", "dof_dampingpoly", "tendon_damping", "tendon_dampingpoly"]
        every = {
            bits.mjDSBL_SPRING: stiff,
            bits.mjDSBL_DAMPER: damped,
            bits.mjDSBL_CONSTRAINT: [name for names in constraints.values() for name in names],
            **constraints,
        }
        for bit, names in every.items():
            for name in names if self._disables(bit) else []:
                getattr(model, name)[:] = 0
        if self._disables(bits.mjDSBL_GRAVITY):
            model.opt.gravity[:] = 0

    def _disables(self, bit: Any) -> bool:
        return bool(self.model.opt.disableflags & int(bit))

    def _start(self) -> int | None:
        """The keyframe `start`, if it has the rates of a machine that stands as the file draws it."""
        for key in range(self.model.nkey):
            if self.mujoco.mj_id2name(self.model, self.mujoco.mjtObj.mjOBJ_KEY, key) != "start":
                continue
            if np.array_equal(self.model.key_qpos[key], self.model.qpos0):
                self.data.qvel[:] = self.model.key_qvel[key]
                return key
        return None

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
            start = initial[self.names[body]] = {"rotation": _numbers(turn.as_rotvec())}
            if self.key is not None:
                speeds = np.zeros(6)
                self.mujoco.mj_objectVelocity(self.model, self.data, self.mujoco.mjtObj.mjOBJ_XBODY, body, speeds, 0)
                start |= {"spin": _numbers(speeds[:3])}
            if self._slides(body):
                start["position"] = _numbers(self.data.xpos[body])
                if self.key is not None:
                    start["velocity"] = _numbers(speeds[3:])
            if self._is_mass(body):
                bodies[self.names[body]] = {"kind": "point-mass", "mass": bodies[self.names[body]]["mass"]}
                start.pop("rotation")
                start.pop("spin", None)
                self._friction(self._own(body), {"kind": "point-mass"}, loads)
                continue
            self._hang(body, joints, loads)
        self._tendons(joints, loads)
        self._equalities(joints)
        self._actuators(loads)
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

    def _own(self, body: int) -> list[int]:
        """The joints of MuJoCo's by which a body hangs on its parent."""
        first = self.model.body_jntadr[body]
        return list(range(first, first + self.model.body_jntnum[body]))

    def _hang(self, body: int, joints: dict[str, Any], loads: dict[str, Any]) -> None:
        """How a body hangs on its parent. Raises InputError for several joints that no single one stands for."""
        kinds, own = self.mujoco.mjtJoint, self._own(body)
        found = [kinds(self.model.jnt_type[one]) for one in own]
        parent, name = self.model.body_parentid[body], self.names[body]
        hinge, slide, ball = kinds.mjJNT_HINGE, kinds.mjJNT_SLIDE, kinds.mjJNT_BALL
        sliding = [one for one, kind in zip(own, found, strict=True) if kind == slide]
        turning, turns = [one for one in own if one not in sliding], [kind for kind in found if kind != slide]
        anywhere = len(sliding) == 3 and self._span(sliding)
        anyhow = turns == [ball] or (turns == [hinge] * 3 and self._meet(turning) and self._span(turning))
        if found == [kinds.mjJNT_FREE] or (anywhere and anyhow):
            self._friction(own, {"kind": "free"}, loads)
            return
        if anywhere and not turning and self.owners[parent] == 0:
            joints |= self._upright(body)
            self._friction(own, {"kind": "coupling"}, loads)
            return
        # Where a slide is drawn does not matter.
        place = self.data.xanchor[turning[0]] if turning else self.data.xpos[body]
        made: dict[str, Any] = {"first": self._at(parent, place), "second": self._at(body, place)}
        if not np.any(self.model.eq_active0):  # no loop, in which axes of several bodies have to agree
            self.axes.clear()
        axes = [self._trued(self.data.xaxis[one]) for one in own if self.model.jnt_type[one] != int(ball)]
        if found in ([hinge, slide], [ball, slide], [hinge, slide, slide], [ball, slide, slide]):
            # The line or plane is fixed to the body, not to its parent.
            made = {"first": made["second"], "second": made["first"]}
            found, axes = found[::-1], axes[::-1]
        if not own:
            made |= {"kind": "weld"}
        elif found == [hinge]:
            made |= {"kind": "revolute", "axis": _numbers(axes[0])}
        elif found == [slide]:
            made |= {"kind": "slider", "axis": _numbers(axes[0]), "rotation": "locked"}
        elif anyhow and not sliding:
            made |= {"kind": "spherical"}
        elif found == [hinge] * 2 and self._meet(own) and abs(axes[0] @ axes[1]) < ROUNDED:
            made |= {"kind": "universal", "axis": _numbers(axes[0]), "second_axis": _numbers(axes[1])}
        elif len(found) == 2 and {*found} == {hinge, slide} and np.linalg.norm(np.cross(axes[0], axes[1])) < ROUNDED:
            made |= {"kind": "cylindrical", "axis": _numbers(axes[0])}
        elif found == [slide, hinge] and abs(axes[0] @ axes[1]) < ROUNDED:
            flat = {**made, "kind": "planar", "axis": _numbers(axes[1]), "rotation": "axis"}
            joints[f"{self.joint_names[own[0]]}-plane"] = flat
            made |= {"kind": "slider", "axis": _numbers(axes[0]), "rotation": "free"}
        elif found == [slide, ball]:
            made |= {"kind": "slider", "axis": _numbers(axes[0]), "rotation": "free"}
        elif found[:2] == [slide] * 2 and self._is_plane(found[2:], axes):
            rotation = "locked" if len(found) == 2 else "axis" if found[2] == hinge else "free"
            made |= {"kind": "planar", "axis": _numbers(np.cross(axes[0], axes[1])), "rotation": rotation}
        else:
            raise InputError(f"{name}: no joint of a scene stands for its {len(own)} joints; put bodies between them")
        self._friction(own, made, loads)
        joints[self.joint_names[own[0]] if own else f"{name}-weld"] = made

    def _trued(self, axis: Array) -> Array:
        """An axis, exactly parallel or square to those so far to which it is so but for the rounding of a file.

        Joints of one body or of a loop would else contradict each other by as little, and lock.
        """
        for known in self.axes:
            if np.linalg.norm(np.cross(known, axis)) < ROUNDED:
                return known * np.sign(known @ axis)
        square = np.array([known for known in self.axes if abs(known @ axis) < ROUNDED])
        if square.size:
            axis = axis - np.linalg.pinv(square, rcond=np.sqrt(ROUNDED)) @ (square @ axis)
        self.axes.append(axis / np.linalg.norm(axis))
        return self.axes[-1]

    def _upright(self, body: int) -> dict[str, Any]:
        """Joints that keep a body from turning: of arms along the ground's axes, each stays at its height."""
        foot, held = self.data.xpos[body], {}
        for arm, axis, along in zip(np.eye(3), "xyz", "yzx", strict=True):
            base = {"at": self._at(body, foot), "axis": along, "factor": -1.0}
            tip = {"at": self._at(body, foot + arm), "axis": along}
            held[f"{self.names[body]}-{axis}{along}"] = {"kind": "coupling", "terms": [base, tip]}
        return held

    def _is_plane(self, turns: list[Any], axes: list[Array]) -> bool:
        """Whether two slides, and a hinge or a ball after them, leave a plane and turns about its normal, or all."""
        kinds, normal = self.mujoco.mjtJoint, np.cross(axes[0], axes[1])
        if np.linalg.norm(normal) < ROUNDED or turns not in ([], [kinds.mjJNT_HINGE], [kinds.mjJNT_BALL]):
            return False
        square = turns == [kinds.mjJNT_HINGE] and np.linalg.norm(np.cross(normal, axes[2]))
        return bool(square < ROUNDED * np.linalg.norm(normal))

    def _span(self, own: list[int]) -> bool:
        """Whether the axes of three joints are those of a space."""
        return bool(abs(np.linalg.det(self.data.xaxis[own])) > ROUNDED)

    def _slides(self, body: int) -> bool:
        """Whether its joints leave the place of a body free."""
        kinds = self.mujoco.mjtJoint
        return bool(np.any(np.isin(self.model.jnt_type[self._own(body)], [kinds.mjJNT_SLIDE, kinds.mjJNT_FREE])))

    def _is_mass(self, body: int) -> bool:
        """Whether a body only slides against the ground, each way, and is held and seen at its centre: a point mass."""
        model, own = self.model, self._own(body)
        slides = len(own) == 3 and np.all(model.jnt_type[own] == int(self.mujoco.mjtJoint.mjJNT_SLIDE))
        if not slides or not self._span(own) or self.owners[model.body_parentid[body]] != 0:
            return False
        held = np.any(
            (model.eq_objtype == int(self.mujoco.mjtObj.mjOBJ_BODY))
            & ((model.eq_obj1id == body) | (model.eq_obj2id == body))
        )
        off = np.any(model.body_ipos[body]) or np.any(model.site_pos[model.site_bodyid == body])
        return not (held or off or np.any(model.body_parentid == body))

    def _tendons(self, joints: dict[str, Any], loads: dict[str, Any]) -> None:
        """Straight tendons between two sites: springs, and distances where an equality keeps their length."""
        model, kinds = self.model, self.mujoco.mjtEq
        names = self._names(self.mujoco.mjtObj.mjOBJ_TENDON, model.ntendon, "tendon")
        kept = {
            int(model.eq_obj1id[number]): number
            for number in range(model.neq)
            if model.eq_type[number] == kinds.mjEQ_TENDON and model.eq_obj2id[number] < 0 and model.eq_active0[number]
            and not np.any(model.eq_data[number][:5] - [0, 1, 0, 0, 0])
        }  # fmt: skip
        for number, name in enumerate(names):
            first, count = model.tendon_adr[number], model.tendon_num[number]
            ends = model.wrap_objid[first : first + count]
            straight = all(model.wrap_type[first : first + count] == self.mujoco.mjtWrap.mjWRAP_SITE) and count == 2
            low, high = model.tendon_lengthspring[number]
            if not straight or low != high:
                self.left_out.append(f"tendon {name}: more than a spring between two sites")
                continue
            for values, what in (
                (model.tendon_limited, "limits"),
                (model.tendon_frictionloss, "frictionloss"),
                (model.tendon_armature, "armature"),
                (model.tendon_springyield, "springyield"),
                (model.tendon_dampingpoly, "damping that is not linear"),
            ):
                if np.any(values[number]):
                    self.left_out.append(f"tendon {name}: its {what}")
            one, other = (self._at(model.site_bodyid[end], self.data.site_xpos[end]) for end in ends)
            made = {"first": one, "second": other}
            if number in kept:
                self.kept.add(kept[number])
                joints[name if name not in joints else f"{name}-length"] = {"kind": "distance", **made}
            law = self._law(model.tendon_stiffness[number], model.tendon_stiffnesspoly[number])
            if damping := float(model.tendon_damping[number]):
                law["damping"] = damping
            if law:
                load = {"kind": "spring", **made, **law, "length": float(low)}
                loads[name if name not in loads else f"{name}-tendon"] = load

    def _law(self, stiffness: float, further: Array) -> dict[str, Any]:
        """Of a spring whose force is a polynomial: the coefficient of x, and those of x^2 and x^3."""
        square, cubic = map(float, further)
        law = {"stiffness": float(stiffness), "cubic": cubic, "elastic": f"{square!r} * t**2" if square else 0}
        return {word: value for word, value in law.items() if value}

    def _actuators(self, loads: dict[str, Any]) -> None:
        """Constant forces and torques: actuators at sites that nothing controls."""
        model = self.model
        left = 0
        for number, name in enumerate(self._names(self.mujoco.mjtObj.mjOBJ_ACTUATOR, model.nu, "actuator")):
            load = self._push(number)
            if load is None:
                left += 1
            else:
                loads[name if name not in loads else f"{name}-push"] = load
        if left:
            self.left_out.append(f"actuators: {left}")

    def _push(self, number: int) -> dict[str, Any] | None:
        model = self.model
        constant = (
            model.actuator_trntype[number] == self.mujoco.mjtTrn.mjTRN_SITE
            and model.actuator_dyntype[number] == self.mujoco.mjtDyn.mjDYN_NONE
            and model.actuator_gaintype[number] == self.mujoco.mjtGain.mjGAIN_FIXED
            and model.actuator_biastype[number] == self.mujoco.mjtBias.mjBIAS_AFFINE
            and not model.actuator_gainprm[number][0]
            and not np.any(model.actuator_biasprm[number][1:])
            and not model.actuator_forcelimited[number]
            and not self._disables(self.mujoco.mjtDisableBit.mjDSBL_ACTUATION)
            and not model.opt.disableactuator >> int(model.actuator_group[number]) & 1
        )
        site, other = model.actuator_trnid[number]
        size, gear = float(model.actuator_biasprm[number][0]), model.actuator_gear[number]
        if not constant or (np.any(gear[:3]) and np.any(gear[3:])):
            return None
        at = self._at(model.site_bodyid[site], self.data.site_xpos[site])
        if at["body"] == GROUND:
            return None
        if np.any(gear[3:]):
            if other < 0:
                return None
            axis = self.data.site_xmat[other].reshape(3, 3) @ gear[3:]
            reaction = self._at(model.site_bodyid[other], self.data.site_xpos[other])
            held = {} if reaction["body"] == GROUND else {"reaction": reaction}
            torque = size * float(np.linalg.norm(axis))
            return {"kind": "torque", "at": at, "torque": torque, "axis": _numbers(axis), **held}
        if other >= 0 and self.owners[model.site_bodyid[other]] != 0:
            return None
        axes = self.data.site_xmat[site if other < 0 else other].reshape(3, 3)
        if other < 0:
            axes = self.data.xmat[self.owners[model.site_bodyid[site]]].reshape(3, 3).T @ axes
        force = _numbers(size * (axes @ gear[:3]))
        return {"kind": "force", "at": at, "force": force, **({"follows": True} if other < 0 else {})}

    def _meet(self, own: list[int]) -> bool:
        """Whether joints are in one place."""
        return all(np.allclose(self.data.xanchor[one], self.data.xanchor[own[0]], atol=1e-9) for one in own)

    def _friction(self, own: list[int], made: dict[str, Any], loads: dict[str, Any]) -> None:
        """Damping, dry friction and springs of joints, and lines for what is left out of them."""
        model = self.model
        for one in own:
            name, dof = self.joint_names[one], model.jnt_dofadr[one]
            words = {"revolute": self.mujoco.mjtJoint.mjJNT_HINGE, "slider": self.mujoco.mjtJoint.mjJNT_SLIDE}
            simple = words.get(made["kind"]) == self.mujoco.mjtJoint(model.jnt_type[one])
            square, cubic = map(float, model.dof_dampingpoly[dof])
            for what, value, word in (
                ("damping", float(model.dof_damping[dof]), "friction"),
                ("quadratic damping", square, "drag"),
                ("frictionloss", float(model.dof_frictionloss[dof]), "coulomb"),
            ):
                if value and simple:
                    made[word] = value
                elif value:
                    self.left_out.append(f"joint {name}: {what} {value:g}; only a revolute joint or a slider has it")
            if cubic:
                self.left_out.append(f"joint {name}: cubic damping {cubic:g}")
            law = self._law(model.jnt_stiffness[one], model.jnt_stiffnesspoly[one])
            if "elastic" in law and made["kind"] == "slider":
                self.left_out.append(f"joint {name}: the part {law.pop('elastic')} of its spring")
            if law and simple:
                loads[f"{name}-spring"] = self._spring(one, made) | law
            elif law:
                told = " and ".join(f"{word} {value}" for word, value in law.items())
                self.left_out.append(f"joint {name}: its spring ({told}); only a revolute joint or a slider has one")
            if law and (yielding := float(model.jnt_springyield[one])):
                self.left_out.append(f"joint {name}: that its spring yields at {yielding:g}")
            if model.jnt_limited[one]:
                low, high = model.jnt_range[one]
                self.left_out.append(f"joint {name}: its limits {low:g} to {high:g}")
            if model.dof_armature[dof]:
                self.left_out.append(f"joint {name}: its armature {model.dof_armature[dof]:g}")

    def _spring(self, one: int, made: dict[str, Any]) -> dict[str, Any]:
        """What acts between the sides of a revolute joint or a slider, at rest where the file says."""
        address = self.model.jnt_qposadr[one]
        away = float(self.model.qpos_spring[address] - self.model.qpos0[address])
        sides = {side: made[side] for side in ("first", "second")}
        if made["kind"] == "revolute":
            if away:
                self.away[f"{self.joint_names[one]}-spring"] = away
            return {"kind": "torsion-spring", **sides, "axis": made["axis"]}
        # Without length it pulls back by the whole way to the place of rest, on both sides of it.
        body, (side, place) = self.model.jnt_bodyid[one], made["first"].values()
        holder, sign = (body, -1) if side == self.names[body] else (self.owners[self.model.body_parentid[body]], 1)
        rest = place + self.data.xmat[holder].reshape(3, 3).T @ made["axis"] * sign * away
        return {"kind": "spring", **sides, "first": {"body": side, "point": _numbers(rest)}, "length": 0.0}

    def _equalities(self, joints: dict[str, Any]) -> None:
        """Loops that close, by `connect` and `weld` of bodies."""
        model, kinds = self.model, self.mujoco.mjtEq
        for number, name in enumerate(self._names(self.mujoco.mjtObj.mjOBJ_EQUALITY, model.neq, "loop")):
            if number in self.kept:
                continue
            kind = kinds(model.eq_type[number])
            what = f"equality {name}: {kind.name.removeprefix('mjEQ_').lower()}"
            of_bodies = model.eq_objtype[number] == self.mujoco.mjtObj.mjOBJ_BODY
            if kind not in (kinds.mjEQ_CONNECT, kinds.mjEQ_WELD) or not of_bodies:
                self.left_out.append(what)
                continue
            if not model.eq_active0[number]:
                self.left_out.append(f"{what}, not active")
                continue
            one, other, data = model.eq_obj1id[number], model.eq_obj2id[number], model.eq_data[number]
            # The anchor of a weld lies in the second body, that of a connection in the first; then follows the other's.
            near, far = (data[3:6], data[:3]) if kind == kinds.mjEQ_WELD else (data[:3], data[3:6])
            place, gap = self._place(one, near), self._place(one, near) - self._place(other, far)
            rigid = kind == kinds.mjEQ_WELD and data[10] != 0
            if np.linalg.norm(gap) > ROUNDED or (rigid and self._turned(one, other, data[6:10]) > ROUNDED):
                self.left_out.append(f"{what} in another pose than that of the start")
                continue
            joints[name if name not in joints else f"loop-{name}"] = {
                "kind": "weld" if rigid else "spherical",
                "first": self._at(one, place),
                "second": self._at(other, place),
            }

    def _place(self, body: int, local: Array) -> Array:
        """A place of a body's axes [m] in those of the ground."""
        place: Array = self.data.xpos[body] + self.data.xmat[body].reshape(3, 3) @ local
        return place

    def _turned(self, one: int, other: int, relative: Array) -> float:
        """The angle [rad] by which the second body's rotation against the first is off a relative one."""
        first, second = (Rotation.from_quat(self.data.xquat[body], scalar_first=True) for body in (one, other))
        off = (first * Rotation.from_quat(relative, scalar_first=True)).inv() * second
        return float(off.magnitude())

    def _counted(self) -> Iterator[str]:
        """Lines for what a scene has not at all."""
        model = self.model
        colliding = int(np.sum((model.geom_contype != 0) | (model.geom_conaffinity != 0)))
        if colliding and model.ngeom:
            yield f"geoms: {colliding} that touch others; a scene has no contacts"
        if model.ngeom - colliding:
            yield f"geoms: {model.ngeom - colliding} that are only seen"
        if keys := model.nkey - (self.key is not None):
            yield f"keyframes: {keys}"
        counts = (("sensor", "nsensor"),)
        for what, count in (*counts, ("camera", "ncam"), ("light", "nlight"), ("flexible body", "nflex")):
            if number := getattr(model, count):
                yield f"{what}s: {number}" if what != "flexible body" else f"flexible bodies: {number}"
        if model.opt.density or model.opt.viscosity:
            yield f"the medium: density {model.opt.density:g}, viscosity {model.opt.viscosity:g}"
        if model.npair and not self._disables(self.mujoco.mjtDisableBit.mjDSBL_CONTACT):
            yield f"contact pairs: {model.npair}"
        if model.nplugin:
            yield f"plugins: {model.nplugin}"
        if np.any(model.body_gravcomp):
            yield "gravity compensation of bodies"


def _numbers(values: Any) -> list[float]:
    """Numbers without the last digits of rounding."""
    return [float(f"{x:.15g}") if abs(x) > 1e-15 else 0.0 for x in np.ravel(values)]
