"""Linearised uncertainty of parameters: covariance with correlated noise, intervals, and open directions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from shoal.identification.conventions import DIFFERENCE, HIDDEN, LEVEL, PRECISION
from shoal.identification.uncertainty.chances import student_above
from shoal.identification.uncertainty.covariance import Block, Noise, correlate, estimate_noise
from shoal.trajectory import Array

_FOLLOWED = 1e-8
"""Likewise of directions that a test takes for followed."""
ABSORBED = 4.0
"""Times the part of a model's error that is left in the residual: the part that the parameters have followed."""


@dataclass(frozen=True)
class Linearisation:
    """Linearised model near the answer.

    unknown: directions the data do not fix, in scaled parameters, (p, k); pseudo_inverse: (p, rows); scale: (p,)
    parts: the share of each block of residuals in the covariance, (blocks, p, p); noise: of each block
    given: how many of them, the last, are not of residuals but of what is taken as known (see `given`)
    systematic: norm of what is systematic in the residual. A model error moves the parameters by the part of it that
    they can follow, which leaves no residual; taken as ABSORBED times the residual, in the worst direction, it holds
    the truth for 95 % of random wrong models (python -m shoal_validation.coverage.systematic)
    """

    unknown: Array
    pseudo_inverse: Array
    scale: Array
    parts: Array
    noise: tuple[Noise, ...]
    systematic: float = 0.0
    given: int = 0

    @property
    def alone(self) -> Linearisation:
        """Linearisation by the residuals alone, as if all that is taken as known were exact."""
        count = len(self.parts) - self.given
        return replace(self, parts=self.parts[:count], noise=self.noise[:count], given=0)

    @property
    def covariance(self) -> Array:
        """Covariance of the parameters, (p, p)."""
        return np.asarray(np.sum(self.parts, axis=0))


@dataclass(frozen=True)
class Spread:
    """Uncertainty of a function of the parameters: standard deviation, half interval, whether the data fix it."""

    std: float
    half: float
    fixed: bool


def determined(singular: Array, right: Array, error: Array | None) -> npt.NDArray[np.bool_]:
    """Singular directions, rows of `right` (k, p), of a Jacobian that the data determine, (k,), bool.

    Those along which the derivatives are larger than their `error` (rows, p). How weak they are beside the strongest
    one is a matter of the parameters' sizes alone; what they are beside the noise is in the covariance. None: the
    error is not known.
    """
    largest = np.max(singular, initial=0.0)
    if error is None:
        return np.asarray(singular > DIFFERENCE * largest)
    return np.asarray(singular > np.maximum(np.linalg.norm(error @ right.T, axis=0), PRECISION * largest))


def inverse(jacobian: Array, scale: Array, error: Array | None = None) -> tuple[Array, Array, Array]:
    """Pseudo-inverse (p, m) of a Jacobian (m, p), orthonormal columns of what it changes (m, k), and `unknown` (p, u).

    scale: size of each parameter, (p,); error: of the Jacobian; see `determined` and Linearisation
    """
    left, singular, right = np.linalg.svd(jacobian * scale, full_matrices=False)
    known = determined(singular, right, None if error is None else error * scale)
    over = np.where(known, 1.0 / np.where(known, singular, 1.0), 0.0)
    return scale[:, None] * (right.T * over) @ left.T, left[:, known], right[~known].T


def followed(jacobian: Array) -> tuple[Array, Array]:
    """Orthonormal columns (m, k) of all that the parameters change by a Jacobian (m, p), and its pseudo-inverse (p, m).

    Weak directions count too: a test is to find only what no change of the parameters can do.
    """
    left, singular, right = np.linalg.svd(jacobian, full_matrices=False)
    seen = singular > _FOLLOWED * max(float(singular[0]), 1e-300)
    return left[:, seen], (right[seen].T / singular[seen]) @ left[:, seen].T


def linearise(
    jacobian: Array, residual: Array, scale: Array, blocks: list[Block], error: Array | None = None
) -> Linearisation:
    """Uncertainty from the Jacobian (m, p) and residuals (m,) at the optimum; scale: size of each parameter, (p,).

    error: by how much the Jacobian may be off, (m, p); None where that is not known

    The covariance is the sandwich (J'J)^-1 J' R J (J'J)^-1 of an unweighted fit, R being the covariance of the noise
    (Seber and Wild, Nonlinear Regression, 1989, 6.2).
    """
    pseudo_inverse, changed, unknown = inverse(jacobian, scale, error)
    noise = estimate_noise(residual, changed, blocks)
    parts = []
    for block, seen in zip(blocks, noise, strict=True):
        rows = pseudo_inverse.T[block.rows]
        parts.append(seen.variance * rows.T @ correlate(block, seen.rho, rows))
    return Linearisation(unknown, pseudo_inverse, scale, np.array(parts), tuple(noise))


def spread(function: Callable[[Array], float], point: Array, at: Linearisation) -> Spread:
    """Uncertainty of a function of the parameters."""
    steps = DIFFERENCE * at.scale
    gradient = np.array([(function(point + step) - function(point - step)) for step in np.diag(steps)]) / (2 * steps)
    scaled = gradient * at.scale
    hidden = np.linalg.norm(scaled @ at.unknown) if at.unknown.size else 0.0
    fixed = bool(hidden <= HIDDEN * max(float(np.linalg.norm(scaled)), 1e-300))
    shares = np.maximum(np.einsum("i,bij,j->b", gradient, at.parts, gradient), 0.0)
    std = float(np.sqrt(np.sum(shares)))
    lever = float(np.linalg.norm(gradient @ at.pseudo_inverse))
    return Spread(std, float(np.hypot(quantile(shares, at.noise) * std, ABSORBED * lever * at.systematic)), fixed)


def quantile(shares: Array, noise: tuple[Noise, ...], level: float = LEVEL) -> float:
    """Student's t for a variance whose shares (blocks,) are known with the freedom of each (Welch 1947)."""
    total = float(np.sum(shares))
    if total <= 0.0:
        return 0.0
    doubt = float(np.sum([(share / total) ** 2 / seen.freedom for share, seen in zip(shares, noise, strict=True)]))
    return student_above(1.0 / max(doubt, 1e-9), 0.5 - level / 2)


def autocorrelation(residual: Array, blocks: list[Block]) -> float:
    """Lag-1 autocorrelation of residuals (rows,) within channels, pooled over them."""
    measured = [residual[block.rows] for block in blocks if not block.known]
    power = sum(float(part @ part) for part in measured)
    return sum(float(part[1:] @ part[:-1]) for part in measured) / power if power > 0 else 0.0
