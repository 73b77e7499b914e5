"""Forces and torques in every joint of a machine in motion."""

from __future__ import annotations

from collections.abc import Sequence

from shoal.mechanics.analysis.free_bodies import FreeBodies
from shoal.mechanics.analysis.joint_reactions import Reactions, reactions_of
from shoal.mechanics.analysis.motion_state import states
from shoal.scene import Scene


def reactions(scene: Scene, times: Sequence[float] = (0.0,)) -> list[Reactions]:
    """Reactions in the motion of a scene at requested times [s]. Raises InputError, ComputationError."""
    evaluator, found = states(scene, times)
    bodies = FreeBodies(evaluator, max(times))
    result = []
    for state in found:
        evaluator.turns = state.turns
        result.append(reactions_of(evaluator, state.q, state.v, state.a, state.time, bodies=bodies))
    return result
