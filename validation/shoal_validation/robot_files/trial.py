"""One robot file: imported or not, and its motion beside MuJoCo's."""

from __future__ import annotations

import re
import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from shoal.errors import ShoalError
from shoal.imported import Imported, read
from shoal.imported.read import load
from shoal.imported.source import Source
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene

OWN, OURS = "MuJoCo reads the file", "MuJoCo moves what we read of the file"
TIME = 0.3
STEP = 1e-4
NEAR = 1e-6
"""Distance [m] up to which motions agree."""
MOST = 60
"""Bodies of a machine that is simulated: larger ones take minutes at these tolerances."""
FINE = {"solver.integrator": "dop853", "solver.relative_tolerance": 1e-10, "solver.absolute_tolerance": 1e-11}
REASONS = {
    "nothing in it moves": "no link that moves has mass",
    "is not found": "a file that it needs is not there",
    "Error opening file": "a file that it needs is not there",
    "mujocoinclude": "a part of other files",
    "no well-formed XML": "not XML",
    "XML Error": "MuJoCo does not read it",
    "Error:": "MuJoCo does not compile it",
    "must be": "a wrong value",
    "is negative": "a wrong value",
    "no link": "a wrong value",
}
"""Words of refusals, and reasons for them that lie in the file."""


@dataclass
class Trial:
    """A file by its path in the corpus; outcome: imported, refused, another machine, or failed; why.

    distance: of markers from MuJoCo's after `TIME` [m], where physics is the same; compared: with what, or why not
    """

    file: str
    outcome: str
    why: str = ""
    distance: float | None = None
    compared: str = ""
    left_out: list[str] = field(default_factory=list)


def trial(path: Path, folder: Path) -> Trial:
    """Import a file, and move it."""
    name = str(path.relative_to(folder))
    try:
        found = read(path, contacts=False)
    except ShoalError as error:
        said = str(error).replace(str(path), "")
        why = next((reason for word, reason in REASONS.items() if word in said), "")
        return Trial(name, "refused" if why else "failed", why or re.sub(r"\d+", "N", said)[:160])
    except Exception as error:  # what is counted are such
        return Trial(name, "failed", f"{type(error).__name__}: {str(error)[:140]}")
    if found.missing:
        return Trial(name, "another machine", re.sub(r"^\S+ \S+: ", "", found.missing[0])[:80])
    done = Trial(name, "imported", left_out=[re.sub(r"[-\d.]+(e[-+]?\d+)?", "N", one)[:60] for one in found.left_out])
    try:
        done.distance, done.compared = compare(path, found)
    except (ShoalError, ValueError, KeyError) as error:
        done.compared = f"not compared: {str(error)[:140]}"
    return done


def compare(path: Path, found: Imported) -> tuple[float | None, str]:
    """Return the distance of markers after `TIME` [m], and what of MuJoCo's it is measured from.

    Both without contacts, limits, dry friction, actuators, tendons and equalities, which are soft in MuJoCo: that
    leaves masses, joints, damping, springs and rotors.
    """
    import mujoco

    if len(found.scene["bodies"]) > MOST:
        return None, f"not compared: {len(found.scene['bodies'])} bodies"
    spoiled = next((line for line in found.left_out if _changes(line)), None)
    if spoiled is not None:
        return None, f"other physics: {re.sub(r'^.*?: ', '', spoiled)[:60]}"
    named = Source.of(mujoco, load(path).model)
    scene = bare(found.scene, named.joint_names)
    model, source = reference(path, scene)
    for name in ("CONTACT", "LIMIT", "EQUALITY", "FRICTIONLOSS", "ACTUATION"):
        bit = getattr(mujoco.mjtDisableBit, f"mjDSBL_{name}")
        model.opt.disableflags |= int(bit)
    for values in (model.tendon_stiffness, model.tendon_damping, model.tendon_stiffnesspoly, model.tendon_dampingpoly):
        values[:] = 0.0
    model.opt.timestep, model.opt.integrator = STEP, mujoco.mjtIntegrator.mjINT_RK4
    data = mujoco.MjData(model)
    if model.nkey and any(one.get("spin") or one.get("velocity") for one in scene["initial"].values()):
        mujoco.mj_resetDataKeyframe(model, data, mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_KEY, "start"))
    for _ in range(round(TIME / STEP)):
        mujoco.mj_step(model, data)
    mujoco.mj_kinematics(model, data)
    if not np.all(np.isfinite(data.qpos)) or data.time < TIME - 1e-9:
        return None, "not compared: MuJoCo's motion diverges"
    moved = simulate(Scene.parse(scene).with_values(FINE), np.array([TIME]))
    if not moved.ok:
        return np.inf, f"ours: {moved.message[:120]}"
    places = {model.site(k).name or f"site{k}": data.site_xpos[k] for k in range(model.nsite)}
    places |= {model.body(k).name or f"body{k}": data.xpos[k] for k in range(1, model.nbody)}
    both = [name for name in scene["markers"] if name in places]
    if not both:
        return None, "not compared: no name in common"
    off = max(float(np.max(np.abs(moved.marker(name)[0] - places[name]))) for name in both)
    return off, source


def bare(scene: dict[str, Any], names: list[str]) -> dict[str, Any]:
    """Return a scene without what MuJoCo does otherwise, or what its equalities and tendons became.

    names: of the joints of the tree
    """
    joints = {}
    for name, joint in scene["joints"].items():
        if name.removesuffix("-plane") in names or joint["kind"] == "coupling":
            joints[name] = {key: value for key, value in joint.items() if key not in ("stops", "coulomb", "stick")}
    springs = {name: one for name, one in scene.get("loads", {}).items() if name.endswith("-spring")}
    rest = {key: value for key, value in scene.items() if key not in ("joints", "loads", "contacts")}
    return rest | {"joints": joints, "loads": springs}


def reference(path: Path, scene: dict[str, Any]) -> tuple[Any, str]:
    """Return MuJoCo's own model of a file; where it does not read it or fixes it otherwise, that of our reading."""
    import mujoco

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            model = mujoco.MjModel.from_xml_path(str(path))
    except ValueError:
        return load(path).model, OURS
    named = {model.body(k).name for k in range(1, model.nbody) if model.body_jntnum[k]}
    # MuJoCo fixes every root of URDF, and leaves none of a single link.
    same = path.suffix == ".xml" or {name for name in named if name in scene["bodies"]} >= {*scene["bodies"]}
    return (model, OWN) if same else (load(path).model, OURS)


def _changes(line: str) -> bool:
    """Return whether an omitted part changes the motion that is compared."""
    words = ("damping", "its spring", "its armature", "the medium", "gravity compensation", "frictionloss", "cubic")
    tendon = line.startswith("tendon") and "armature" not in line
    return any(word in line for word in words) and not tendon and not line.startswith("<")
