"""What a limit may be on beside places and rates: the energy of a machine, and the forces in its joints.

The motion of the bodies tells them, whichever engine computed it: forces as load cells show them.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from shoal.errors import InputError
from shoal.scene import Attachment, Scene
from shoal.trajectory import Array, Trajectory

ENERGIES = {"energy": "J", "kinetic": "J", "potential": "J"}
"""Of the whole machine, and their units."""
REACTIONS = {"fx": "N", "fy": "N", "force": "N", "torque": "N m"}
"""What a joint exerts on its second body, along the axes of the ground; force: its size."""
_BODY = "moved-body-"
"""Of the names of markers that tell the motion of bodies."""


def check(quantity: str, scene: Scene) -> None:
    """Whether a machine tells it. Raises InputError."""
    if scene.dimensions != 2:
        raise InputError(f"{quantity} is told of machines in the plane, this one moves in space")
    for name, body in scene.bodies.items():
        if body.element != "rigid":
            raise InputError(f"{quantity} is told of rigid machines; bodies.{name}.element is {body.element}")


def equipped(scene: Scene) -> Scene:
    """The scene with markers that tell the motion of its bodies."""
    markers = {f"{_BODY}{name}": Attachment(body=name, point=(0.0, 0.0)) for name in scene.bodies}
    return scene.model_copy(update={"markers": {**scene.markers, **markers}})


def along(motion: Trajectory, scene: Scene, values: Mapping[str, Array], quantity: str, joint: str) -> Array:
    """Of an equipped scene from its start, (instants, lanes), nan where a lane failed. Raises InputError.

    values: of the lanes by path
    """
    from shoal.mechanics.analysis.course import Course, machine, machines
    from shoal.mechanics.analysis.energies import energies_along  # slow to import
    from shoal.mechanics.analysis.load_cells import reactions_along

    if motion.velocities is None or motion.rates is None:
        raise InputError(f"{quantity} needs rates, of which engine {motion.engine} tells none; use gauss")
    rows = [motion.markers.index(f"{_BODY}{name}") for name in scene.bodies]
    parts = motion.points[:, rows], motion.velocities[:, rows], motion.angles[:, rows], motion.rates[:, rows]
    course = Course(motion.times, *parts)
    found = np.full((len(motion.times), motion.lanes), np.nan)
    whole = [lane for lane in range(motion.lanes) if all(np.all(np.isfinite(part[..., lane])) for part in parts)]
    if not whole:
        return found
    if quantity in ENERGIES:
        for lane, one in zip(whole, machines(scene, values, course, whole), strict=True):
            energies = energies_along(one)
            found[:, lane] = energies.total if quantity == "energy" else getattr(energies, quantity)
        return found
    for lane in whole:
        reaction = reactions_along(machine(scene, values, course, lane), (joint,))[joint]
        if quantity == "torque":
            found[:, lane] = reaction.torque
        elif quantity == "force":
            found[:, lane] = np.linalg.norm(reaction.force, axis=1)
        else:
            found[:, lane] = reaction.force[:, "xy".index(quantity[1])]
    return found
