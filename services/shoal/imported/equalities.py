"""Equalities: loops closed by `connect` and `weld` of bodies, and couplings by linear ones of joints."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from shoal.imported.parts import Parts
from shoal.imported.rounding import ROUNDED, Array
from shoal.imported.source import Source
from shoal.scene.formula import Measure


def add_equalities(source: Source, parts: Parts) -> None:
    """Add the joints of equalities, after the tendons: closed loops and couplings; lines for others."""
    model, kinds = source.model, source.mujoco.mjtEq
    for number, name in enumerate(source.called(source.mujoco.mjtObj.mjOBJ_EQUALITY, model.neq, "loop")):
        if number in parts.kept:
            continue
        kind = kinds(model.eq_type[number])
        what = f"equality {name}: {kind.name.removeprefix('mjEQ_').lower()}"
        joint: dict[str, Any] | None = None
        if not model.eq_active0[number]:
            parts.left_out.append(f"{what}, not active")
            continue
        if kind == kinds.mjEQ_JOINT:
            joint, what = _coupling(source, number, parts), f"{what} {_coupled(source, number)}"
        elif kind == kinds.mjEQ_TENDON:
            joint = _of_tendons(source, number, parts)
        elif kind in (kinds.mjEQ_CONNECT, kinds.mjEQ_WELD):
            joint = _joint(source, number, kind == kinds.mjEQ_WELD)
            what += " in another pose than that of the start" * (joint is None)
        if joint is None:
            parts.miss(what)
        else:
            called = name if name not in parts.joints else f"loop-{name}"
            parts.joints[called], parts.origin[f"joints.{called}"] = joint, f"equality {name}"


def _coupled(source: Source, number: int) -> str:
    """Return which joints an equality couples, as a sentence of a report says it."""
    driven, driving = (int(one[number]) for one in (source.model.eq_obj1id, source.model.eq_obj2id))
    follows = f" follows {source.joint_names[driving]}" if driving >= 0 else " is held"
    return f"{source.joint_names[driven]}{follows}"


def _coupling(source: Source, number: int, parts: Parts) -> dict[str, Any] | None:
    """The coupling of a linear equality of hinges and slides."""
    driven, driving = int(source.model.eq_obj1id[number]), int(source.model.eq_obj2id[number])
    factor, *curved = source.model.eq_data[number][1:5]
    if driving >= 0 and any(curved):
        return None
    terms = [(driven, 1.0)] + ([(driving, -float(factor))] if driving >= 0 and factor else [])
    return coupling(source, terms, parts)


def _of_tendons(source: Source, number: int, parts: Parts) -> dict[str, Any] | None:
    """The coupling of a linear equality of fixed tendons, whose lengths are sums of coordinates of joints."""
    model = source.model
    tendon, other = int(model.eq_obj1id[number]), int(model.eq_obj2id[number])
    factor, *curved = model.eq_data[number][1:5]
    found: dict[int, float] = {}
    for one, share in [(tendon, 1.0)] + ([(other, -float(factor))] if other >= 0 else []):
        first = model.tendon_adr[one]
        for wrap in range(first, first + model.tendon_num[one]):
            if model.wrap_type[wrap] != source.mujoco.mjtWrap.mjWRAP_JOINT:
                return None
            joint = int(model.wrap_objid[wrap])
            found[joint] = found.get(joint, 0.0) + share * float(model.wrap_prm[wrap])
    if (other >= 0 and any(curved)) or model.eq_data[number][0]:
        return None
    return coupling(source, [one for one in found.items() if one[1]], parts)


def coupling(source: Source, terms: list[tuple[int, float]], parts: Parts) -> dict[str, Any] | None:
    """The coupling of joints with factors of their coordinates; none where a joint is no hinge or slide alone."""
    counted = []
    for one, factor in terms:
        name = source.joint_names[one]
        made, kind = parts.joints.get(name, {}), source.model.jnt_type[one]
        types = source.mujoco.mjtJoint
        kinds = {"revolute": int(types.mjJNT_HINGE), "slider": int(types.mjJNT_SLIDE)}
        if kinds.get(made.get("kind", "")) != kind:
            return None
        # Where a joint is drawn from the body to its parent, its motion is the opposite.
        if made["first"]["body"] == source.names[source.model.jnt_bodyid[one]]:
            factor = -factor
        measure = "angle" if made["kind"] == "revolute" else "slide"
        counted.append({"of": Measure(measure, (name,)).text, "factor": factor})
    return {"kind": "coupling", "terms": counted}


def _joint(source: Source, number: int, weld: bool) -> dict[str, Any] | None:
    """The joint of an equality of two bodies or sites, if they stand as it holds them.

    A weld without torque is a ball.
    """
    model, places = source.model, source.data.site_xpos
    one, other, data = int(model.eq_obj1id[number]), int(model.eq_obj2id[number]), model.eq_data[number]
    rigid = weld and data[10] != 0
    if model.eq_objtype[number] == source.mujoco.mjtObj.mjOBJ_SITE:
        frames = (Rotation.from_matrix(source.data.site_xmat[site].reshape(3, 3)) for site in (one, other))
        place, turned = places[one], _angle(*frames)
        gap = np.linalg.norm(place - places[other])
        one, other = (int(model.site_bodyid[site]) for site in (one, other))
    else:
        # The anchor of a weld lies in the second body, that of a connection in the first; then follows the other's.
        near, far = (data[3:6], data[:3]) if weld else (data[:3], data[3:6])
        place = _place(source, one, near)
        gap = np.linalg.norm(place - _place(source, other, far))
        first, second = (Rotation.from_quat(source.data.xquat[body], scalar_first=True) for body in (one, other))
        turned = _angle(first * Rotation.from_quat(data[6:10], scalar_first=True), second) if rigid else 0.0
    if gap > ROUNDED or (rigid and turned > ROUNDED):
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


def _angle(one: Rotation, other: Rotation) -> float:
    """Return the angle [rad] between two orientations."""
    return float((one.inv() * other).magnitude())
