"""Rank tolerance against the distance from the singular position, on the parallelogram with cranks of 1 and 3 kg."""

from __future__ import annotations

from shoal_validation.stability.contract import Axis, StabilityMap
from shoal_validation.stability.methods import ADAPTIVE, FIXED_STEP
from shoal_validation.stability.singular import STEP, machine

MOST = 20_000
"""Steps of an adaptive method, which otherwise creeps where regular positions count as singular."""

MAP = StabilityMap(
    "rank-tolerance",
    "How near must a position be to count as singular?",
    "From 1e-6 to 1e-3 only energy-momentum depends on it; the default is 1e-5. Smaller ones let adaptive methods, "
    "whose steps land anywhere, take the wrong branch with clean energy. Larger ones take regular positions for "
    "singular: joints drift, or the method creeps. Generalized-alpha is inaccurate by its step alone.",
    Axis("distance from the singular position", "rad", (0.0, 1e-10, 1e-8, 1e-6, 1e-5, 1e-4, 1e-2)),
    Axis("rank tolerance", "", (1e-12, 1e-10, 1e-8, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2)),
    (*FIXED_STEP, *ADAPTIVE),
    lambda distance, _: machine(distance, 3.0, accuracy=1e-5),
    lambda _, tolerance: {"solver.rank_tolerance": tolerance, "solver.step": STEP, "solver.max_steps": MOST},
)
