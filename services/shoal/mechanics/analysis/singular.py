"""Singular places: where a machine has more small motions than beside, as where two branches of its motion cross.

The rank of the constraints falls there. A machine that holds itself more than it needs to lacks rank as well, but
beside the place, too.
"""

from __future__ import annotations

import numpy as np

from shoal.mechanics.analysis.evaluate import Evaluator
from shoal.mechanics.analysis.freedom import Freedom, Metric
from shoal.mechanics.analysis.sparse_freedom import SparseFreedom, SparseMetric
from shoal.mechanics.numerics.newton import newton
from shoal.mechanics.numerics.tile import Array
from shoal.mechanics.reach import span

STEPS = (0.05, 0.005, 0.0005)
"""How far beside [of a unit vector, or m; of the size of a smaller machine], less where joints do not close there."""
CLOSED = 1e-9
"""Joints that gape by less are closed."""
CORRECTED = 1e-11
"""Corrections [m] below this are the last: squared, as the next one of Newton's method, they are round-off."""
SHARE = 1e-6
"""A constraint whose part in what depends on others (of unit size) is less does not."""


def nearby_freedom(
    evaluator: Evaluator, metric: Metric | SparseMetric, freedom: Freedom | SparseFreedom, q: Array, t: float
) -> Freedom | SparseFreedom:
    """Return the tangent space at a state near q that satisfies the constraints; `freedom`, at q, if that is zero."""
    if not freedom.degrees:
        return freedom
    step = freedom.anywhere()
    step *= min(1.0, span(evaluator.model.scene)) / np.max(np.abs(step))

    def correct(near: Array) -> tuple[Array, float]:
        evaluation = evaluator.at(near, t=t)
        back = metric.freedom(evaluation.jacobian).shift(-evaluation.gap)
        return back, float(np.max(np.abs(back), initial=0.0))

    for length in STEPS:
        evaluation = evaluator.at(newton(correct, q + length * step, close=CORRECTED).point, t=t)
        if np.max(np.abs(evaluation.gap)) < CLOSED:
            break
    return metric.freedom(evaluation.jacobian)


def crossing(
    evaluator: Evaluator, metric: Metric | SparseMetric, freedom: Freedom | SparseFreedom, q: Array, t: float
) -> tuple[str, ...]:
    """The constraints that depend on others at q and not beside it, by name; none where q is not singular."""
    if not freedom.dependent.shape[1]:
        return ()
    near = nearby_freedom(evaluator, metric, freedom, q, t)
    if near.dependent.shape[1] >= freedom.dependent.shape[1]:
        return ()
    parts = np.max(np.abs(freedom.dependent), axis=1)
    names = zip(evaluator.model.constraint_names, parts, strict=False)
    return tuple(dict.fromkeys(name for name, part in names if part > SHARE))
