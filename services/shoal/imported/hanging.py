"""How a body hangs on its parent."""

from __future__ import annotations

from typing import Any

import numpy as np

from shoal.imported.axes import Axes, meet, span
from shoal.imported.bodies import initial, light
from shoal.imported.counterparts import counterparts
from shoal.imported.parts import Parts
from shoal.imported.rounding import numbers
from shoal.imported.source import Source
from shoal.imported.springs import add_resistance, resists


def hang(source: Source, body: int, axes: Axes, parts: Parts) -> None:
    """Adds the joints of a body to its parent, and what acts in them; its axes agree with `axes`, to which they come.

    Between several joints that no single one stands for, or that resist, are bodies that weigh next to nothing.
    """
    kinds, own = source.mujoco.mjtJoint, source.own(body)
    if len(own) > 1 and any(resists(source, one) for one in own):
        _chain(source, body, axes, parts)
        return
    types = {one: kinds(source.model.jnt_type[one]) for one in own}
    found = [*types.values()]
    parent = source.model.body_parentid[body]
    sliding = [one for one in own if types[one] == kinds.mjJNT_SLIDE]
    turning = [one for one in own if one not in sliding]
    anywhere, anyhow = len(sliding) == 3 and span(source, sliding), _turns_anyhow(source, turning)
    if found == [kinds.mjJNT_FREE] or (anywhere and anyhow):
        add_resistance(source, own, {"kind": "free"}, parts)
        return
    if anywhere and not turning and source.owners[parent] == 0:
        parts.joints |= _upright(source, body)
        add_resistance(source, own, {"kind": "coupling"}, parts)
        return
    # Where a slide is drawn does not matter.
    place = source.data.xanchor[turning[0]] if turning else source.data.xpos[body]
    sides = {"first": source.at(parent, place), "second": source.at(body, place)}
    along = [axes.trued(source.data.xaxis[one]) for one in own if types[one] != kinds.mjJNT_BALL]
    if turning and len(sliding) in (1, 2) and own == turning[:1] + sliding:
        # The line or plane is fixed to the body, not to its parent.
        sides = {"first": sides["second"], "second": sides["first"]}
        found, along = found[::-1], along[::-1]
    if anyhow and not sliding:
        stands = [{"kind": "spherical"}]
    else:
        stands = counterparts(kinds, found, along, together=meet(source, turning))
    if not stands:
        _chain(source, body, axes, parts)
        return
    called = source.joint_names[own[0]]
    for plane in stands[:-1]:
        parts.joints[f"{called}-plane"] = sides | plane
    made = sides | stands[-1]
    add_resistance(source, own, made, parts)
    parts.joints[called] = made


def _chain(source: Source, body: int, axes: Axes, parts: Parts) -> None:
    """Add a body that weighs next to nothing between every two joints of a body, so that each acts by itself."""
    kinds, own = source.mujoco.mjtJoint, source.own(body)
    behind: dict[str, Any] = {}
    for number, one in enumerate(own):
        name, kind = source.joint_names[one], kinds(source.model.jnt_type[one])
        last = one == own[-1]
        owner = source.names[body] if last else f"{name}-link"
        if not last:
            parts.between.add(owner)
            parts.origin[owner] = f"body {source.names[body]}"
            parts.bodies[owner] = light(source, body, parts)
            parts.initial[owner] = initial(source, body, joints=number + 1)
        place = source.data.xanchor[one] if kind != kinds.mjJNT_SLIDE else source.data.xpos[body]
        local = source.axes(body).T @ (place - source.data.xpos[body])
        here = source.at(source.model.body_parentid[body], place) if number == 0 else behind | {"point": numbers(local)}
        if kind == kinds.mjJNT_BALL:
            made: dict[str, Any] = {"kind": "spherical"}
        else:
            (made,) = counterparts(kinds, [kind], [axes.trued(source.data.xaxis[one])], together=True)
        behind = {"body": owner}
        made = {"first": here, "second": {"body": owner, "point": numbers(local)}} | made
        add_resistance(source, [one], made, parts)
        parts.joints[name] = made


def _turns_anyhow(source: Source, turning: list[int]) -> bool:
    """Return whether joints that do not slide leave a body every turn about a place: a ball, or hinges that stand for
    one.
    """
    kinds, found = source.mujoco.mjtJoint, source.model.jnt_type[turning].tolist()
    gimbal = found == [int(kinds.mjJNT_HINGE)] * 3
    return found == [int(kinds.mjJNT_BALL)] or (gimbal and meet(source, turning) and span(source, turning))


def _upright(source: Source, body: int) -> dict[str, Any]:
    """Joints that keep a body from turning: of arms along the ground's axes, each stays at its height."""
    foot, held = source.data.xpos[body], {}
    for arm, axis, along in zip(np.eye(3), "xyz", "yzx", strict=True):
        base = {"at": source.at(body, foot), "axis": along, "factor": -1.0}
        tip = {"at": source.at(body, foot + arm), "axis": along}
        held[f"{source.names[body]}-{axis}{along}"] = {"kind": "coupling", "terms": [base, tip]}
    return held
