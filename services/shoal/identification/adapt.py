"""No more model than the data need: search on a coarse model, finish on the one that meets a tolerance."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from shoal.errors import InputError
from shoal.identification.conventions import NOTICED, SEVERAL
from shoal.identification.deadline import TimeIsUp
from shoal.identification.forward import ForwardModel, Progress
from shoal.identification.methods import Method, Outcome
from shoal.identification.methods.auto import explained
from shoal.identification.methods.least_squares import descend
from shoal.identification.methods.starts import starting_points
from shoal.identification.recording.source import STRAIN
from shoal.scene import FRAMED, Rod
from shoal.selection import Selection, select
from shoal.selection.levels import fields
from shoal.trajectory import Array

COARSER = 30.0
"""The search goes by a model whose error may be larger by this factor than that of the final one."""


class Stopped(TimeIsUp):
    """Time was up on the way; model: whose best so far stands."""

    def __init__(self, model: ForwardModel) -> None:
        super().__init__()
        self.model = model


@dataclass(frozen=True)
class AdaptedModel:
    """One model on the way: what it is, its estimated error at the markers [m], and the evaluations spent on it."""

    model: str
    tolerance: float
    error: float
    evaluations: int


def coarse_to_fine(
    model: ForwardModel, search: Method, tolerance: float, rng: np.random.Generator, progress: Progress
) -> tuple[ForwardModel, Outcome, list[AdaptedModel]]:
    """Search with a method on a coarse model, then least squares from there on the model that meets `tolerance` [m].

    The models are chosen at the first pose that the data allow, and again where the search ended. Returns the final
    model, whose counter has counted both stages, with the outcome and the models on the way. Raises InputError.
    """
    stages: list[AdaptedModel] = []
    start = starting_points(model)[0]
    coarse, chosen = _chosen(model, start, COARSER * tolerance)
    fine = coarse
    try:
        outcome = search(coarse, rng, progress)
        stages.append(_stage(chosen, coarse.counter.evaluations))
        fine, chosen = _chosen(coarse, outcome.point, tolerance)
        descent = descend(fine, outcome.point, progress)
        point, fitness, rows = descent.point, descent.fitness, descent.rows
        # The coarse model may have led to the wrong minimum.
        if np.sqrt(fitness) > SEVERAL * tolerance and not explained(fine, replace(outcome, fitness=fitness)):
            again = search(fine, rng, progress)
            rows = rows + [(len(rows) + i, best, mean) for i, best, mean in again.iterations]
            point, fitness = min((point, fitness), (again.point, again.fitness), key=lambda end: end[1])
    except TimeIsUp:
        raise Stopped(fine if np.isfinite(fine.counter.best_value) else coarse) from None
    stages.append(_stage(chosen, fine.counter.evaluations))
    # Values of different models cannot be compared, so the search on the coarse one counts without a best value.
    fine.counter.charge(coarse.counter.evaluations, outcome.point, np.inf)
    rows = outcome.iterations + [(len(outcome.iterations) + i, best, mean) for i, best, mean in rows]
    message = "" if chosen.met else f"the model is off, {chosen.errors.brief}: {chosen.reason}"
    return fine, replace(outcome, point=point, fitness=fitness, iterations=rows, message=message), stages


def _chosen(model: ForwardModel, point: Array, tolerance: float) -> tuple[ForwardModel, Selection]:
    """The forward model on the scene that is chosen at a point, by the longest recording."""
    name, recording = max(model.measurement.recordings.items(), key=lambda item: item[1].times[-1])
    clock = model.parameters.measurement_values(point[None], name, recording.stated)
    times = recording.times / clock["clock"][0] + clock["delay"][0]
    deadline = model.deadline
    channels = (channel for recording in model.measurement.recordings.values() for channel in recording.channels)
    selection = select(
        model.scene_at(point, name),
        tolerance,
        times,
        lambda _: None if deadline is None else deadline.check(),
        meshed=tuple(model.scene.markers[one.marker].body for one in channels if one.quantity == STRAIN),
    )
    values = fields(model.scene, selection.chosen.levels)
    solver = selection.chosen.scene.solver.model_dump(mode="json")
    for name in ("integrator", "step", "inertia_cap", "relative_tolerance", "absolute_tolerance"):
        values[f"solver.{name}"] = solver[name]
    return replace(model, scene=model.scene.with_values(values)), selection


def _stage(selection: Selection, evaluations: int) -> AdaptedModel:
    chosen = selection.chosen
    return AdaptedModel(chosen.name, selection.tolerance, chosen.error, evaluations)


_HALVINGS = 6
"""At most."""
_SETTLES = 2.0
"""An error that falls by less when the step is halved is not that of the step: the motion is chaotic, for instance."""
_ORDER = 2
"""Of generalized-alpha and leapfrog, one of which `auto` takes where rods have elements."""


def paced(model: ForwardModel, point: Array) -> ForwardModel:
    """The model with its step halved until that counts no more, at a point.

    A step is chosen where the scene leaves the integrator open and rods have elements; the scene's own is the longest.
    Noise that is not stated is what the data show. A run that is rejected has an infinite error. Runs are not
    counted. Raises TimeIsUp.
    """
    rods = [body for body in model.scene.bodies.values() if isinstance(body, Rod)]
    free = model.scene.solver.integrator == "auto" and any(rod.element not in FRAMED for rod in rods)
    if not free:
        return model
    step, before = model.scene.solver.step, np.inf
    try:
        seen = model.uncounted(point[None])[0]
        for halvings in range(1, _HALVINGS + 1):
            shorter = _stepping(model, step / 2**halvings)
            found = shorter.uncounted(point[None])[0]
            error = _between(seen, found) / model.rows.shown
            if error > before / _SETTLES:
                return model
            if error <= NOTICED:
                return _stepping(model, 2 * step / 2**halvings) if halvings > 1 else model
            seen, before = found, error
    except InputError:
        return model
    return shorter if np.isfinite(error) else model


def _between(seen: Array, found: Array) -> float:
    """Error of residuals (rows,) by those of half the step [RMS]; infinite where a run is rejected."""
    if not (np.all(np.isfinite(seen)) and np.all(np.isfinite(found))):
        return np.inf
    return float(np.sqrt(np.mean((found - seen) ** 2))) / (1.0 - 0.5**_ORDER)


def _stepping(model: ForwardModel, step: float) -> ForwardModel:
    return replace(model, scene=model.scene.with_values({"solver.step": step}))


def repaced(model: ForwardModel, outcome: Outcome, progress: Progress) -> tuple[ForwardModel, Outcome]:
    """Return the outcome, refitted with a shorter step where motions are faster than at the start. See `paced`."""
    shorter = paced(model, outcome.point)
    if shorter is model:
        return model, outcome
    descent = descend(shorter, outcome.point, progress)
    # Values of different models cannot be compared, so the search before counts without a best value.
    shorter.counter.charge(model.counter.evaluations, outcome.point, np.inf)
    shorter.work += model.work
    rows = [*outcome.iterations, *((len(outcome.iterations) + i, best, mean) for i, best, mean in descent.rows)]
    choice = "; then ".join(part for part in (outcome.choice, "least squares with a shorter step") if part)
    return shorter, replace(outcome, point=descent.point, fitness=descent.fitness, iterations=rows, choice=choice)
