"""Stationarity of an answer: the gain of one Gauss-Newton step from there.

Least squares end where the step vanishes; a swarm ends when its iterations are used up, at any place. What
remains to go is measured by the uncertainty that the answer would have at the minimum: an end within it is as good as
the minimum, for the data do not distinguish them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shoal.identification.conventions import DIFFERENCE, LEVEL, PRECISION
from shoal.identification.forward import ForwardModel
from shoal.identification.uncertainty.chances import chi_square_above
from shoal.identification.uncertainty.covariance import blocks_of
from shoal.identification.uncertainty.linearisation import determined, linearise
from shoal.identification.uncertainty.sensitivity import Sensitivity
from shoal.trajectory import Array

_PARTS = 2.0 ** np.arange(2, -8, -1)
"""Of the step: where the model is not linear, the whole may lead too far, and with a robust loss not far enough."""
_KEPT = 0.1
"""Of the gain that the linear model promises, what has to come true."""


@dataclass(frozen=True)
class Downhill:
    """A better place than the answer, (parameters,), the fitness there and at the answer.

    distance: between them, in standard deviations of an estimate
    """

    point: Array
    fitness: float
    before: float
    distance: float


def downhill(model: ForwardModel, point: Array, seen: Sensitivity) -> Downhill | None:
    """Return the end of a Gauss-Newton step from a point if it is significantly lower; else None. Not counted.

    seen: residuals and derivatives there. Parameters stay within their bounds, and directions that the data leave open
    as they are. The model is run along the step: a promise of derivatives that does not come true is none.
    """
    step = _step(model, point, seen)
    largest = max(float(np.nanmax(np.abs(r.values))) for r in model.measurement.recordings.values())
    nothing = max(DIFFERENCE * model.rows.signal, PRECISION * largest * float(np.max(model.rows.weight)))
    if np.sqrt(np.mean((seen.jacobian @ step) ** 2)) < nothing:
        return None
    low, high = model.box_at(point)
    places = np.clip(point + _PARTS[:, None] * step, low, high)
    rows = model.uncounted(np.concatenate([point[None], places]))
    before, *after = model.cost(rows).tolist()
    best = int(np.argmin(after))
    promised = before - float(model.cost((seen.residual + seen.jacobian @ (places[best] - point))[None])[0])
    distance = _distance(model, point, places[best], seen, rows[1 + best])
    if distance < np.sqrt(chi_square_above(1.0, 1.0 - LEVEL)) or before - after[best] < _KEPT * promised:
        return None
    return Downhill(places[best], after[best], before, distance)


def sentence(model: ForwardModel, point: Array, better: Downhill) -> str:
    """Description of the step in words, by the parameter that it moves most."""
    moved = int(np.argmax(np.abs(better.point - point) / model.sizes(point)))
    old, new = (model.parameters.to_values(place)[moved] for place in (point, better.point))
    return (
        f"one Gauss-Newton step lowers the fitness from {better.before:.3g} to {better.fitness:.3g} "
        f"and takes {model.names[moved]} from {old:.6g} to {new:.6g}"
    )


def _step(model: ForwardModel, point: Array, seen: Sensitivity) -> Array:
    """Gauss-Newton step within the bounds, of least norm where the data leave it open, (parameters,)."""
    sizes, steeper = model.sizes(point), model.steepness(seen.residual)
    left, singular, right = np.linalg.svd(steeper[:, None] * seen.jacobian * sizes, full_matrices=False)
    known = determined(singular, right, steeper[:, None] * seen.error * sizes)
    if not np.any(known):
        return np.zeros(len(point))
    low, high = model.box_at(point)
    wanted = -left[:, known].T @ (seen.residual / steeper)
    bounds = ((low - point) / sizes, (high - point) / sizes)
    free = right[known].T @ (wanted / singular[known])
    if np.all((free >= bounds[0]) & (free <= bounds[1])):
        return np.asarray(free * sizes)
    from scipy.optimize import lsq_linear  # slow to import

    found = lsq_linear(singular[known, None] * right[known], wanted, bounds, method="bvls")
    return np.asarray(found.x * sizes)


def _distance(model: ForwardModel, point: Array, place: Array, seen: Sensitivity, residual: Array) -> float:
    """Mahalanobis distance to a better place, in the directions that the data determine.

    seen: derivatives; residual: at the better place; what the parameters could still take away there is no noise
    """
    sizes, blocks = model.sizes(point), blocks_of(model, len(residual))
    basis = np.linalg.qr(seen.jacobian)[0]
    at = linearise(seen.jacobian, residual - basis @ (basis.T @ residual), sizes, blocks, seen.error)
    values, directions = np.linalg.eigh(at.covariance / np.outer(sizes, sizes))
    kept = slice(at.unknown.shape[1], None)
    along = directions.T @ ((place - point) / sizes)
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(np.sqrt(np.nansum(along[kept] ** 2 / np.maximum(values[kept], 0.0))))
