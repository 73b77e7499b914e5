"""Robust losses, which let outliers weigh less (Huber, soft L1, Cauchy)."""

from __future__ import annotations

import numpy as np

from shoal.identification.conventions import PRECISION
from shoal.trajectory import Array

_TUNING = {"huber": 1.345, "soft-l1": 1.345, "cauchy": 2.385}
"""Of the noise, where a deviation begins to weigh less: 95 % efficiency for normal noise (Huber 1981; Zhang 1997)."""


def flatten(residuals: Array, loss: str, noise: Array) -> Array:
    """Residuals whose squares are the losses of the given ones, in any shape; noise: their standard deviation.

    With z = (r / s)^2: huber: z below 1, else 2 sqrt(z) - 1; soft-l1: 2 (sqrt(1 + z) - 1); cauchy: log(1 + z).
    """
    scale = _TUNING[loss] * noise
    z = (residuals / scale) ** 2
    match loss:
        case "huber":
            rho = np.where(z <= 1.0, z, 2.0 * np.sqrt(z) - 1.0)
        case "soft-l1":
            rho = 2.0 * z / (1.0 + np.sqrt(1.0 + z))
        case "cauchy":
            rho = np.log1p(z)
        case _:
            raise NotImplementedError(f"loss: {loss} has no residuals")
    flat: Array = np.sign(residuals) * scale * np.sqrt(rho)
    return flat


def steepness(flat: Array, loss: str, noise: Array) -> Array:
    """By what rows of the Jacobian of flattened residuals are too small for a Gauss-Newton step, in their shape.

    The square root of a loss that grows more slowly than a square bends back, so that Gauss-Newton on it goes up to
    twice too far. With the Jacobian times this and the residual by it, gradients stay and the curvature is that of
    iteratively reweighted least squares (Holland and Welsch 1977), which does not. flat: as `flatten` gives them
    """
    rho = (flat / (_TUNING[loss] * noise)) ** 2
    match loss:
        case "huber":
            beyond = np.maximum(rho, 1.0)
            found = np.sqrt(2.0 * beyond / (1.0 + beyond))
        case "soft-l1":
            found = np.sqrt((1.0 + rho / 2.0) / (1.0 + rho / 4.0))
        case "cauchy":
            found = np.sqrt(np.maximum(rho, PRECISION) / -np.expm1(-np.maximum(rho, PRECISION)))
        case _:
            raise NotImplementedError(f"loss: {loss} has no steepness")
    steeper: Array = found
    return steeper
