"""Explicit Runge-Kutta methods as data; one compiled loop runs them all."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from shoal.engines.tree.tree import Array
from shoal.mechanics.integrators.dop853_tableau import ERROR_3, ERROR_5, STAGES, WEIGHTS


class Tableau(NamedTuple):
    """y1 = y0 + h sum b_i k_i with k_i = f(y0 + h sum a_ij k_j).

    error_5, error_3: weights of the stages and of f(y1) in the two error estimates of Hairer and Wanner,
        (stages + 1,); zero where the method has none
    order: in time; error_order: of the estimate, 0 for methods of fixed step
    """

    a: Array
    b: Array
    error_5: Array
    error_3: Array
    order: int
    error_order: int


RK4 = Tableau(
    np.array([[0.0, 0.0, 0.0, 0.0], [0.5, 0.0, 0.0, 0.0], [0.0, 0.5, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]]),
    np.array([1.0, 2.0, 2.0, 1.0]) / 6.0,
    np.zeros(5),
    np.zeros(5),
    4,
    0,
)
"""The classical method of order 4."""

DOPRI853 = Tableau(
    np.ascontiguousarray(WEIGHTS[:STAGES, :STAGES]),
    np.ascontiguousarray(WEIGHTS[STAGES, :STAGES]),
    ERROR_5,
    ERROR_3,
    8,
    7,
)
"""Dormand and Prince of order 8 with error control (Hairer, Norsett, Wanner 1993, section II.10)."""
