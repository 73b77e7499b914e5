"""The density that a posterior is drawn from: that of the misfit, with the curvature of the intervals' covariance.

A normal one where the size of the noise is stated, else Student's t, which is what remains of it when that size is
integrated out. Residuals that are correlated, unequal or systematic make least squares know less than their sum of
squares says. So its curvature is adjusted to the covariance that the intervals have (Ribatet, Cooley and Davison,
Statistica Sinica 22, 2012); with white noise nothing changes.
"""

from __future__ import annotations

import numpy as np

from shoal.identification.conventions import LEVEL
from shoal.identification.forward import ForwardModel
from shoal.identification.uncertainty.chances import student_above
from shoal.identification.uncertainty.covariance import Block
from shoal.identification.uncertainty.linearisation import ABSORBED, Linearisation
from shoal.trajectory import Array


class Density:
    """The logarithm of the density that is sampled.

    turned: what a step from the answer is multiplied by before it is simulated; size: variance by which the sum of
    squares is divided; freedom: of Student's t, inf for a normal density; spread: root of the covariance
    """

    def __init__(
        self,
        model: ForwardModel,
        point: Array,
        least: float,
        turned: Array,
        size: float,
        freedom: float,
        spread: Array,
    ) -> None:
        self.model, self.point, self.least = model, point, least
        self.turned, self.size, self.freedom, self.spread = turned, size, freedom, spread
        self.lower, self.upper = model.box_at(point)
        self.evaluations = self.failed = 0

    def __call__(self, points: Array) -> Array:
        """Log density at points (count, parameters); -inf outside the bounds and where nothing can be simulated."""
        found = np.full(len(points), -np.inf)
        inside = np.flatnonzero(np.all((points >= self.lower) & (points <= self.upper), axis=1))
        if inside.size:
            rows = self.model.uncounted(self.point + (points[inside] - self.point) @ self.turned.T)
            rise = (np.sum(rows**2, axis=1) - self.least) / self.size
            self.evaluations += len(inside)
            self.failed += int(np.count_nonzero(~np.isfinite(rise)))
            found[inside] = np.where(np.isfinite(rise), self._log(rise), -np.inf)
        return found

    def _log(self, rise: Array) -> Array:
        if not np.isfinite(self.freedom):
            return -rise / 2
        return -(self.freedom + len(self.point)) / 2 * np.log1p(np.maximum(rise / self.freedom, -0.99))


def density(model: ForwardModel, point: Array, at: Linearisation, blocks: list[Block], least: float) -> Density:
    """The density whose curvature at the answer is that of its covariance, in scaled parameters that are known."""
    across = at.unknown.shape[1] if at.unknown.size else 0
    known = np.linalg.svd(at.unknown)[0][:, across:] if across else np.eye(len(point))
    parts = known.T @ (at.parts / np.outer(at.scale, at.scale)) @ known
    covariance = parts.sum(axis=0)
    freedom = _freedom(parts, at, blocks)
    lever = known.T @ (at.pseudo_inverse / at.scale[:, None])
    alone = lever @ lever.T  # the inverse of the Gram matrix G of the Jacobian
    covariance = covariance + (ABSORBED * at.systematic / _quantile(freedom)) ** 2 * alone
    # M' G M / size = C^-1 with det M = 1: M is 1 if C is proportional to the inverse of G.
    root = np.linalg.inv(np.linalg.cholesky(alone))
    inner = _root(root @ covariance @ root.T, -0.5)
    factor = float(np.linalg.det(inner)) ** (1.0 / len(inner))
    outside = np.eye(len(point)) - known @ known.T
    turned = known @ np.linalg.solve(root, inner @ root) / factor @ known.T + outside
    wide = outside @ np.diag((model.upper - model.lower) / at.scale / np.sqrt(12.0)) @ outside
    spread = known @ _root(covariance, 0.5) @ known.T + wide
    turned, spread = at.scale[:, None] * turned / at.scale, at.scale[:, None] * spread
    return Density(model, point, least, turned, factor**-2, freedom, spread)


def _freedom(parts: Array, at: Linearisation, blocks: list[Block]) -> float:
    """Degrees of freedom of the covariance, from shares (blocks, p, p) of unstated noise (Satterthwaite 1946)."""
    stated = [b.known or (b.stated > 0 and n.variance <= b.stated**2) for b, n in zip(blocks, at.noise, strict=False)]
    stated += [False] * (len(at.noise) - len(blocks))
    shares = np.einsum("bij,ji->b", parts, np.linalg.inv(parts.sum(axis=0))) / parts.shape[1]
    doubt = sum(s**2 / n.freedom for s, n, sure in zip(shares, at.noise, stated, strict=True) if not sure)
    return float(1.0 / doubt) if doubt > 0.0 else np.inf


def _quantile(freedom: float) -> float:
    return student_above(min(freedom, 1e9), 0.5 - LEVEL / 2)


def _root(matrix: Array, power: float) -> Array:
    """Power of a symmetric positive matrix."""
    values, vectors = np.linalg.eigh(matrix)
    return np.asarray((vectors * np.maximum(values, 1e-300) ** power) @ vectors.T)
