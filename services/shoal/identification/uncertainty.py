"""How well the parameters are known: covariance, autocorrelation, rank, and the model's own error."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from shoal.trajectory import Array

RANK_TOLERANCE = 1e-9
"""Singular values below this fraction of the largest (columns scaled to the parameters' size) carry nothing, and so do
those along which a parameter could change by its own size within the noise."""


@dataclass(frozen=True)
class Linearisation:
    """Covariance (p, p), directions the data do not fix (p, k) in scaled parameters, pseudo-inverse (p, m)."""

    covariance: Array
    unknown: Array
    pseudo_inverse: Array
    scale: Array


def linearise(jacobian: Array, residual: Array, scale: Array, channels: int) -> Linearisation:
    """Uncertainty from the Jacobian (m, p) and residuals (m,) at the optimum.

    scale: size of each parameter, (p,). Residuals that are autocorrelated carry less information than
    their number says: the covariance grows by (1 + rho)/(1 - rho), rho being their lag-1 correlation
    within a channel (effective sample size of an AR(1) process).
    """
    left, singular, right = np.linalg.svd(jacobian * scale, full_matrices=False)
    size = float(np.sqrt(residual @ residual / max(1, residual.size - len(singular))))
    known = singular > max(RANK_TOLERANCE * singular[0], size, 1e-300)
    inverse = np.where(known, 1.0 / np.where(known, singular, 1.0), 0.0)
    pseudo_inverse = scale[:, None] * (right.T * inverse) @ left.T
    freedom = max(1, residual.size - int(known.sum()))
    variance = float(residual @ residual) / freedom
    rho = autocorrelation(residual, channels)
    inflation = (1 + max(rho, 0.0)) / (1 - min(max(rho, 0.0), 0.999))
    covariance = variance * inflation * (scale[:, None] * (right.T * inverse**2) @ right * scale)
    return Linearisation(covariance, right[~known].T, pseudo_inverse, scale)


def autocorrelation(residual: Array, channels: int) -> float:
    """Lag-1 autocorrelation of residuals (samples * channels,), pooled over the channels."""
    table = residual.reshape(-1, channels)
    power = float(np.sum(table**2))
    return float(np.sum(table[1:] * table[:-1]) / power) if power > 0 else 0.0


def spread(function: Callable[[Array], float], point: Array, at: Linearisation) -> tuple[float, bool]:
    """Standard deviation of a function of the parameters, and whether the data fix it."""
    steps = 1e-6 * at.scale
    gradient = np.array([(function(point + step) - function(point - step)) for step in np.diag(steps)]) / (2 * steps)
    scaled = gradient * at.scale
    hidden = np.linalg.norm(scaled @ at.unknown) if at.unknown.size else 0.0
    fixed = bool(hidden <= 1e-3 * max(float(np.linalg.norm(scaled)), 1e-300))
    variance = float(gradient @ at.covariance @ gradient)
    return float(np.sqrt(max(0.0, variance))), fixed


def combinations(unknown: Array, names: tuple[str, ...]) -> list[str]:
    """The directions that the data do not fix, in words: relative changes that leave the motion as it is."""
    sentences = []
    for direction in _sparse_basis(unknown).T:
        largest = direction / direction[np.abs(direction).argmax()]
        parts = [f"{names[k]} {value:+.2g}" for k, value in enumerate(largest) if abs(value) > 1e-2]
        sentences.append("unchanged motion under relative changes of " + ", ".join(parts))
    return sentences


def _sparse_basis(unknown: Array) -> Array:
    """The same space with as few parameters per direction as elimination gives."""
    basis = unknown.copy()
    taken: list[int] = []
    for k in range(basis.shape[1]):
        free = [i for i in range(len(basis)) if i not in taken]
        row = free[int(np.abs(basis[free, k]).argmax())]
        taken.append(row)
        basis[:, k] /= basis[row, k]
        for other in range(basis.shape[1]):
            if other != k:
                basis[:, other] -= basis[row, other] * basis[:, k]
    return basis
