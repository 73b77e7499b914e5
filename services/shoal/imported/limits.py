"""Limits of hinges, slides and straight tendons: rigid stops, ropes and struts."""

from __future__ import annotations

from typing import Any

from shoal.imported.parts import Parts
from shoal.imported.source import Source

RIGID = "rigid and without rebound; MuJoCo's give way (solreflimit, solimplimit)"


def add_stops(source: Source, one: int, made: dict[str, Any], simple: bool, parts: Parts) -> None:
    """Add the limits of a joint to the one made for it, counted from its start; a line where they cannot be.

    simple: whether a revolute joint or a slider stands for it alone
    """
    model, name = source.model, source.joint_names[one]
    if not model.jnt_limited[one]:
        return
    low, high = map(float, model.jnt_range[one])
    start = float(source.data.qpos[model.jnt_qposadr[one]])
    told = f"joint {name}: its limits {low:g} to {high:g}"
    if not simple:
        parts.left_out.append(f"{told}; only a revolute joint or a slider has them")
    elif not low <= start <= high:
        parts.left_out.append(f"{told}; its start {start:g} is beyond them")
    else:
        # Where a joint is drawn from the body to its parent, its motion is the opposite.
        backwards = made["first"]["body"] == source.names[model.jnt_bodyid[one]]
        ends = (start - high, start - low) if backwards else (low - start, high - start)
        made["stops"] = dict(zip(("min", "max"), ends, strict=True))


def add_ropes(source: Source, number: int, name: str, sides: dict[str, Any], parts: Parts) -> None:
    """Add a rope of the largest length of a straight tendon, and a strut of its smallest; a line where none can be."""
    if not source.model.tendon_limited[number]:
        return
    low, high = map(float, source.model.tendon_range[number])
    start = float(source.data.ten_length[number])
    if not low <= start <= high:
        parts.left_out.append(f"tendon {name}: its limits {low:g} to {high:g}; its start {start:g} is beyond them")
        return
    for keeps, length in (("at-most", high), ("at-least", low)):
        if length > 0.0:
            parts.joints[f"{name}-{keeps}"] = {"kind": "distance", **sides, "keeps": keeps, "length": length}
            parts.origin[f"joints.{name}-{keeps}"] = f"tendon {name}"


def note(parts: Parts) -> list[str]:
    """Return a note on what the limits became, if there are some."""
    named = {"stops", "keeps"}
    limited = [name for name, joint in parts.joints.items() if named & {*joint}]
    return [f"limits of {', '.join(limited)}: {RIGID}"] if limited else []
