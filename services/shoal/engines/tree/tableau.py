"""Explicit Runge-Kutta methods as data; one compiled loop runs them all."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.integrate import DOP853

from shoal.engines.tree.tree import Array


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

_STAGES = len(DOP853.B)
DOPRI853 = Tableau(
    np.ascontiguousarray(DOP853.A[:_STAGES, :_STAGES], dtype=float),
    np.ascontiguousarray(DOP853.B, dtype=float),
    np.ascontiguousarray(DOP853.E5, dtype=float),
    np.ascontiguousarray(DOP853.E3, dtype=float),
    8,
    7,
)
"""Dormand and Prince of order 8 with error control (Hairer, Norsett, Wanner 1993, section II.10), from scipy."""
