"""A machine at rest on paper: pale where it was placed, dark where its forces balance."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from shoal.mechanics.affine import points
from shoal.mechanics.analysis.equilibrium import Equilibrium
from shoal.mechanics.machine import Machine
from shoal.mechanics.numerics.tile import stacked
from shoal.pictures.motion import DrawnMotion, traced_out
from shoal.pictures.numbers import length
from shoal.pictures.outline import ground
from shoal.pictures.poses import poses
from shoal.trajectory import Array

_ZERO = 1e-9
"""Of the farthest marker's coordinates: what is smaller is told as zero."""


def rest(found: Equilibrium) -> Figure:
    """The machine as it was placed and where it came to rest. Raises InputError."""
    name = found.markers[-1]
    at = found.marker(name)
    place = ", ".join(f"{x:.4g}" for x in np.where(np.abs(at) < _ZERO * np.max(np.abs(found.points)), 0.0, at))
    known = f", known error {length(found.errors.total)}" if found.errors.estimates else ""
    title = f"{found.scene.name}: at rest {name} is at ({place}) m{known}"
    if not found.ok:
        title = f"{found.scene.name} ({found.status}: not to be trusted)"
    return poses(rest_motion(found), title, "from the start to the place of rest")


def rest_motion(found: Equilibrium) -> DrawnMotion:
    """Two frames: the start and the equilibrium."""
    traced, read = traced_out(found.scene)
    placement = Machine.of(traced).placement
    placed = placement.scene
    places = points([placement.point(placed, at) for at in placed.markers.values()], len(found.q))
    seen = np.stack([places.at(stacked(placement.positions)[:, 0]), places.at(found.q)], axis=1)
    numbers = {name: k for k, name in enumerate(placed.markers)}

    def at(name: str) -> Array:
        return np.asarray(seen[numbers[name]])

    markers = {name: at(name) for name in found.scene.markers}
    shown = read(at, np.zeros(2))
    return DrawnMotion(found.scene.name, np.array([0.0, 1.0]), ground(found.scene), markers=markers, **shown)
