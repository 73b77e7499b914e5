"""What became what: a row for each element of a file that is in the scene, or is left out of it."""

from __future__ import annotations

from typing import Any, NamedTuple

from shoal.imported.parts import Parts
from shoal.imported.source import Source

_SHOWN = ("rotation", "friction", "drag", "coulomb", "armature", "stops", "keeps", "stiffness", "cubic", "damping")


class Row(NamedTuple):
    """element: of the file; became: the path in the scene, and its kind; empty if it is left out."""

    element: str
    became: str
    remark: str


def rows(source: Source, parts: Parts) -> list[Row]:
    """Return the rows, in the order bodies, joints, loads, contacts, what is left out."""
    found = []
    for name, body in parts.bodies.items():
        fused = [
            source.names[part]
            for part, owner in enumerate(source.owners)
            if source.names[owner] == name and source.names[part] != name and owner
        ]
        remark = f"{body['mass']:.4g} kg" + (f", with {', '.join(fused)}" if fused else "")
        if name in parts.between:
            remark = f"between joints of one body; weighs {body['mass']:.2g} kg"
        found.append(Row(parts.origin.get(name, f"body {name}"), f"bodies.{name} ({body['kind']})", remark))
    for part, items in (("joints", parts.joints), ("loads", parts.loads), ("contacts", parts.contacts)):
        for name, item in items.items():
            kind = f" ({item['kind']})" if "kind" in item else ""
            element = parts.origin.get(f"{part}.{name}", f"{part.removesuffix('s')} {name}")
            found.append(Row(element, f"{part}.{name}{kind}", _remark(item)))
    for line in parts.left_out:
        element, _, remark = line.partition(": ")
        found.append(Row(element, "", remark + "; the scene is another machine" * (line in parts.missing)))
    return found


def _remark(item: dict[str, Any]) -> str:
    """Return the fields that act, with their numbers."""
    return ", ".join(f"{name} {_number(item[name])}".strip() for name in _SHOWN if name in item)


def _number(value: Any) -> str:
    if isinstance(value, dict):
        return " to ".join(f"{one:.4g}" for one in value.values() if isinstance(one, float))
    return f"{value:.4g}" if isinstance(value, float | int) else str(value)
