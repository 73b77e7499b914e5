"""Levenberg-Marquardt method for many nonlinear least-squares problems at once.

Moré, The Levenberg-Marquardt algorithm: implementation and theory, Lecture Notes in Mathematics 630, 1978; Madsen,
Nielsen and Tingleff, Methods for non-linear least squares problems, 2004.

A search ends where its residual is round-off, or where its linear model promises to lower the sum of squares by no
more than a given part. Unlike the length of a step or a limit of the damping this does not depend on units, and it
holds at a minimum of any residual. It ends a search that no step leads down as well, as rejected steps are
damped until they promise nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from shoal.mechanics.numerics.tile import Array, Index

DAMPING = 1e-3
"""At the start; divided and multiplied by ten where a step is accepted and rejected (Marquardt 1963)."""
HALVED = 0.5
"""A residual near round-off that a step does not lower to this part is round-off: convergence would be quadratic."""

Evaluate = Callable[[Array, Index], tuple[Array, Array]]
"""Residuals (searches, rows) and Jacobians (searches, rows, unknowns) at points of searches of these numbers."""
Solve = Callable[[Array, Array, Array, Index], Array]
"""Damped steps (searches, unknowns) by residuals, Jacobians, damping (searches,), and numbers of the searches."""


class Minima(NamedTuple):
    """Ends of all searches: points (searches, unknowns), residuals (searches, rows), and their norms (searches,).

    Those of a search that could not begin are not finite.
    """

    points: Array
    residuals: Array
    norms: Array


def levenberg_marquardt(
    evaluate: Evaluate,
    solve: Solve,
    points: Array,
    *,
    gain: float,
    close: float = 0.0,
    round_off: float = 0.0,
    most: int,
    move: Callable[[Array, Array], Array] = np.add,
) -> Minima:
    """Minimise the sums of squared residuals from points, (searches, unknowns), each on its own.

    gain: part of the sum of squares below which a promised reduction ends a search; close: norm of the residual that
    needs no further step; round_off: norm below which a step that does not halve it is the last; most: iterations;
    move: takes steps from points, also where these
    are no vectors or have to stay within bounds
    """
    points, every = points.copy(), np.arange(len(points))
    residuals, jacobians = evaluate(points, every)
    norms, damping = np.linalg.norm(residuals, axis=1), np.full(len(points), DAMPING)
    active = every[np.isfinite(norms) & (norms > close)]
    for _ in range(most):
        residual, jacobian = residuals[active], jacobians[active]
        step = solve(residual, jacobian, damping[active], active)
        model = residual + np.einsum("srk,sk->sr", jacobian, step)
        hopeful = np.sum(model**2, axis=1) < (1.0 - gain) * norms[active] ** 2
        active, step = active[hopeful], step[hopeful]
        if not active.size:
            break
        trial = move(points[active], step)
        residual, jacobian = evaluate(trial, active)
        norm, before = np.linalg.norm(residual, axis=1), norms[active]
        better = norm < before
        damping[active] *= np.where(better, 0.1, 10.0)
        taken = active[better]
        points[taken], residuals[taken], jacobians[taken] = trial[better], residual[better], jacobian[better]
        norms[taken] = norm[better]
        active = active[(norms[active] > close) & ((before >= round_off) | (norm < HALVED * before))]
    return Minima(points, residuals, norms)
