"""Bound of the reach of a machine: no point is farther from its anchor than all bodies stretched out in a line.

A flexible rod stretches. Its strain energy is at least E A L e^2 / 2 for the mean strain e of its axis, as the mean of
squares is not below the square of the mean (for the Green strain of ancf-full, which is not below e, even more). So the
energy of a run bounds its reach.
"""

from __future__ import annotations

from functools import reduce
from itertools import combinations, zip_longest
from typing import Any

import numpy as np

from shoal.mechanics import plane
from shoal.mechanics.joints import Meet, of_scene
from shoal.mechanics.numerics.tile import Array
from shoal.scene import GROUND, Rod, Scene
from shoal.scene.joints import places, sides

MARGIN = 1.1
"""A run is rejected beyond so many times the reach, which bending and the samples of the energy round off."""
BREAKS = 5.0
"""No rod stretches by more than so many times its length: natural rubber breaks at 500 to 800 %, all else far before.

A run that gained energy without bound would else have no reach.
"""

COINCIDENT = 1e-12
"""Places that are apart by less, relative to their coordinates, are one: rounding of double precision."""
RESOLVED = 1e-4
"""Gaps of joints are computed to about 1e-15 of the coordinates, and closed to 1e-11 of the size of the machine."""


def extents(scene: Scene) -> dict[str, Array]:
    """Largest distance [m] between two places of each body that have a name, a joint or a marker; () or (lanes,)."""
    sides = [side for joint in scene.joints.values() for side in places(joint)]
    attached = [*sides, *scene.markers.values()]
    return {
        name: _widest([*(scene.location(at) for at in attached if at.body == name), *body.points.values()])
        for name, body in scene.bodies.items()
    }


def size(scene: Scene) -> Array:
    """All undeformed bodies stretched out in a line [m], (lanes,) where their lengths differ between lanes."""
    return np.asarray(sum(extents(scene).values()))


def span(scene: Scene) -> float:
    """A length that displacements are compared with [m]; one metre where all places coincide.

    All bodies stretched out in a line, or the distance between places on the ground and stated positions if it is more;
    where that is small beside their coordinates, so much of these that gaps can be computed relative to it.
    """
    joined = [side for joint in scene.joints.values() for side in places(joint)]
    loaded = [side for load in scene.loads.values() for side in sides(load).values()]
    fixed = [scene.location(side) for side in (*joined, *loaded) if side.body == GROUND]
    fixed += [start.position for start in scene.initial.values() if start.position is not None]
    found, coordinate = float(max(np.max(size(scene)), np.max(_widest(fixed)))), _largest(fixed)
    return max(found, RESOLVED * coordinate) if found > COINCIDENT * coordinate else 1.0


def _largest(found: list[Any]) -> float:
    """The largest coordinate of some places [m]."""
    return max((float(np.max(np.abs(number))) for place in found for number in place), default=0.0)


def _widest(found: list[Any]) -> Array:
    """The largest distance between two of these places, () or (lanes,)."""
    longest = np.zeros(())
    for one, other in combinations(found, 2):
        away = (np.subtract(a, b) for a, b in zip_longest(one, other, fillvalue=0.0))
        longest = np.maximum(longest, reduce(np.hypot, away))
    return longest


def reach(scene: Scene, energy: Array) -> Array:
    """Reach of a machine [m] whose kinetic and elastic energy is at most `energy` [J], of its shape, (lanes,).

    Infinite for machines with bodies that only sliders, springs or nothing at all hold to fixed ground.
    """
    if not tethered(scene):
        return np.full(np.shape(energy), np.inf)
    return size(scene) + stretch(scene, energy)


def stretch(scene: Scene, energy: Array) -> Array:
    """The length [m] by which the flexible rods together are longer at most, where their energy is so large [J]."""
    total = np.zeros(np.shape(energy))
    for rod in scene.bodies.values():
        if isinstance(rod, Rod) and rod.element != "rigid":
            # The thinnest section bounds the stiffness of a tapered rod.
            strain = np.sqrt(2 * energy / (rod.modulus * rod.thinnest.area * rod.length))
            total = total + rod.length * np.minimum(strain, BREAKS)
    return total


def tethered(scene: Scene) -> bool:
    """Return whether revolute joints and welds tie every body to fixed ground."""
    held, frontier = {GROUND}, [GROUND]
    tethers = _tethers(scene)
    while frontier:
        here = frontier.pop()
        for tether in tethers:
            if here in (ends := {tether.first.body, tether.second.body}):
                frontier += (new := ends - held)
                held |= new
    return not scene.ground_points and held >= set(scene.bodies)


def _tethers(scene: Scene) -> list[Meet]:
    """Return the conditions of joints that connect points."""
    return [condition for _, condition in of_scene(scene) if isinstance(condition, Meet)]


def anchors(scene: Scene) -> Array:
    """Places on the ground that joints hold, or its origin if there are none [m], (anchors, d, lanes or 1)."""
    sides = (side for tether in _tethers(scene) for side in (tether.first, tether.second))
    found = [plane.vector(*scene.location(side)) for side in sides if side.body == GROUND]
    found = found or [plane.vector(*(0.0,) * scene.dimensions)]
    lanes = max(place.shape[1] for place in found)
    return np.stack([np.broadcast_to(place, (scene.dimensions, lanes)) for place in found])


def distance_to_ground(scene: Scene, points: Array) -> Array:
    """Distance of every marker to the nearest anchor on the ground [m], (samples, markers, lanes).

    points: (samples, markers, d, lanes).
    """
    distances = [np.linalg.norm(points - anchor, axis=2) for anchor in anchors(scene)]
    return np.asarray(np.min(distances, axis=0))
