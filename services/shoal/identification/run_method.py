"""Run a method of identification: from where it may begin, as long as it may, then look for other minima."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from shoal.engines import get_engine
from shoal.errors import InputError
from shoal.identification.adapt import AdaptedModel, Stopped, coarse_to_fine, paced, repaced
from shoal.identification.deadline import TimeIsUp, unless_late
from shoal.identification.diagnostics.minima.search import with_other_minima
from shoal.identification.forward import ForwardModel
from shoal.identification.methods import Method, Outcome
from shoal.identification.methods.starts import starting_points
from shoal.scene.function import Function
from shoal.trajectory import Array

Watch = Callable[[int, float, float, int], None]
"""Called with (iteration, best fitness, mean fitness of the iteration, evaluations so far)."""


def assembled(model: ForwardModel) -> tuple[ForwardModel, list[str]]:
    """The model, begun from the scene's own values where those it begins from close no loop, and a note if so."""
    sought = dict(model.problem.parameters)
    for name, parameter in sought.items():
        own = None if parameter.path is None or parameter.of_measurement else model.scene.value(parameter.path)
        if isinstance(own, Function):
            own = own.number
        if parameter.start is None and own is not None and parameter.lower <= own <= parameter.upper:
            sought[name] = parameter.model_copy(update={"start": float(own)})
    begun = [name for name, parameter in sought.items() if parameter is not model.problem.parameters[name]]
    loops = len(model.scene.joints) > len(model.scene.bodies)
    if not begun or not loops or _closes(model):
        return model, []
    other = replace(model, problem=model.problem.model_copy(update={"parameters": sought}))
    if not _closes(other):
        return model, []
    what = f"the search starts from the scene's own {', '.join(begun)}"
    return other, [f"{what}: in the middle of the bounds the machine cannot be assembled"]


def _closes(model: ForwardModel) -> bool:
    """Return whether the machine can be assembled where a search begins, in every recording."""
    aside = model.aside(engine=get_engine("gauss"), deadline=None)

    def closed(starts: Array) -> bool:
        seen = (aside.observe(starts, name, np.zeros(1)) for name in model.measurement.recordings)
        return bool(np.any(np.all([np.any(np.isfinite(one), axis=(1, 2)) for one in seen], axis=0)))

    # Poses that the first samples allow take longer.
    return closed(aside.parameters.start[None]) or closed(starting_points(aside))


def with_step(model: ForwardModel) -> ForwardModel:
    """With the step that suits the noise where the search begins."""
    return unless_late(lambda: paced(model, starting_points(model)[0]), model)


def run_method(
    model: ForwardModel,
    search: Method,
    rng: np.random.Generator,
    tolerance: float | None,
    paces: bool,
    watch: Watch,
) -> tuple[ForwardModel, Outcome, list[AdaptedModel]]:
    """Run a method as long as it may; returns the model it ended with, where, and the models on the way.

    paces: whether the step may be shortened where the search ended
    """

    def progress(iteration: int, best: float, mean: float) -> None:
        watch(iteration, best, mean, asked.counter.evaluations)

    asked, stages = model, list[AdaptedModel]()
    try:
        if tolerance is None:
            outcome = search(model, rng, progress)
        else:
            model, outcome, stages = coarse_to_fine(model, search, tolerance, rng, progress)
    except TimeIsUp as end:
        model = end.model if isinstance(end, Stopped) else model
        outcome = _best_so_far(model)
    if paces and outcome.ended and np.isfinite(outcome.fitness):
        searched, at_end = model, outcome
        model, outcome = unless_late(lambda: repaced(searched, at_end, progress), (searched, at_end))
    if outcome.ended:
        outcome = with_other_minima(model, outcome)
    if model.refusal and not np.isfinite(outcome.fitness):
        raise InputError(_refused(model))
    return model, outcome, stages


def _refused(model: ForwardModel) -> str:
    """Message that nothing could be simulated, with the remedy where the start of the search may be the cause."""
    middle = [name for name, parameter in model.problem.parameters.items() if parameter.start is None]
    if not middle:
        return model.refusal
    return f"parameters: give {', '.join(middle)} a `start` where the machine can be simulated ({model.refusal})"


def _best_so_far(model: ForwardModel) -> Outcome:
    """The best of the evaluations until now, or where the fit of the beginning had come to. Raises InputError."""
    counter, deadline = model.counter, model.deadline
    assert deadline is not None
    deadline.extend()
    best, fitness = counter.best, counter.best_value
    end, _, point = model.longest_fit
    message = f"stopped after {deadline.limit:g} s, before the method had ended"
    if end > 0.0:
        there = unless_late(lambda: float(model.cost(model.uncounted(point[None]))[0]), np.inf)
        if there < fitness:
            best, fitness, message = point, there, f"{message}: fitted on the first {end:.3g} s"
    if not np.isfinite(fitness):
        start = unless_late(lambda: starting_points(model)[:1], model.parameters.start[None])
        fitness = unless_late(lambda: float(model.fitness(start)[0]), np.inf)
        best, message = start[0], f"{message} or found more than a start"
    if not np.isfinite(fitness):
        slow = f"; a simulation takes about {deadline.cost:.2g} s" if deadline.cost > 0.1 * deadline.limit else ""
        raise InputError(f"time_limit: nothing was found in {deadline.limit:g} s{slow}; allow more, or a shorter part")
    rows = [(k, float(value), float(value)) for k, value in enumerate(counter.history[1])]
    return Outcome(best, fitness, rows, message, ended=False)
