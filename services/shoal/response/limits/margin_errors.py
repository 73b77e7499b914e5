"""Errors of the quantity of a limit: how far the second runs of a verified run are from it, over time."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from shoal.engines.deviation import Deviation, by_source
from shoal.engines.verification import Verification
from shoal.error_budget import ErrorBudget
from shoal.response.limits.limit import Limit
from shoal.scene import Scene
from shoal.trajectory import Array, Trajectory


@dataclass(frozen=True, eq=False)
class MarginErrors:
    """Known errors of the margins of one run.

    budget: the largest over time, by source; over_time: their sum, (instants,)
    """

    budget: ErrorBudget
    over_time: Array = field(default_factory=lambda: np.zeros(1))

    @property
    def unknown(self) -> bool:
        """Return whether they were looked for, and one could not be estimated."""
        return bool(self.budget.unknown)


def margin_errors(limit: Limit, verification: Verification | None, instants: int) -> MarginErrors:
    """Return the errors of a limit's quantity at the last instants of a run; none are known of one that failed."""
    if verification is None:
        return MarginErrors(ErrorBudget({}, limit.unit), np.zeros(instants))
    bending = any(any(one.scenes[0].flexible_rods) for one in verification.deviations)
    found = by_source(verification.deviations, lambda one: _error(limit, one, bending)[-instants:])
    largest: dict[str, float | None] = {source: float(error.max()) for source, error in found.items()}
    lacking = dict.fromkeys(verification.errors.unknown)
    over_time = sum(found.values(), np.zeros(instants))
    return MarginErrors(ErrorBudget({**lacking, **largest}, limit.unit), over_time)


def _error(limit: Limit, deviation: Deviation, bending: bool) -> Array:
    """Return the error of one source, (instants,). bending: whether the machine has flexible rods"""
    motion = deviation.one
    columns = (*motion.axes, "angle") if len(motion.axes) == 2 else tuple(motion.axes)
    if limit.quantity in columns:
        column = columns.index(limit.quantity)
        return np.asarray(deviation.of_markers()[:, motion.markers.index(limit.place), column])
    # The quantity itself, as the margins of its absolute value hide a change of sign.
    plain = replace(limit, absolute=False, above=True, bound=0.0)

    def quantity(run: Trajectory, scene: Scene) -> Array:
        return np.asarray(plain.margins(run, scene, {})[0])

    if deviation.source == "theory" and limit.is_dynamic and bending:
        # Rigid rods tell no forces of flexible ones: what is left out is taken as the same share of the quantity.
        if not any(deviation.scenes[0].flexible_rods):
            return np.zeros(len(motion.times))
        return np.asarray(deviation.factor * np.maximum.accumulate(np.abs(quantity(motion, deviation.scenes[0]))))
    return deviation.of(quantity)
