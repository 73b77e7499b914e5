"""What a limit may be on: quantities of markers, of joints and of whole machines, and which machine tells them."""

from __future__ import annotations

from shoal.errors import InputError
from shoal.scene import Rod, Scene
from shoal.scene.joints import DrivenAngle

MARKERS = {
    2: {"x": "m", "y": "m", "angle": "rad", "vx": "m/s", "vy": "m/s", "speed": "m/s", "rate": "rad/s"},
    3: {"x": "m", "y": "m", "z": "m", "vx": "m/s", "vy": "m/s", "vz": "m/s", "speed": "m/s"},
}
"""Of a marker, by dimensions, and their units."""
ENERGIES = {"energy": "J", "kinetic": "J", "potential": "J"}
"""Of the whole machine."""
FORCES = {"fx": "N", "fy": "N", "fz": "N"}
MOMENTS = {"mx": "N m", "my": "N m", "mz": "N m"}
REACTIONS = {
    2: {"fx": "N", "fy": "N", "force": "N", "torque": "N m"},
    3: {**FORCES, "force": "N", **MOMENTS, "torque": "N m"},
}
"""What a joint exerts on its second body, along the axes of the ground; force: its size; torque: in space that of a
drive about its axis."""
SECTIONS = {
    2: {"normal": "N", "shear": "N", "moment": "N m"},
    3: {"normal": "N", "shear": "N", "moment": "N m", "torsion": "N m"},
}
"""Of a flexible rod's section at a marker, with the signs of `mechanics.analysis.sections`; in space shear and moment
are sizes."""
STRAINS = {"strain": "m/m", "strain_above": "m/m", "strain_below": "m/m"}
"""Of a flexible rod at a marker: of its axis, and at half its height to either side of it."""
UNITS = {
    name: unit
    for table in (*MARKERS.values(), *REACTIONS.values(), *SECTIONS.values(), STRAINS, ENERGIES)
    for name, unit in table.items()
}
_BENT = ("curvature", "side_curvature", "twist")
"""Fields that make the unstrained rod curved."""


def of_section(quantity: str, scene: Scene) -> bool:
    """Return whether the quantity is of a section of a flexible rod."""
    return quantity in STRAINS or quantity in SECTIONS[scene.dimensions]


def needs_states(quantity: str, scene: Scene) -> bool:
    """Return whether the quantity takes more than the motion of the bodies of a rigid machine in the plane."""
    if of_section(quantity, scene):
        return True
    dynamic = quantity in ENERGIES or quantity in REACTIONS[scene.dimensions]
    return dynamic and (scene.dimensions == 3 or any(body.element != "rigid" for body in scene.bodies.values()))


def check(place: str, quantity: str, scene: Scene) -> None:
    """Return whether a machine tells it of a marker, a joint or, where place is empty, itself. Raises InputError."""
    d = scene.dimensions
    if quantity in ENERGIES:
        if place:
            raise InputError(f"{quantity} is that of the whole machine, not of {place!r}; write {quantity} alone")
        return
    of_markers = {**MARKERS[d], **STRAINS, **SECTIONS[d]}
    if quantity not in of_markers and quantity not in REACTIONS[d]:
        raise InputError(
            f"no quantity {quantity!r}; there are {', '.join(MARKERS[d])} of a marker, "
            f"{', '.join([*SECTIONS[d], *STRAINS])} of a marker on a flexible rod, {', '.join(REACTIONS[d])} of a "
            f"joint, and {', '.join(ENERGIES)} of the machine"
        )
    kind, known, others = "marker", list(scene.markers), list(scene.joints)
    if quantity in REACTIONS[d]:
        kind, known, others = "joint", others, known
    there = f"there are {', '.join(known)}" if known else "there are none"
    if not place:
        raise InputError(f"{quantity} is that of a {kind}; write {kind.upper()}.{quantity}, {there}")
    if place not in known:
        other = "marker" if kind == "joint" else "joint"
        also = f" ({place} is a {other}, and {quantity} is that of a {kind})" if place in others else ""
        raise InputError(f"no {kind} {place!r}{also}; {there}")
    if of_section(quantity, scene):
        _check_rod(scene, place, quantity)
    elif kind == "joint" and quantity == "torque" and d == 3 and not isinstance(scene.joints[place], DrivenAngle):
        raise InputError(
            f"torque is in space that of a driven-angle about its axis; joint {place} is a {scene.joints[place].kind}, "
            "which has mx, my and mz"
        )


def _check_rod(scene: Scene, marker: str, quantity: str) -> None:
    """Return whether a marker lies on a rod that tells its section forces or its strain. Raises InputError."""
    name = scene.markers[marker].body
    rod = scene.bodies.get(name)
    if not isinstance(rod, Rod) or rod.element == "rigid":
        bending = scene.flexible_rods
        known = f"; flexible are {', '.join(bending)}" if bending else ""
        raise InputError(f"{quantity} is that of a flexible rod; {name}, with marker {marker}, is rigid{known}")
    if rod.element == "modal":
        raise InputError(f"{quantity} is told of rods of elements; bodies.{name}.element is modal, use ancf-cable")
    if quantity not in STRAINS:
        return
    if scene.dimensions == 3 and rod.element != "director-rod":
        raise InputError(f"{quantity} is in space told of director rods; bodies.{name}.element is {rod.element}")
    for field in _BENT:
        if getattr(rod, field):
            raise InputError(f"{quantity} is told of straight rods; bodies.{name}.{field} is not zero")
