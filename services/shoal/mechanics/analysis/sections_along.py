"""Section forces of a flexible rod at one place, along a motion."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from shoal.errors import InputError
from shoal.mechanics.analysis.felt import Felt
from shoal.mechanics.analysis.free_bodies import FreeBodies
from shoal.mechanics.analysis.sections import EndForces, SpatialSections, sections
from shoal.mechanics.assembly.groups import place_of
from shoal.mechanics.numerics.tile import Array
from shoal.scene import Attachment, Rod


class SectionForces(NamedTuple):
    """Normal force and shear force [N], bending moment and torsional moment [N m], (samples,) each.

    In the plane with the signs of `EndForces`, and without torsion; in space shear force and bending moment are sizes.
    """

    normal: Array
    shear: Array
    moment: Array
    torsion: Array


def section_along(felt: Felt, at: Attachment) -> SectionForces:
    """Return the section forces at a point of a rod, at a node just beyond it; the model has one lane.

    Between the ends of an element they are interpolated linearly. Raises InputError.
    """
    name, place = place_of(felt.scene, at)
    rod = felt.scene.bodies[name]
    assert isinstance(rod, Rod)
    share = float(place[0]) / float(rod.length) * rod.elements
    number = min(int(share + 1e-9), rod.elements - 1)
    x, ends = share - number, slice(2 * number, 2 * number + 2)
    bodies = FreeBodies(felt.evaluator, float(felt.times[-1]))
    rows = []
    for k, (q, v, a, t) in enumerate(zip(felt.q, felt.v, felt.a, felt.times.tolist(), strict=True)):
        felt.evaluator.turns = felt.turns[k]
        bodies.follow(felt.strengths[k])
        both = _at_ends(sections(felt.evaluator, q, v, a, t, name, bodies=bodies), ends)
        rows.append((1 - x) * both[:, 0] + x * both[:, 1])
    found = SectionForces(*np.array(rows).T)
    if np.isnan(found.normal).all():
        raise InputError(
            f"section forces of {name} at {float(place[0]):g} m are not known: a load or a joint acts between the "
            "nodes of that element; choose bodies."
            f"{name}.elements so that it acts at a node"
        )
    return found


def _at_ends(found: EndForces | SpatialSections, ends: slice) -> Array:
    """Return normal and shear force, bending and torsional moment at both ends of an element, (4, 2)."""
    if isinstance(found, EndForces):
        none = np.zeros(2)
        return np.array([found.normal[ends], found.shear[ends], found.moment[ends], none])
    tangent, force, moment = found.tangent[ends], found.force[ends], found.moment[ends]
    normal, torsion = found.normal[ends], found.torque[ends]
    shear, bending = force - normal[:, None] * tangent, moment - torsion[:, None] * tangent
    return np.array([normal, np.linalg.norm(shear, axis=1), np.linalg.norm(bending, axis=1), torsion])
