"""Levenberg-Marquardt from many starts side by side, by finite-difference lanes.

An iteration simulates the trial points of all descents together with their neighbours, side by side, so a Jacobian is
there when its trial is accepted (Nielsen's damping rule; Madsen, Nielsen, Tingleff, Methods for non-linear least
squares problems, 2004). Unlike those of `numerics.levenberg_marquardt` these searches keep to active bounds, and leave
where a better one is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from shoal.identification.conventions import DIFFERENCE, ROUND_OFF
from shoal.identification.forward import ForwardModel, Progress
from shoal.mechanics.integrators import facts
from shoal.mechanics.numerics.tile import WIDE
from shoal.trajectory import Array

T = TypeVar("T")

_ITERATIONS = 60
"""Steps of a descent, at most."""
_ROUNDS = 5
"""Of so many iterations, at most, where a descent that has not converged is followed to its end."""
_SMALL_GAIN = 1e-8
"""A step that promises to lower the fitness by less than this fraction is the end."""
UNDAMPED, _LARGE_DAMPING = 1e-6, 1e12
"""Least damping, and that from which on a step is so short that there is no descent (Marquardt 1963)."""
DESCENTS = 8
"""Descents from the best starts, side by side: with their differences they fill the lanes of a call."""
FEW = 3
"""Descents that answer a question beside the search: a second and a third start hold when the first is a false one."""
_APART = 0.02
"""Two starts are different if a parameter differs by more than this fraction of its range."""
ENDS_APART = 1e-3
"""Two minima are different if a parameter differs by more than this; see `differing`."""
_SAME = 1e-4
"""Two points are the same if no parameter differs by more than this fraction of its range."""


@dataclass(frozen=True)
class Descent:
    """A local search: where it ended, residuals and Jacobian there, and its rows of (iteration, best, trial)."""

    point: Array
    residual: Array
    jacobian: Array
    fitness: float
    rows: list[tuple[int, float, float]]
    converged: bool

    @property
    def message(self) -> str:
        """Reason why it is no answer; empty if it has converged."""
        return "" if self.converged else f"no convergence after {len(self.rows)} iterations"


def descend_many(
    model: ForwardModel,
    starts: Array,
    progress: Progress = lambda *_: None,
    *,
    first: tuple[Array, Array] | None = None,
    patience: float = np.inf,
) -> list[Descent]:
    """Minimise the squared residuals within the bounds from each start, (starts, parameters), in that order.

    first: what `differentiate_many` gives for the starts, if it is known.
    A descent leaves when it has converged, when it has come to where a better one is, and when after two steps even
    what its next step promises is more than `patience` times the best one's fitness. Those that leave early have not
    converged.
    """
    searches = [Search(model, *at) for at in zip(starts, *(first or differentiate_many(model, starts)), strict=True)]

    def differentiate(_: Sequence[int], trials: Sequence[Array]) -> tuple[Sequence[Array], Sequence[Array]]:
        residuals, jacobians = differentiate_many(model, np.array(trials))
        return list(residuals), list(jacobians)

    return _descend(searches, differentiate, progress, patience)


def descend_on(model: ForwardModel, end: Descent) -> Descent:
    """Go on from where a descent left before it had converged, until it has or a round gains nothing."""
    for _ in range(_ROUNDS):
        if end.converged:
            break
        before, end = end, descend_many(model, end.point[None])[0]
        if not end.fitness < before.fitness:
            break
    return end


Differentiate = Callable[[Sequence[int], Sequence[Array]], tuple[Sequence[Array], Sequence[Array]]]
"""Residuals and Jacobians at points of some of several models, which are given by their numbers."""


def descend_each(
    models: Sequence[ForwardModel],
    starts: Sequence[Array],
    differentiate: Differentiate,
    *,
    patience: float = np.inf,
    most: int = _ITERATIONS,
) -> list[Descent]:
    """Descend as `descend_many`, on several models with as many rows, from one start each; most: iterations."""
    first = differentiate(range(len(models)), starts)
    searches = [Search(*at) for at in zip(models, starts, *first, strict=True)]
    return _descend(searches, differentiate, lambda *_: None, patience, most)


def _descend(
    searches: list[Search], differentiate: Differentiate, progress: Progress, patience: float, most: int = _ITERATIONS
) -> list[Descent]:
    """Take steps until all have converged or left."""
    active, number = searches, {id(search): k for k, search in enumerate(searches)}
    _report(0, searches, searches, progress)
    for iteration in range(1, most):
        limit = patience * min(search.fitness for search in searches) if iteration > 2 else np.inf
        asked = [(search, trial) for search in _apart(active) if (trial := search.ask()) is not None]
        going = [(search, trial) for search, trial in asked if search.promise <= limit]
        if not going:
            break
        active, trials = [search for search, _ in going], [trial for _, trial in going]
        seen = differentiate([number[id(search)] for search in active], trials)
        for search, trial, residual, jacobian in zip(active, trials, *seen, strict=True):
            search.tell(trial, residual, jacobian)
        _report(iteration, searches, active, progress)
    return [search.descent() for search in searches]


def differentiate_many(
    model: ForwardModel, points: Array, residuals: Callable[[Array, Array], Array] | None = None
) -> tuple[Array, Array]:
    """Residuals at points, (points, rows), and their forward-difference Jacobians, (points, rows, parameters).

    residuals: instead of the model's, of lanes (lanes, parameters), each beside the point of a number, (lanes,).
    1 + parameters lanes for each point, in one call if the integrator's steps are fixed. Adaptive integrators take the
    same steps in all lanes of a tile, so a point and its neighbours stand in one: differences of runs that were stepped
    differently are those of the integrator's errors.
    """
    steps = np.array([difference_at(model, point) for point in points])
    count, size = points.shape
    shifted = points[:, None] + np.concatenate([np.zeros((count, 1, size)), steps[:, None] * np.eye(size)], axis=1)
    together = _together(model) or count
    calls = [np.arange(k, min(k + together, count)) for k in range(0, count, together)]
    lanes = [(shifted[call].reshape(-1, size), np.repeat(call, 1 + size)) for call in calls]
    seen = [model.residuals(one) if residuals is None else residuals(one, owners) for one, owners in lanes]
    found = np.concatenate(seen).reshape(count, 1 + size, -1)
    with np.errstate(invalid="ignore"):
        jacobians = np.moveaxis((found[:, 1:] - found[:, :1]) / steps[:, :, None], 1, 2)
    return found[:, 0], np.where(np.isfinite(jacobians), jacobians, 0.0)


def difference_at(model: ForwardModel, point: Array) -> Array:
    """Step of the finite differences at a point, inwards at an upper bound, (parameters,)."""
    step = DIFFERENCE * model.sizes(point)
    return np.where(point + step > model.upper, -step, step)


def _together(model: ForwardModel) -> int:
    """Number of points that fit with their neighbours into one tile, where lanes share their steps; 0 where not."""
    integrator = model.scene.solver.integrator
    shared = integrator == "auto" or facts(integrator).adaptive
    return max(1, len(WIDE) // (1 + len(model.names))) if shared else 0


def history(descents: Sequence[Descent]) -> list[tuple[int, float, float]]:
    """Rows of (iteration, best of all, mean of the trials) of descents that went side by side."""
    rows = list[tuple[int, float, float]]()
    for iteration in range(max(len(descent.rows) for descent in descents)):
        current = [descent.rows[iteration] for descent in descents if iteration < len(descent.rows)]
        best = min([row[1] for row in current] + [row[1] for row in rows[-1:]])
        rows.append((iteration, best, mean_of(np.array([row[2] for row in current]))))
    return rows


def distinct(model: ForwardModel, descents: Sequence[Descent]) -> list[Descent]:
    """The descents, best first, without those that ended where a better one did."""
    finite = [descent for descent in descents if np.isfinite(descent.fitness)]
    best_first = sorted(finite, key=lambda d: d.fitness)
    return kept_apart(best_first, lambda one, other: bool(np.any(differing(model, one.point, other.point))))


def best_apart(model: ForwardModel, points: Array, values: Array, count: int) -> Array:
    """The best points that are not close to a better one, one to `count`, (starts, parameters)."""
    best_first = [points[k] for k in np.argsort(values, kind="stable") if np.isfinite(values[k])]
    found = kept_apart(best_first, lambda one, other: distance(model, one, other) > _APART)
    return np.array(found[:count] or [points[0]])


class SearchHistory(list[tuple[int, float, float]]):
    """Rows of (iteration, best, mean fitness), one for each population of a search; `progress` is called with each."""

    def __init__(self, progress: Progress) -> None:
        super().__init__()
        self._progress = progress

    def note(self, values: Array) -> Array:
        """Add the row of a population; returns its values."""
        best = min([*values[np.isfinite(values)].tolist(), self[-1][1] if self else np.inf])
        self.append((len(self), best, mean_of(values)))
        self._progress(*self[-1])
        return values


@dataclass
class Search:
    """One descent between two calls of the model: `ask` for a trial point, then `tell` its residuals.

    fixed: number of a parameter that stays where it is
    """

    model: ForwardModel
    point: Array
    residual: Array
    jacobian: Array
    fixed: int | None = None
    damping: float = UNDAMPED
    growth: float = 2.0
    converged: bool = False
    predicted: float = 0.0
    """Cost that the last step should take away."""
    cost: float = field(init=False)
    scale: Array = field(init=False)
    rows: list[tuple[int, float, float]] = field(init=False)

    def __post_init__(self) -> None:
        self.cost = squares(self.residual)
        self.scale = np.full(len(self.point), 1e-300)
        self.rows = [(0, self.fitness, self.fitness)]

    @property
    def fitness(self) -> float:
        """Mean squared deviation at the point."""
        return self.cost / self.model.rows.samples

    @property
    def promise(self) -> float:
        """Fitness after the step asked for last, if the model were linear."""
        return (self.cost - self.predicted) / self.model.rows.samples

    @property
    def possible(self) -> float:
        """Cost that a step without damping would take away, were the model linear."""
        return self.cost - squares(self.residual + self.jacobian @ self._step(UNDAMPED))

    @property
    def stuck(self) -> bool:
        """Return whether no step leads down, however short."""
        return self.damping > _LARGE_DAMPING

    def ask(self) -> Array | None:
        """Return the next trial point, (parameters,), or None at the end."""
        if self.converged or not np.isfinite(self.cost):
            return None
        model = self.model
        self.scale = np.maximum(self.scale, np.linalg.norm(self.jacobian, axis=0))
        while True:
            wanted = self.point + self._step(self.damping)
            trial = np.clip(wanted, model.lower, model.upper)
            moved = trial - self.point
            self.predicted = self.cost - squares(self.residual + self.jacobian @ moved)
            # A step that a bound cuts may lead uphill: a shorter one does not.
            cut = np.any(trial != wanted) and self.predicted < _SMALL_GAIN * self.cost
            if not cut or self.stuck:
                break
            self.damping = max(10 * self.damping, 1e-3)
        small = np.max(np.abs(moved) / model.sizes(self.point)) < ROUND_OFF
        self.converged = bool(small or self.predicted < _SMALL_GAIN * self.cost)
        return None if self.converged else trial

    def tell(self, trial: Array, residual: Array, jacobian: Array) -> None:
        """Take residuals (rows,) and Jacobian (rows, parameters) of the trial point."""
        cost = squares(residual)
        if cost < self.cost:
            ratio = (self.cost - cost) / self.predicted
            self.point, self.residual, self.jacobian, self.cost = trial, residual, jacobian, cost
            self.damping *= max(0.1, 1 - (2 * ratio - 1) ** 3)
            self.growth = 2.0
        else:
            self.damping *= self.growth
            self.growth *= 2
            self.converged = self.stuck
        self.rows.append((len(self.rows), self.fitness, cost / self.model.rows.samples))

    def descent(self) -> Descent:
        """Result of the descent."""
        return Descent(self.point, self.residual, self.jacobian, self.fitness, self.rows, self.converged)

    def _step(self, damping: float) -> Array:
        """Damped step, where parameters that stand at a bound and are driven against it stay there."""
        downhill = -self.jacobian.T @ self.residual
        held = (self.point <= self.model.lower) & (downhill < 0) | (self.point >= self.model.upper) & (downhill > 0)
        held[[] if self.fixed is None else [self.fixed]] = True
        steeper = self.model.steepness(self.residual)
        jacobian = np.where(held, 0.0, steeper[:, None] * self.jacobian)
        return damped_step(self.residual / steeper, jacobian, self.scale, damping)


def _apart(searches: Sequence[Search]) -> list[Search]:
    """The searches without those that came to where a better one is."""

    def apart(one: Search, other: Search) -> bool:
        return one.model is not other.model or distance(one.model, one.point, other.point) > _SAME

    return kept_apart(sorted(searches, key=lambda s: s.cost), apart)


def kept_apart(found: Iterable[T], apart: Callable[[T, T], bool]) -> list[T]:
    """Those that lie apart from all that were kept before them."""
    kept: list[T] = []
    for one in found:
        if all(apart(one, other) for other in kept):
            kept.append(one)
    return kept


def distance(model: ForwardModel, one: Array, other: Array) -> float:
    """Largest difference of a parameter, as a fraction of its range."""
    return float(np.max(np.abs(one - other) / (model.upper - model.lower)))


def damped_step(residual: Array, jacobian: Array, scale: Array, damping: float) -> Array:
    """Least-squares step from residuals (rows,) by a Jacobian (rows, p), damped in units `scale` (Marquardt 1963)."""
    stacked = np.concatenate([jacobian / scale, np.sqrt(damping) * np.eye(len(scale))])
    wanted = np.concatenate([-residual, np.zeros(len(scale))])
    return np.asarray(np.linalg.lstsq(stacked, wanted, rcond=None)[0] / scale)


def _report(iteration: int, searches: Sequence[Search], active: Sequence[Search], progress: Progress) -> None:
    last = np.array([search.rows[-1][2] for search in active])
    progress(iteration, min(search.fitness for search in searches), mean_of(last))


def mean_of(values: Array) -> float:
    """Mean of those that are finite; inf if none is."""
    finite = values[np.isfinite(values)]
    return float(finite.mean()) if finite.size else float("inf")


def squares(residual: Array) -> float:
    """Sum of the squares of a residual (rows,); inf where the motion failed."""
    return float(residual @ residual) if np.all(np.isfinite(residual)) else float("inf")


def differing(model: ForwardModel, one: Array, other: Array) -> Array:
    """Mask of the parameters in which two minima differ, (parameters,).

    By a part of their range, or where that is wide beside them of ten times their size: bounds may be as far away as
    one likes. Angles that differ by whole turns are the same, and so are rotation vectors.
    """
    other = nearest_attitudes(model, other, one)
    turning, difference = model.parameters.turning, np.abs(one - other)
    turned = np.abs(difference - 2 * np.pi * np.round(difference / (2 * np.pi)))
    span = model.upper - model.lower
    size = np.clip(10 * np.maximum(np.abs(one), np.abs(other)), 1e-3 * span, span)
    scale = np.where(turning, np.minimum(span, 2 * np.pi), np.where(model.parameters.logarithmic, span, size))
    return np.asarray(np.where(turning, turned, difference) > ENDS_APART * scale)


def nearest_attitudes(model: ForwardModel, point: Array, other: Array) -> Array:
    """A point (parameters,) with its rotation vectors, of those of the same attitudes, nearest to those of another."""
    found = point.copy()
    for (recording, body), components in model.parameters.rotations.items():
        stated = model.scene.initial[body].rotation or (0.0, 0.0, 0.0)
        known = {} if recording is None else model.measurement.recordings[recording].stated.known
        base = np.array([known.get(f"initial.{body}.rotation.{k}", part) for k, part in enumerate(stated)])
        sought, numbers = list(components), list(components.values())
        vector, near = base.copy(), base.copy()
        vector[sought], near[sought] = point[numbers], other[numbers]
        angle = float(np.linalg.norm(vector))
        turns = np.round((vector @ near / angle - angle) / (2 * np.pi)) if angle > 0.0 else 0.0
        turned = vector * (1.0 + 2 * np.pi * turns / angle) if turns else vector
        if np.all(np.abs(np.delete(turned - vector, sought)) <= ROUND_OFF):
            found[numbers] = turned[sought]
    return found
