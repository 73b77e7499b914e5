"""The repaired swarm looks around for a few iterations, Levenberg-Marquardt ends what its best fish began."""

from __future__ import annotations

import numpy as np

from shoal.identification.forward import ForwardModel, Progress
from shoal.identification.methods.lanes import DESCENTS, best_apart, descend_many
from shoal.identification.methods.outcome import Outcome, concluded
from shoal.identification.methods.swarms import school
from shoal.swarm import Iafsa

ITERATIONS = 15
"""Iterations of the swarm before the descents, which end the search: enough to find their basins."""


def hybrid(model: ForwardModel, rng: np.random.Generator, progress: Progress) -> Outcome:
    """IAFSA without seeds for ITERATIONS, then descents from the best distinct places that its fish remember."""
    optimizer = Iafsa(lower=model.lower, upper=model.upper)
    state, rows = school(model, optimizer, rng, progress, ITERATIONS)
    starts = best_apart(model, optimizer.box.from_unit(state.memory), state.memory_values, DESCENTS)
    return concluded(model, descend_many(model, starts, progress), rows)
