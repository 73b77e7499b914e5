"""Fields that exist only in space, and those that only a plane scene has."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator

from shoal.scene.joints import sides
from shoal.scene.record import Record

SPATIAL_KINDS = ("spherical", "universal", "cylindrical", "planar")
PLANAR_ELEMENTS = ("ancf-full", "simo-reissner", "modal")
_Z = (0.0, 0.0, 1.0)
Dimensions = Annotated[Literal[2, 3], BeforeValidator(lambda given: int(given) if given in ("2", "3") else given)]
"""A text stands for its number, as `--set` gives it."""


def padded(vector: Any, dimensions: int) -> Any:
    """The components of a vector, with zeros for those left out."""
    return (*vector, *(0.0,) * (dimensions - len(vector)))


def check_dimensions(scene: Any) -> None:
    """Raises ValueError where a planar scene says what is of space only, or one of space what is of the plane only."""
    if scene.dimensions == 2:
        for name, joint in scene.joints.items():
            if joint.kind in SPATIAL_KINDS:
                raise ValueError(f"joints.{name}.kind: {joint.kind} is a joint in space; say dimensions: 3")
        for name, load in scene.loads.items():
            if load.kind == "bushing":
                raise ValueError(f"loads.{name}.kind: bushing is a load in space; say dimensions: 3")
        for name, body in scene.bodies.items():
            if body.element == "director-rod":
                raise ValueError(f"bodies.{name}.element: director-rod is for scenes in space; say dimensions: 3")
        _check_plane(scene, "")
        return
    for name, joint in scene.joints.items():
        if joint.kind not in ("coupling", "rope") and joint.first.body == joint.second.body:
            raise ValueError(f"joints.{name}: closes {joint.first.body!r} upon itself; that is for the plane")
    for name, load in scene.loads.items():
        for field in ("first_to", "second_to"):
            if getattr(load, field, None) is not None:
                raise ValueError(f"loads.{name}.{field}: is for scenes in the plane; say dimensions: 2")
    for name, joint in scene.joints.items():
        for path, place in sides(joint).items() if joint.kind == "rope" else ():
            if np.any(getattr(place, "radius", 0.0)):
                raise ValueError(f"joints.{name}.{path}.radius: in space a rope goes over eyes, without a radius")
    flat = is_flat(scene)
    for name, start in scene.initial.items():
        for one, other in (("angle", "rotation"), ("rate", "spin")):
            if getattr(start, one) is not None and getattr(start, other) is not None:
                raise ValueError(f"initial.{name}.{other}: {one} is stated as well; state one of them")
    for name, body in scene.bodies.items():
        if body.kind == "modal-body":
            raise ValueError(f"bodies.{name}.kind: modal-body is a body of the plane; say dimensions: 2")
        if body.kind == "rod" and body.element in PLANAR_ELEMENTS:
            raise ValueError(f"bodies.{name}.element: {body.element} is for the plane; use ancf-cable or director-rod")
        if body.kind == "rod" and body.element == "rigid" and body.section == "numbers" and body.rho_I is None:
            raise ValueError(f"bodies.{name}.rho_I is missing; in space a rigid rod of section numbers needs it (kg m)")
        if body.kind == "rod" and body.element == "director-rod":
            continue
        flexible = body.kind == "rod" and body.element != "rigid"
        alike = flexible and all(np.isclose(s.bending, s.side, rtol=1e-12) for s in map(body.section_at, (0.0, 1.0)))
        if flexible and not flat and not alike:
            field, other = ("EI_side", "EI") if body.section == "numbers" else ("width", "height")
            raise ValueError(
                f"bodies.{name}.{field}: {body.element} bends alike about both axes of its section; beyond the plane "
                f"z = 0 its {field} must be its {other}, or its element a director-rod"
            )
        for field in ("curvature", "side_curvature"):
            if body.kind == "rod" and getattr(body, field):
                raise ValueError(f"bodies.{name}.{field}: in space a curved rod is a director-rod, not {body.element}")


def _check_plane(part: Any, path: str) -> None:
    """Raises ValueError for the first field below `path` that is of space only."""
    if isinstance(part, Record):
        for name in part.model_fields_set:
            value = getattr(part, name)
            if name in _SPATIAL and _is_spatial(name, value):
                where = f"{path}.{name}".lstrip(".")
                raise ValueError(f"{where}: this is for scenes in space; say dimensions: 3")
            if isinstance(value, _PARTS):
                _check_plane(value, f"{path}.{name}".lstrip("."))
    elif isinstance(part, dict):
        for name, value in part.items():
            if isinstance(value, _PARTS):
                _check_plane(value, f"{path}.{name}")
    elif isinstance(part, tuple) and part and isinstance(part[0], Record):
        for number, value in enumerate(part):
            _check_plane(value, f"{path}.{number}")
    elif isinstance(part, tuple) and len(part) == 3 and _VECTORS & set(path.split(".")[-2:]):
        raise ValueError(f"{path}: has three components; say dimensions: 3, or leave one out")


def _is_spatial(name: str, value: Any) -> bool:
    """Return whether a field says what nothing in the plane has."""
    if name in ("axis", "second_axis", "plane"):
        return value is not None and value not in (_Z, "x", "y")
    if name == "z":
        return getattr(value, "number", None) != 0.0
    if name == "inertia":
        return isinstance(value, tuple)
    if name in ("side_curvature", "twist", "director"):
        return bool(value)
    return name in ("rotation", "spin", "torsion_constant") and not isinstance(value, str | None)


_PARTS = (Record, dict, tuple)
_SPATIAL = {"axis", "second_axis", "z", "inertia", "side_curvature", "twist", "director", "rotation", "spin"}
_SPATIAL |= {"torsion_constant", "plane"}
"""Fields of which `_is_spatial` speaks."""
_VECTORS = {"gravity", "position", "velocity", "point", "force", "centre_of_mass", "named_points"}


def is_flat(scene: Any) -> bool:
    """Return whether nothing that a scene in space states leads out of the plane z = 0."""
    return _is_flat(scene, "") and not any(joint.kind in SPATIAL_KINDS for joint in scene.joints.values())


def _is_flat(part: Any, path: str) -> bool:
    if isinstance(part, Record):
        named = ((name, getattr(part, name), f"{path}.{name}") for name in part.model_fields_set)
        return all(
            (name == "inertia" or not _is_spatial(name, value)) and _is_flat(value, at) for name, value, at in named
        )
    if isinstance(part, dict):
        return all(_is_flat(value, f"{path}.{name}") for name, value in part.items())
    if isinstance(part, tuple) and part and isinstance(part[0], Record):
        return all(_is_flat(value, path) for value in part)
    is_vector = isinstance(part, tuple) and len(part) == 3 and bool(_VECTORS & set(path.split(".")[-2:]))
    return not (is_vector and part[2] != 0)
