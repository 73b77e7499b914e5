"""How deviations count: losses that let outliers weigh less, and the noise of a recording without any model."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtri

from shoal.identification.measurement import Recording
from shoal.trajectory import Array

_TUNING = {"huber": 1.345, "soft-l1": 1.345, "cauchy": 2.385}
"""Of the noise, where a deviation begins to weigh less: 95 % efficiency for normal noise (Huber 1981; Zhang 1997)."""
_ORDER = 4
_SMALL = 1e-12


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
        case _:
            rho = np.log1p(z)
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
        case _:
            found = np.sqrt(np.maximum(rho, _SMALL) / -np.expm1(-np.maximum(rho, _SMALL)))
    steeper: Array = found
    return steeper


def noise_of(recording: Recording) -> Array:
    """Standard deviation of the noise of each channel, (channels,): as stated, else by differences of the data.

    A smooth motion has small fourth differences, white noise has large ones: their median tells its size, and outliers
    do not change it. Motion that the sampling does not resolve counts as noise.
    """
    estimated = np.array([differences(recording.values[:, k]) for k in range(len(recording.channels))])
    return np.where(np.isfinite(recording.noise), recording.noise, estimated)


def differences(signal: Array) -> float:
    """Standard deviation of white noise on a smooth signal, from the median of its fourth differences."""
    known = signal[np.isfinite(signal)]
    if len(known) < _ORDER + 2:
        return float("nan")
    jumps = np.diff(known, _ORDER)
    # Of white noise of variance one: the sum of the squared binomial coefficients 1 4 6 4 1.
    size = float(np.median(np.abs(jumps)) / ndtri(0.75) / np.sqrt(70.0))
    return max(size, 1e-12 * float(np.ptp(known)), 1e-300)
