"""Damped Newton and Gauss-Newton method for systems of equations.

Deuflhard, Newton Methods for Nonlinear Problems, Springer 2011, chapters 2 and 4. The method is judged by its
corrections, in a unit of the caller, and not by residuals, whose units differ (affine invariance). A correction
estimates the error of the point before it. As corrections of a converging iteration shrink ever faster, one that is
small and does not shrink is round-off of the residual, magnified by the inverse of the Jacobian: no later one would be
better. Where there are more equations than unknowns corrections vanish at a least-squares minimum as well, so that the
residual has to be checked at the end.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Generic, NamedTuple, TypeVar

import numpy as np

from shoal.mechanics.numerics.tile import Array

P = TypeVar("P")

CONTRACTION = 0.3
"""Small corrections that shrink to a larger part than this have met round-off; beyond a half Newton's method does not
converge from here (Deuflhard, section 2.1.1)."""
SINGULAR = "the Jacobian is singular"
DIVERGES = "Newton's method does not converge"


class Root(NamedTuple, Generic[P]):
    """End of an iteration: the last point, and the size of the last correction. message: why it has not converged."""

    point: P
    converged: bool
    iterations: int
    correction: float
    message: str = ""


def newton(
    correct: Callable[[P], tuple[Array, float]],
    point: P,
    *,
    close: float,
    round_off: float = 0.0,
    longest: float = np.inf,
    divergent: float = np.inf,
    most: int = 20,
    move: Callable[[P, Array], P] = operator.add,
) -> Root[P]:
    """Find a root near a point by corrections, -J(x)^+ r(x), until these are small.

    correct: the correction at a point and its size, in the unit of all limits, 0 where the residual is round-off;
    close: size below which it has converged; round_off: size below which corrections that do not shrink are round-off,
    and converged as well; longest: size to which longer corrections are cut (damping); divergent: size from which the
    iteration is given up; most: iterations; move: adds a correction to a point
    """
    last = np.inf
    for iteration in range(1, most + 1):
        try:
            correction, size = correct(point)
        except np.linalg.LinAlgError:
            return Root(point, False, iteration, last, SINGULAR)
        point = move(point, correction if size <= longest else correction * (longest / size))
        if not size < divergent:
            return Root(point, False, iteration, size, DIVERGES)
        if size <= close or CONTRACTION * last < size < round_off:
            return Root(point, True, iteration, size)
        last = size
    return Root(point, False, most, last, DIVERGES)
