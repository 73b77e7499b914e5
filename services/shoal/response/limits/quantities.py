"""Quantities of a limit: of markers, joints, rods and whole machines, and their values over time.

Markers alone do not give energies, forces in joints and sections of rods, strains. Of a rigid machine in the plane the
motion of its bodies gives them, whichever engine computed it; of others the coordinates and rates of the native engine.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from shoal.engines.contract import Engine
from shoal.engines.gauss import GaussEngine
from shoal.errors import InputError
from shoal.scene import Attachment, Rod, Scene
from shoal.scene.joints import DrivenAngle
from shoal.trajectory import Array, Trajectory

if TYPE_CHECKING:
    from shoal.mechanics.analysis.felt import Felt


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
CONTACTS = {
    2: {"normal": "N", "friction": "N", "fx": "N", "fy": "N", "force": "N"},
    3: {"normal": "N", "friction": "N", **FORCES, "force": "N"},
}
"""What a contact exerts on its first body; friction: in the plane along the normal turned clockwise, else its size."""
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
    for table in (*MARKERS.values(), *REACTIONS.values(), *CONTACTS.values(), *SECTIONS.values(), STRAINS, ENERGIES)
    for name, unit in table.items()
}
_BENT = ("curvature", "side_curvature", "twist")
"""Fields that make the unstrained rod curved."""


def of_section(quantity: str, scene: Scene) -> bool:
    """Return whether the quantity is of a section of a flexible rod."""
    return quantity in STRAINS or quantity in SECTIONS[scene.dimensions]


def needs_states(quantity: str, scene: Scene) -> bool:
    """Return whether the quantity takes more than the motion of the bodies of a rigid machine in the plane."""
    if of_section(quantity, scene) or quantity == "friction":
        return True
    dynamic = quantity in ENERGIES or quantity in REACTIONS[scene.dimensions]
    bends = any(body.element != "rigid" for body in scene.bodies.values())
    return dynamic and (scene.dimensions == 3 or bends or scene.touches or bool(scene.states))


def check(place: str, quantity: str, scene: Scene) -> None:
    """Check that a machine gives it of a marker, a joint or, where place is empty, itself. Raises InputError."""
    d = scene.dimensions
    if quantity in ENERGIES:
        if place:
            raise InputError(f"{quantity} is that of the whole machine, not of {place!r}; write {quantity} alone")
        return
    if place in scene.contacts and quantity in CONTACTS[d]:
        return
    of_markers = {**MARKERS[d], **STRAINS, **SECTIONS[d]}
    if quantity not in of_markers and quantity not in REACTIONS[d] and not (scene.contacts and quantity in CONTACTS[d]):
        of_contacts = f"{', '.join(CONTACTS[d])} of a contact, " if scene.contacts else ""
        raise InputError(
            f"no quantity {quantity!r}; there are {', '.join(MARKERS[d])} of a marker, "
            f"{', '.join([*SECTIONS[d], *STRAINS])} of a marker on a flexible rod, {', '.join(REACTIONS[d])} of a "
            f"joint, {of_contacts}and {', '.join(ENERGIES)} of the machine"
        )
    kind, known, others = "marker", list(scene.markers), list(scene.joints)
    if quantity in REACTIONS[d]:
        kind, known, others = "joint", others, known
    elif quantity == "friction" or place in scene.contacts:
        kind, known, others = "contact", list(scene.contacts), known
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
    """Check that a marker lies on a rod that gives its section forces or its strain. Raises InputError."""
    name = scene.markers[marker].body
    rod = scene.bodies.get(name)
    if not isinstance(rod, Rod) or rod.element == "rigid":
        bending = scene.flexible_rods
        known = f"; flexible are {', '.join(bending)}" if bending else ""
        raise InputError(f"{quantity} is that of a flexible rod; {name}, with marker {marker}, is rigid{known}")
    if rod.element == "modal":
        raise InputError(f"{quantity} is known of rods of elements; bodies.{name}.element is modal, use ancf-cable")
    if quantity not in STRAINS:
        return
    if scene.dimensions == 3 and rod.element != "director-rod":
        raise InputError(f"{quantity} is in space known of director rods; bodies.{name}.element is {rod.element}")
    for field in _BENT:
        if getattr(rod, field):
            raise InputError(f"{quantity} is known of straight rods; bodies.{name}.{field} is not zero")


_BODY = "moved-body-"
"""Prefix of the names of markers that give the motion of bodies."""


@dataclass(frozen=True)
class StatefulGauss(GaussEngine):
    """The native engine, whose trajectories hold their states."""

    def simulate(self, scene: Scene, times: Sequence[float] | Array | None = None, *, whole: bool = True) -> Trajectory:
        """See `GaussEngine`."""
        return super().simulate(scene, times, whole=whole)

    def simulate_many(
        self,
        scene: Scene,
        values: Mapping[str, Array],
        times: Sequence[float] | Array | None = None,
        *,
        whole: bool = True,
    ) -> Trajectory:
        """See `GaussEngine`."""
        return super().simulate_many(scene, values, times, whole=whole)


def engine_for(engine: Engine, scene: Scene, quantity: str) -> Engine:
    """Return an engine whose trajectories give a quantity. Raises InputError."""
    if not needs_states(quantity, scene):
        return engine
    if not isinstance(engine, GaussEngine):
        raise InputError(
            f"limit: {quantity} of this machine is computed by the engine gauss alone; found {engine.name}"
        )
    return StatefulGauss(engine.threads)


def with_bodies(scene: Scene, quantity: str) -> Scene:
    """Return the scene with markers that give the motion of its bodies, where this is enough."""
    if needs_states(quantity, scene):
        return scene
    markers = {f"{_BODY}{name}": Attachment(body=name, point=(0.0, 0.0)) for name in scene.bodies}
    return scene.model_copy(update={"markers": {**scene.markers, **markers}})


def quantity_over_time(
    motion: Trajectory, scene: Scene, values: Mapping[str, Array], quantity: str, place: str
) -> Array:
    """Return the quantity of an equipped scene from its start, (instants, lanes), nan where a lane failed.

    Raises InputError.


    values: of the lanes by path
    """
    found = np.full((len(motion.times), motion.lanes), np.nan)
    each_lane = _by_states if needs_states(quantity, scene) else _by_course
    # A model of all lanes gives places and accelerations in each, and forces of parts in the first only.
    alone = quantity not in STRAINS and not (each_lane is _by_course and quantity in ENERGIES)
    alone = alone or scene.alone(values) is not None
    for lane, one in each_lane(motion, scene, values, quantity, alone):
        found[:, lane] = _of_lane(one, quantity, place)
    return found


def _by_course(
    motion: Trajectory, scene: Scene, values: Mapping[str, Array], quantity: str, alone: bool
) -> Iterator[tuple[int, Felt]]:
    """Lanes that ran to the end, by the motion of their bodies; alone: each on a model of its own."""
    from shoal.mechanics.analysis.course import Course, machine, machines  # slow to import

    if motion.velocities is None or motion.rates is None:
        raise InputError(f"{quantity} needs rates, of which engine {motion.engine} gives none; use gauss")
    rows = [motion.markers.index(f"{_BODY}{name}") for name in scene.bodies]
    parts = motion.points[:, rows], motion.velocities[:, rows], motion.angles[:, rows], motion.rates[:, rows]
    course = Course(motion.times, *parts)
    whole = [lane for lane in range(motion.lanes) if all(np.all(np.isfinite(part[..., lane])) for part in parts)]
    if alone:
        yield from ((lane, machine(scene, values, course, lane)) for lane in whole)
    elif whole:
        yield from zip(whole, machines(scene, values, course, whole), strict=True)


def _by_states(
    motion: Trajectory, scene: Scene, values: Mapping[str, Array], quantity: str, alone: bool
) -> Iterator[tuple[int, Felt]]:
    """The same by coordinates and rates."""
    from shoal.mechanics.analysis.felt import lane_of, lanes_of  # slow to import

    if motion.states is None:
        raise InputError(f"{quantity} needs all coordinates, which this motion does not hold")
    finite = np.all(np.isfinite(motion.states.q) & np.isfinite(motion.states.v), axis=(0, 1))
    whole = np.flatnonzero(finite).tolist()
    if alone:
        yield from ((lane, lane_of(motion.states, motion.times, scene, values, lane)) for lane in whole)
    else:
        yield from zip(whole, lanes_of(motion.states, motion.times, whole), strict=True)


def _of_lane(one: Felt, quantity: str, place: str) -> Array:
    """Return the quantity of one lane, (instants,)."""
    from shoal.mechanics.analysis.energies import energies_along  # slow to import
    from shoal.mechanics.analysis.reactions_along import reactions_along
    from shoal.mechanics.analysis.sections_along import section_along

    if quantity in ENERGIES:
        energies = energies_along(one)
        return energies.total if quantity == "energy" else np.asarray(getattr(energies, quantity))
    if quantity in STRAINS:
        at = one.scene.markers[place]
        return one.strain(at, _height(one, at, quantity), 0.0)
    if place in one.scene.contacts and quantity in CONTACTS[one.scene.dimensions]:
        place = f"contacts.{place}"
    elif place in one.scene.markers:
        return np.asarray(getattr(section_along(one, one.scene.markers[place]), quantity))
    force, torque, drive, normal, friction = reactions_along(one, (place,))[place]
    if quantity in ("normal", "friction"):
        return np.asarray(normal if quantity == "normal" else friction)
    if quantity == "torque":
        return torque if drive is None else drive
    if quantity == "force":
        return np.asarray(np.linalg.norm(force, axis=1))
    return np.asarray((torque if quantity in MOMENTS else force)[:, "xyz".index(quantity[1])])


def _height(one: Felt, at: Attachment, quantity: str) -> float:
    """Above the axis of the rod [m]."""
    if quantity == "strain":
        return 0.0
    rod = one.scene.bodies[at.body]
    assert isinstance(rod, Rod)
    here, there = (float(np.ravel(of)[one.lane % np.size(of)]) for of in (rod.height, rod.end_height or rod.height))
    length = float(np.ravel(rod.length)[one.lane % np.size(rod.length)])
    share = float(np.ravel(one.scene.location(at)[0])[0]) / length
    return 0.5 * (here + share * (there - here)) * (1.0 if quantity == "strain_above" else -1.0)
