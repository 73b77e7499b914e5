"""Tendons: straight ones as springs and distances, those over several sites as ropes."""

from __future__ import annotations

from typing import Any

import numpy as np

from shoal.imported.limits import add_ropes
from shoal.imported.parts import Parts
from shoal.imported.source import Source
from shoal.imported.springs import law


def add_tendons(source: Source, parts: Parts) -> None:
    """Add tendons between two sites: springs, ropes, struts, and distances that an equality keeps; lines for others."""
    names = source.called(source.mujoco.mjtObj.mjOBJ_TENDON, source.model.ntendon, "tendon")
    lengths = _lengths(source)
    for number, name in enumerate(names):
        low, high = source.model.tendon_lengthspring[number]
        if not _is_straight(source, number) or low != high:
            if not _reeved(source, number, name, lengths, parts):
                _tell(source, number, name, parts)
            continue
        parts.left_out += [f"tendon {name}: its {what}" for what in _further(source, number)]
        first = source.model.tendon_adr[number]
        one, other = (source.at_site(end) for end in source.model.wrap_objid[first : first + 2])
        sides = {"first": one, "second": other}
        add_ropes(source, number, name, sides, parts)
        if number in lengths:
            parts.kept.add(lengths[number])
            called = name if name not in parts.joints else f"{name}-length"
            parts.joints[called] = {"kind": "distance", **sides}
            parts.origin[f"joints.{called}"] = f"tendon {name}"
        if acts := _law(source, number):
            load = {"kind": "spring", **sides, **acts, "length": float(low)}
            called = name if name not in parts.loads else f"{name}-tendon"
            parts.loads[called], parts.origin[f"loads.{called}"] = load, f"tendon {name}"


def _reeved(source: Source, number: int, name: str, lengths: dict[int, int], parts: Parts) -> bool:
    """Add ropes for a tendon over sites, of its largest length, its kept one or a spring that only pulls.

    Return whether they are all that it does.
    """
    model, start = source.model, float(source.data.ten_length[number])
    first, count = model.tendon_adr[number], model.tendon_num[number]
    low, high = map(float, model.tendon_lengthspring[number])
    least, most = map(float, model.tendon_range[number])
    acts, limited = _law(source, number), bool(model.tendon_limited[number])
    springs = bool(acts) and low <= 0.0 < high
    if not np.all(model.wrap_type[first : first + count] == source.mujoco.mjtWrap.mjWRAP_SITE):
        return False
    if (acts and not (springs and {*acts} == {"stiffness"})) or (limited and not least <= 0.0 < start <= most):
        return False
    if _further(source, number):
        return False
    begin, *over, end = (source.at_site(site) for site in model.wrap_objid[first : first + count])
    rope: dict[str, Any] = {"kind": "rope", "first": begin, "second": end} | ({"over": over} if over else {})
    wanted: dict[str, Any] = {"length": rope | {"keeps": "exactly"}} if number in lengths else {}
    wanted |= {"at-most": rope | {"length": most}} if limited else {}
    law = {"stiffness": acts.get("stiffness"), "exponent": 1.0}
    wanted |= {"spring": rope | {"length": high, "law": law}} if springs else {}
    if number in lengths:
        parts.kept.add(lengths[number])
    for suffix, one in wanted.items():
        parts.joints[f"{name}-{suffix}"], parts.origin[f"joints.{name}-{suffix}"] = one, f"tendon {name}"
    return True


def _tell(source: Source, number: int, name: str, parts: Parts) -> None:
    """A line for a tendon over joints, or over more than two sites: only a rope over several holds bodies."""
    acts = [
        "its spring" if "stiffness" in (law := _law(source, number)) else "",
        "its damping" if "damping" in law else "",
    ]
    acts += [f"its {what}" for what in _further(source, number)]
    first = source.model.tendon_adr[number]
    over = source.model.wrap_type[first] == source.mujoco.mjtWrap.mjWRAP_JOINT
    if source.model.tendon_limited[number]:
        low, high = source.model.tendon_range[number]
        acts.append(f"its limits {low:g} to {high:g}")
    where = "over joints" if over else "between more than two sites"
    line = f"tendon {name}: {where}{''.join(f'; {what}' for what in acts if what)}"
    if source.model.tendon_limited[number] and not over:
        parts.miss(line)
    else:
        parts.left_out.append(line)


def _lengths(source: Source) -> dict[int, int]:
    """Of tendons whose length stays that of the start, the equality that keeps it."""
    model, kinds = source.model, source.mujoco.mjtEq
    return {
        int(model.eq_obj1id[number]): number
        for number in range(model.neq)
        if model.eq_type[number] == kinds.mjEQ_TENDON and model.eq_obj2id[number] < 0 and model.eq_active0[number]
        and not np.any(model.eq_data[number][:5] - [0, 1, 0, 0, 0])
    }  # fmt: skip


def _is_straight(source: Source, number: int) -> bool:
    first, count = source.model.tendon_adr[number], source.model.tendon_num[number]
    wraps = source.model.wrap_type[first : first + count]
    return bool(count == 2 and all(wraps == source.mujoco.mjtWrap.mjWRAP_SITE))


def _further(source: Source, number: int) -> list[str]:
    """What a tendon has and a spring has not."""
    model = source.model
    every = (
        (model.tendon_frictionloss, "frictionloss"),
        (model.tendon_armature, "armature"),
        (model.tendon_springyield, "springyield"),
        (model.tendon_dampingpoly, "damping that is not linear"),
    )
    return [what for values, what in every if np.any(values[number])]


def _law(source: Source, number: int) -> dict[str, Any]:
    model = source.model
    found = law(model.tendon_stiffness[number], model.tendon_stiffnesspoly[number])
    if damping := float(model.tendon_damping[number]):
        found["damping"] = damping
    return found
