"""Quantities of a limit that markers alone do not tell: energies, forces in joints and sections of rods, strains.

Of a rigid machine in the plane the motion of its bodies tells them, whichever engine computed it; of others the
coordinates and rates, which the native engine tells.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from shoal.engines.contract import Engine
from shoal.engines.gauss import GaussEngine
from shoal.errors import InputError
from shoal.response.limits.quantities import ENERGIES, MOMENTS, STRAINS, needs_states
from shoal.scene import Attachment, Rod, Scene
from shoal.trajectory import Array, Trajectory

if TYPE_CHECKING:
    from shoal.mechanics.analysis.felt import Felt

_BODY = "moved-body-"
"""Of the names of markers that tell the motion of bodies."""


@dataclass(frozen=True)
class Telling(GaussEngine):
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


def asked(engine: Engine, scene: Scene, quantity: str) -> Engine:
    """Return an engine whose trajectories give a quantity. Raises InputError."""
    if not needs_states(quantity, scene):
        return engine
    if not isinstance(engine, GaussEngine):
        raise InputError(f"limit: {quantity} of this machine is told by the engine gauss alone; found {engine.name}")
    return Telling(engine.threads)


def equipped(scene: Scene, quantity: str) -> Scene:
    """Return the scene with markers that give the motion of its bodies, where this is enough."""
    if needs_states(quantity, scene):
        return scene
    markers = {f"{_BODY}{name}": Attachment(body=name, point=(0.0, 0.0)) for name in scene.bodies}
    return scene.model_copy(update={"markers": {**scene.markers, **markers}})


def along(motion: Trajectory, scene: Scene, values: Mapping[str, Array], quantity: str, place: str) -> Array:
    """Return the quantity of an equipped scene from its start, (instants, lanes), nan where a lane failed.

    Raises InputError.


    values: of the lanes by path
    """
    found = np.full((len(motion.times), motion.lanes), np.nan)
    told = _by_states if needs_states(quantity, scene) else _by_course
    # A model of all lanes tells places and accelerations in each, and forces of parts in the first only.
    alone = quantity not in STRAINS and not (told is _by_course and quantity in ENERGIES)
    alone = alone or scene.alone(values) is not None
    for lane, one in told(motion, scene, values, quantity, alone):
        found[:, lane] = _of_lane(one, quantity, place)
    return found


def _by_course(
    motion: Trajectory, scene: Scene, values: Mapping[str, Array], quantity: str, alone: bool
) -> Iterator[tuple[int, Felt]]:
    """Lanes that ran to the end, by the motion of their bodies; alone: each on a model of its own."""
    from shoal.mechanics.analysis.course import Course, machine, machines  # slow to import

    if motion.velocities is None or motion.rates is None:
        raise InputError(f"{quantity} needs rates, of which engine {motion.engine} tells none; use gauss")
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
        raise InputError(f"{quantity} needs all coordinates, which this motion does not tell")
    finite = np.all(np.isfinite(motion.states.q) & np.isfinite(motion.states.v), axis=(0, 1))
    whole = np.flatnonzero(finite).tolist()
    if alone:
        yield from ((lane, lane_of(motion.states, motion.times, scene, values, lane)) for lane in whole)
    else:
        yield from zip(whole, lanes_of(motion.states, motion.times, whole), strict=True)


def _of_lane(one: Felt, quantity: str, place: str) -> Array:
    """(instants,)."""
    from shoal.mechanics.analysis.energies import energies_along  # slow to import
    from shoal.mechanics.analysis.reactions_along import reactions_along
    from shoal.mechanics.analysis.sections_along import section_along

    if quantity in ENERGIES:
        energies = energies_along(one)
        return energies.total if quantity == "energy" else np.asarray(getattr(energies, quantity))
    if quantity in STRAINS:
        at = one.scene.markers[place]
        return one.strain(at, _height(one, at, quantity), 0.0)
    if place in one.scene.markers:
        return np.asarray(getattr(section_along(one, one.scene.markers[place]), quantity))
    force, torque, drive = reactions_along(one, (place,))[place]
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
