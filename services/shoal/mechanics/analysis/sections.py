"""Normal force, shear force and bending moment along a flexible rod, from the balance of its elements.

What the neighbours exert on the two ends of an element is M_e a - Q_e, its inertia less its elastic, viscous and
distributed forces. Its part on a nodal position is a force, and that on the nodal vectors d does the work of the
moment sum d x f in a turn of the node. Unlike forces from the strains at a place, these are in exact balance with the
loads on any mesh.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from shoal.errors import InputError
from shoal.mechanics import plane
from shoal.mechanics import rotation as turns
from shoal.mechanics.analysis.evaluate import Evaluator
from shoal.mechanics.analysis.free_bodies import FreeBodies
from shoal.mechanics.frames import BeamFrame
from shoal.mechanics.numerics.tile import Array
from shoal.scene import Attachment, DistributedForce, Rod, Scene
from shoal.scene.dimensions import padded
from shoal.scene.joints import places, sides


class EndForces(NamedTuple):
    """Section forces at both ends of every element of a rod, in order, (2 elements,) each.

    s: arc length [m]. normal [N]: tension is positive. shear [N]: of the part beyond on the part before, positive
    along the normal to the left of the axis. moment [N m]: positive where it bends the rod to the left. nan for an
    element on which a point load or a joint acts between its nodes.
    """

    s: Array
    normal: Array
    shear: Array
    moment: Array


class SpatialSections(NamedTuple):
    """The same in space: what the part beyond exerts on the part before, along the axes of the ground.

    s: arc length [m], (2 elements,). tangent: of the axis, of unit length; force [N]; moment [N m], of which a cable
    has none about its tangent, (2 elements, 3) each.
    """

    s: Array
    tangent: Array
    force: Array
    moment: Array

    @property
    def normal(self) -> Array:
        """Normal force [N], positive in tension."""
        return np.asarray(np.sum(self.tangent * self.force, axis=1))

    @property
    def torque(self) -> Array:
        """Torsional moment [N m]."""
        return np.asarray(np.sum(self.tangent * self.moment, axis=1))


def sections(
    evaluator: Evaluator, q: Array, v: Array, a: Array, t: float, rod: str, *, bodies: FreeBodies | None = None
) -> EndForces | SpatialSections:
    """Section forces of a flexible rod at a state (coordinates, rates, accelerations). Raises InputError."""
    scene = evaluator.model.scene
    body = scene.bodies.get(rod)
    if not isinstance(body, Rod) or body.element == "rigid":
        raise InputError(f"{rod}: section forces need a flexible rod of the scene")
    if body.element == "modal":
        raise InputError(f"bodies.{rod}.element: section forces are those of elements; use ancf-cable instead of modal")
    bodies = bodies or FreeBodies(evaluator, t)
    at, rate, change = bodies.state(q, v, a)
    frame = bodies.placement.frames[rod]
    assert isinstance(frame, BeamFrame)
    element = frame.element
    length = float(frame.element_length)
    broken = _interrupted(scene, rod, body)
    load = np.array(padded(scene.gravity, scene.dimensions))
    along = [(name, d) for name, d in scene.loads.items() if isinstance(d, DistributedForce) and d.body == rod]
    cross = plane.cross if scene.dimensions == plane.DIMENSIONS else turns.cross
    arcs: list[float] = []
    tangents, forces, moments = list[Array](), list[Array](), list[Array]()
    for number, elastic in enumerate(bodies.evaluator.element_forces(at, rate, rod)):
        density, section = body.masses_at((number + 0.5) / body.elements)
        own = np.array([vector.own for vector in frame.of_element(number)])
        inertia = np.array(element.mass(density, section, length)) @ change[own]
        weight = np.outer(element.weight(density * section.area, length), load)
        unit = np.array(element.weight(1.0, length))
        for name, one in along:
            force, field = np.array(padded(one.force, scene.dimensions)), f"loads.{name}.scale"
            strength = bodies.strengths[field] if field in bodies.strengths else float(one.scale(np.array(t)))
            weight = weight + np.outer(unit, force) * strength
        ends = inertia - elastic[own] - weight
        order = len(ends) // 2
        for end in range(2):
            part, side = slice(end * order, (end + 1) * order), 1.0 if end == 1 else -1.0
            s = (number + end) * length
            tangent = frame.direction((s,) + (0.0,) * (scene.dimensions - 1)).at(at)
            known = side if number not in broken else np.nan
            arcs.append(s)
            tangents.append(tangent / np.linalg.norm(tangent))
            forces.append(known * ends[part][0])
            moments.append(known * np.sum(cross(at[own][part][1:].T, ends[part][1:].T), axis=-1))
    found = SpatialSections(*(np.array(one) for one in (arcs, tangents, forces, moments)))
    if scene.dimensions != plane.DIMENSIONS:
        return found
    return EndForces(found.s, found.normal, plane.cross(found.tangent.T, found.force.T), found.moment)


def _interrupted(scene: Scene, name: str, rod: Rod) -> set[int]:
    """Elements with a load or a joint between their nodes."""
    attached: list[Attachment] = [side for joint in scene.joints.values() for side in places(joint)]
    attached += [side for load in scene.loads.values() for side in sides(load).values()]
    found = set()
    for side in attached:
        if side.body == name:
            place = scene.location(side)[0] / rod.length * rod.elements
            if abs(place - round(place)) > 1e-9:
                found.add(int(place))
    return found
