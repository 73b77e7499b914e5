"""References that were printed: Andrews' squeezing mechanism of the IVP test set."""

from __future__ import annotations

import numpy as np
from shoal.trajectory import Array

from shoal_validation.problems.contract import Reference

_CRANK = 7.0e-3
_ANGLE = 15.81077119629904


def squeezer(times: Array) -> Reference:
    """End of the crank at 0.03 s (Mazzia and Magherini, Test set for IVP solvers, 2008: q1 = 15.81077119629904)."""
    if times.tolist() != [0.03]:
        raise ValueError("the test set prints the angles at 0.03 s only")
    points = _CRANK * np.array([[np.cos(_ANGLE), np.sin(_ANGLE)]])
    return Reference(points, "IVP test set, q1(0.03 s)", 1e-13)
