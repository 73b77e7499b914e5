"""Derivatives of the residuals that can be believed: differences of two step sizes that agree.

A chaotic motion magnifies the step of a difference until the difference says nothing (a step of 1e-6 may be off by five
orders of magnitude); a step that is too small drowns in round-off. Both show when two steps are compared.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from shoal.identification.conventions import DIFFERENCE
from shoal.identification.forward import ForwardModel
from shoal.identification.methods.growth import LARGE, growth
from shoal.trajectory import Array

_STEPS = 10.0 ** np.arange(-3.0, -12.0, -1.0)
"""Relative to the size of a parameter (see ForwardModel.sizes), largest first."""
_USUAL = _STEPS[2:4]
"""Enough where they agree at once."""
_SURE = 1e-4
"""Relative difference of two derivatives between which no other step need decide."""
AGREED = 1e-2
"""Relative difference of two derivatives that count as one."""
_ROUNDS = 4
"""Rounds of differences along singular directions, at most."""
_WELL_CONDITIONED = 1e3
"""Condition number below which errors along strong directions hide no weak one."""
_NONE = 1e-200
"""Relative to the largest singular value: a smaller one is zero, and the condition number infinite."""
_SHORTER = 0.75 ** np.arange(1, 9)
"""Parts of a record that are tried where the derivatives of the whole cannot be believed."""

EitherSide = Callable[[ForwardModel, Array, Array], tuple[Array, Array]]


@dataclass(frozen=True)
class Sensitivity:
    """Residuals at a point, (rows,), and their Jacobian, (rows, parameters).

    doubt: relative difference of two step sizes, the worst of all directions
    growth: largest over smallest singular value, of parameters in units of their size
    error: by how much the derivatives by the two steps differ, (rows, parameters)
    end: until when the derivatives can be believed [s by the clock]; those of later rows are zero; None: all can
    """

    residual: Array
    jacobian: Array
    doubt: float
    growth: float
    error: Array
    end: float | None = None

    @property
    def reliable(self) -> bool:
        """Return whether two steps agree in every direction."""
        return self.doubt <= AGREED

    @property
    def possible(self) -> bool:
        """Return whether the point can be simulated at all."""
        return bool(np.all(np.isfinite(self.residual)))


def sensitivity(model: ForwardModel, point: Array, residual: Array | None = None) -> Sensitivity:
    """Central differences, in each direction with the neighbouring steps that agree best. Not counted.

    residual: at the point, (rows,), where it is known.

    What they differ by where the motion magnifies no deviation is what the solver's iterations leave. Lanes of a tile
    share that, so that it is in no difference of two neighbours, and these decide then.
    """
    residual = model.uncounted(point[None])[0] if residual is None else residual
    seen = _seen(model, point, residual, _apart)
    if seen.reliable or not seen.possible or growth(model, seen.jacobian) > LARGE:
        return seen
    beside = _seen(model, point, residual, _side_by_side)
    return beside if beside.reliable else seen


def _seen(model: ForwardModel, point: Array, residual: Array, either_side: EitherSide) -> Sensitivity:
    """Derivatives at a point of known residuals (rows,).

    Errors along the strongest direction would hide the weakest, so that the differences are repeated along the
    singular directions found, until these stay. At a bound the difference is taken to the inner side, and the parameter
    is none of these directions: those that the others follow would lead out of the box with it.
    """
    sizes = model.sizes(point)
    basis = turned = np.eye(len(point))
    free = np.flatnonzero(np.minimum(point - model.lower, model.upper - point) > _STEPS[0] * sizes)
    columns, doubt, error = _differences(model, point, sizes, basis, _USUAL, either_side)
    if np.max(doubt) < _SURE and (growth := _growth(columns)) < _WELL_CONDITIONED:
        return Sensitivity(residual, columns / sizes, float(np.max(doubt)), growth, error / sizes)
    for _ in range(_ROUNDS):
        basis = turned
        columns, doubt, error = _differences(model, point, sizes, basis, _STEPS, either_side)
        growth = _growth(columns[:, free])
        right = np.linalg.svd(columns[:, free], full_matrices=False)[2]
        if growth < _WELL_CONDITIONED or np.max(np.abs(np.abs(right) - np.eye(len(free)))) < AGREED / growth:
            break
        turned = basis.copy()
        turned[np.ix_(free, free)] = basis[np.ix_(free, free)] @ right.T
    turned_back = basis.T / sizes
    return Sensitivity(residual, columns @ turned_back, float(np.max(doubt)), _growth(columns), error @ turned_back)


def believed(model: ForwardModel, point: Array, residual: Array | None = None) -> Sensitivity:
    """Return `sensitivity`, of a chaotic motion that of the beginning which has derivatives, if any.

    Intervals that rest on the beginning are too wide rather than too narrow: what follows is not used.
    """
    seen = sensitivity(model, point, residual)
    if seen.reliable or not seen.possible:
        return seen
    for end in _SHORTER * model.measurement.end:
        part = model.until(float(end))
        if len(part.rows.time) <= len(point):
            break
        early = sensitivity(part, point)
        if early.reliable:
            jacobian, error = np.zeros_like(seen.jacobian), np.zeros_like(seen.error)
            kept = np.append(model.rows.time <= end + 1e-12, np.ones(len(seen.residual) - len(model.rows.time), bool))
            jacobian[kept], error[kept] = early.jacobian, early.error
            return replace(seen, jacobian=jacobian, error=error, end=float(end))
    return seen


def _growth(columns: Array) -> float:
    if not columns.shape[1]:
        return 1.0
    singular = np.linalg.svd(columns, compute_uv=False)
    return float(singular[0] / singular[-1]) if singular[-1] > _NONE * singular[0] else np.inf


def _apart(model: ForwardModel, ahead: Array, behind: Array) -> tuple[Array, Array]:
    """Residuals (points, rows) at points on either side of others, (points, parameters) each. Not counted."""
    seen = model.uncounted(np.concatenate([ahead, behind]))
    return seen[: len(ahead)], seen[len(ahead) :]


def _side_by_side(model: ForwardModel, ahead: Array, behind: Array) -> tuple[Array, Array]:
    """Run both sides of each point as `_apart` does, in neighbouring lanes."""
    seen = model.uncounted(np.stack([ahead, behind], axis=1).reshape(-1, ahead.shape[1]))
    return seen[::2], seen[1::2]


def _differences(
    model: ForwardModel, point: Array, sizes: Array, basis: Array, widths: Array, either_side: EitherSide
) -> tuple[Array, Array, Array]:
    """Derivatives of the residuals along the columns of `basis` (scaled parameters), and doubt and error of each."""
    count = len(point)
    steps = np.concatenate([step * sizes * basis.T for step in widths])
    ahead, behind = (_inside(model, point, move) for move in (steps, -steps))
    seen = either_side(model, point + ahead, point + behind)
    width = np.linalg.norm((ahead - behind) / sizes, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        slopes = (seen[0] - seen[1]) / width[:, None]
    slopes = slopes.reshape(len(widths), count, -1)
    columns, doubts = np.zeros((slopes.shape[2], count)), np.full(count, np.inf)
    errors = np.zeros_like(columns)
    least = np.zeros(count)
    for k in range(count):
        table = slopes[:, k]
        with np.errstate(invalid="ignore", divide="ignore"):
            size = np.linalg.norm(table, axis=1)
            doubt = np.linalg.norm(table[:-1] - table[1:], axis=1) / np.minimum(size[:-1], size[1:])
        # What changes nothing at all is no reason to doubt.
        doubt[(size[:-1] == 0.0) & (size[1:] == 0.0)] = 0.0
        best = int(np.argmin(np.where(np.isfinite(doubt), doubt, np.inf)))
        # Round-off adds to a difference, so that the smallest says the most where they disagree.
        least[k] = np.min(size[np.isfinite(size)], initial=np.inf)
        if np.all(np.isfinite(table[best])):
            columns[:, k], doubts[k], errors[:, k] = table[best], doubt[best], table[best] - table[best + 1]
    # Where two steps never agree and next to nothing changes, there is nothing but round-off. The spread of the data is
    # the measure of that, and not what chaos magnifies.
    size = np.linalg.norm(columns, axis=0)
    usual = min(float(np.max(size)), np.sqrt(columns.shape[0]) * model.rows.signal)
    nothing = (doubts > AGREED) & (np.minimum(size, least) < DIFFERENCE * usual)
    columns[:, nothing], doubts[nothing], errors[:, nothing] = 0.0, 0.0, 0.0
    return columns, doubts, errors


def _inside(model: ForwardModel, point: Array, moves: Array) -> Array:
    """Moves that stay within the bounds, or lead no further out of them; one that would not is not made."""
    there = point + moves
    low, high = model.box_at(point)
    good = np.all((there >= low) & (there <= high), axis=1)
    return np.where(good[:, None], moves, 0.0)
