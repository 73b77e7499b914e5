"""Contacts of geoms: spheres, ends of capsules and wheels on planes, and spheres on spheres; others are counted.

Which geoms may touch follows MuJoCo: by their types of contact, but for geoms of one body, of a body and its parent,
and of bodies whose contacts a file excludes. Contacts are rigid and without rebound; MuJoCo's give way.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np

from shoal.imported.parts import Parts
from shoal.imported.rounding import ROUNDED, Array, numbers
from shoal.imported.source import Source
from shoal.imported.switches import disables

NOTE = "contacts are rigid and without rebound; MuJoCo's give way (solref, solimp)"


def add_contacts(source: Source, parts: Parts) -> None:
    """Add the contacts that a scene has; lines for pairs of geoms that are left out, by their types."""
    names = source.called(source.mujoco.mjtObj.mjOBJ_GEOM, source.model.ngeom, "geom")
    left, inside = Counter[str](), list[str]()
    for pair in np.argwhere(_may_touch(source)):
        one, other = sorted(map(int, pair), key=lambda geom: _kind(source, geom) == "plane")
        made = [*_touching(source, one, other)]
        if not made:
            left["-".join(sorted((_kind(source, one), _kind(source, other))))] += 1
        for number, (first, second, gap) in enumerate(made):
            name = f"{names[one]}-on-{names[other]}" + (f"-{number + 1}" if len(made) > 1 else "")
            if gap < -ROUNDED:
                inside.append(f"{names[one]} is {-gap:.3g} m within {names[other]}")
                continue
            rub = _friction(source, one, other)
            parts.contacts[name] = {"first": first, "second": second, **({"mu": rub} if rub else {})}
            parts.origin[f"contacts.{name}"] = f"geom {names[one]}"
    if left:
        listed = ", ".join(f"{count} {kinds}" for kinds, count in sorted(left.items()))
        parts.left_out.append(f"geoms: {left.total()} pairs that touch others are no contacts: {listed}")
    if inside:
        more = f", and {len(inside) - 1} more" if len(inside) > 1 else ""
        line = f"geoms: {len(inside)} pairs that touch others from the start are no contacts: {inside[0]}{more}"
        parts.left_out.append(line)
    if parts.contacts:
        parts.notes.append(NOTE)


def _kind(source: Source, geom: int) -> str:
    kind = source.mujoco.mjtGeom(source.model.geom_type[geom])
    return str(kind.name).removeprefix("mjGEOM_").lower()


def _may_touch(source: Source) -> Array:
    """Return which pairs of geoms may touch, each once, (geoms, geoms)."""
    model = source.model
    types, affinities = model.geom_contype[:, None], model.geom_conaffinity[None]
    able = (types & affinities) != 0
    able |= able.T
    owner = np.array(source.owners)[model.geom_bodyid]
    able &= owner[:, None] != owner[None]
    if not disables(model, source.mujoco.mjtDisableBit.mjDSBL_FILTERPARENT):
        parent = np.array(source.owners)[model.body_parentid[owner]]
        beside = (parent[:, None] == owner[None]) & (owner[None] != 0)
        able &= ~(beside | beside.T)
    for signature in model.exclude_signature:
        first, second = (model.geom_bodyid == part for part in (signature >> 16, signature & 0xFFFF))
        able &= ~(first[:, None] & second[None] | second[:, None] & first[None])
    return np.asarray(np.triu(able, 1))


def _touching(source: Source, one: int, other: int) -> Iterator[tuple[dict[str, Any], dict[str, Any], float]]:
    """Yield the sides of contacts of two geoms, and their gap [m] at the start; none of types without contacts."""
    data, size = source.data, source.model.geom_size
    kinds = _kind(source, one), _kind(source, other)
    place, axis = data.geom_xpos[one], data.geom_xmat[one].reshape(3, 3)[:, 2]
    radius, half = map(float, size[one][:2])
    if kinds == ("sphere", "sphere"):
        there, second = data.geom_xpos[other], float(size[other][0])
        gap = float(np.linalg.norm(place - there)) - radius - second
        yield _side(source, one, place) | {"radius": radius}, _side(source, other, there) | {"radius": second}, gap
    elif kinds[1] == "plane" and kinds[0] in ("sphere", "capsule", "cylinder"):
        base, normal = data.geom_xpos[other], data.geom_xmat[other].reshape(3, 3)[:, 2]
        plane = _side(source, other, base) | {"plane": numbers(normal)}
        wheel = kinds[0] == "cylinder"
        for centre in (place - half * axis, place + half * axis) if kinds[0] == "capsule" else (place,):
            reach = radius * np.sqrt(max(0.0, 1.0 - float(normal @ axis) ** 2)) if wheel else radius
            first = _side(source, one, centre) | {"radius": radius} | ({"axis": numbers(axis)} if wheel else {})
            yield first, plane, float(normal @ (centre - base)) - reach


def _side(source: Source, geom: int, place: Array) -> dict[str, Any]:
    return source.at(int(source.model.geom_bodyid[geom]), place)


def _friction(source: Source, one: int, other: int) -> float:
    """Return the coefficient of friction of a contact [1]: the larger, or that of the geom with priority."""
    model = source.model
    dimensions, priority = model.geom_condim[[one, other]], model.geom_priority[[one, other]]
    rubs = model.geom_friction[[one, other], 0]
    if priority[0] != priority[1]:
        chosen = int(np.argmax(priority))
        return float(rubs[chosen]) if dimensions[chosen] > 1 else 0.0
    return float(rubs.max()) if dimensions.max() > 1 else 0.0
