"""What the joints of a machine exert along its motion."""

from __future__ import annotations

import numpy as np

from shoal.mechanics import plane
from shoal.mechanics.analysis import load_cells
from shoal.mechanics.analysis.felt import Felt
from shoal.mechanics.analysis.free_bodies import FreeBodies
from shoal.mechanics.analysis.joint_reactions import JointReaction, reactions_of
from shoal.mechanics.analysis.load_cells import Balance, Reaction
from shoal.mechanics.analysis.load_cells_in_space import SpatialBalance
from shoal.scene.joints import DrivenAngle


def reactions_along(felt: Felt, names: tuple[str, ...]) -> dict[str, Reaction]:
    """What some joints exert; the model has one lane. Raises InputError if the machine cannot tell them apart.

    In space the torque is a vector, (samples, 3).
    """
    model = felt.evaluator.model
    if not model.flexible and not model.modal:
        kind = Balance if model.dimensions == plane.DIMENSIONS else SpatialBalance
        return load_cells.reactions_along(felt, names, kind)
    bodies = FreeBodies(felt.evaluator, float(felt.times[-1]))
    found: dict[str, list[JointReaction]] = {name: [] for name in names}
    for q, v, a, turns, t in zip(felt.q, felt.v, felt.a, felt.turns, felt.times.tolist(), strict=True):
        felt.evaluator.turns = turns
        told = reactions_of(felt.evaluator, q, v, a, t, bodies=bodies, naming=False)
        for name in names:
            if not told.joints[name].unique:
                raise load_cells.not_unique(felt.scene.name, name)
            found[name].append(told.joints[name])
    return {name: _reaction(felt, each) for name, each in found.items()}


def _reaction(felt: Felt, each: list[JointReaction]) -> Reaction:
    """The reaction of a joint at all samples."""
    force, torque = np.array([one.force for one in each]), np.array([one.torque for one in each])
    if not isinstance(felt.scene.joints[each[0].joint], DrivenAngle) or torque.ndim == 1:
        return Reaction(force, torque)
    return Reaction(force, torque, np.array([next(iter(one.components.values())) for one in each]))
