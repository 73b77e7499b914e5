"""The main path: problem -> measurement -> method -> estimate with intervals and a verdict."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Mapping
from contextlib import closing, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from shoal.arguments import check
from shoal.compile import clock
from shoal.engines import get_engine
from shoal.errors import InputError
from shoal.identification.adapt import AdaptedModel, Stopped, coarse_to_fine
from shoal.identification.carried import Carried
from shoal.identification.conclude import NOTHING, Wishes, conclude
from shoal.identification.deadline import Deadline, TimeIsUp, unless_late
from shoal.identification.diagnostics.minima.search import with_other_minima
from shoal.identification.estimate import Estimate
from shoal.identification.forward import ForwardModel
from shoal.identification.measure import Windows, measure
from shoal.identification.methods import Method, Outcome, get_method
from shoal.identification.methods.starts import starting_points
from shoal.identification.pace import paced, repaced
from shoal.identification.problem import Problem
from shoal.identification.recording.measurement import Measurement
from shoal.identification.recording.plausible import check_constant
from shoal.identification.recording.source import EngineSource
from shoal.identification.spread.posterior import require_sampler
from shoal.memory import Memory
from shoal.trajectory import Array
from shoal.versions import versions

Watch = Callable[[int, float, float, int], None]
"""Called with (iteration, best fitness, mean fitness of the iteration, evaluations so far)."""

_WORTH_A_NOTE = 1.0
"""Seconds of compiling."""


def identify(
    problem: Problem,
    *,
    method: str | None = None,
    data: str | Mapping[str, str] | None = None,
    engine: str = "gauss",
    values: Mapping[str, Any] | None = None,
    fitted: Carried | None = None,
    hold_out: Windows | Mapping[str, Windows] | None = None,
    seed: int = 0,
    measurement: Measurement | None = None,
    tolerance: float | None = None,
    time_limit: float | None = None,
    checkpoint: Path | None = None,
    wishes: Wishes = NOTHING,
    progress: Watch = lambda *_: None,
) -> Estimate:
    """Find the parameters of a problem.

    method: one of METHODS, else the problem's; data: recordings instead of the problem's own (see `measure`);
    values: fields of the scene to set; fitted: values found before, starts of what is sought here, else set unless
    `values` sets them; measurement: one made earlier, to share it between methods;
    tolerance: error [m] that the model may have at the markers, for which elements, integrator and step are chosen
    instead of taken from the scene (coarse while searching);
    hold_out: windows that are predicted instead of fitted (see `measure`);
    time_limit [s]: of everything but data that are computed and kernels that are compiled; then the best so far is the
    answer; checkpoint: file of evaluations, which a run that was broken off finds when it is started again;
    wishes: what is to be known beyond the answer;
    progress: is told how the search goes. Raises InputError, ComputationError.
    """
    begun_at, counted_from = time.monotonic(), clock.now()
    check(seed=seed, tolerance=tolerance, time_limit=time_limit, bootstrap=wishes.bootstrap, sample=wishes.sample)
    name = method or problem.method
    search = get_method(name)
    if tolerance is not None and engine != "gauss":
        raise InputError(f"tolerance: models are chosen for engine gauss only, found engine {engine!r}")
    if wishes.sample:
        require_sampler()
    notes: list[str] = []
    if fitted is not None:
        problem, values, notes = fitted.into(problem, values)
    scene = problem.load_scene(values)
    deadline = None if time_limit is None else Deadline(time_limit)
    computed = any(isinstance(source, EngineSource) for source in problem.sources.values())
    # Data that were computed with the scene's step are not to be fitted with another.
    paces = tolerance is None and not computed
    with deadline.paused() if deadline is not None else nullcontext():
        if measurement is None:
            # Data are computed with the problem's values, not the user's.
            measurement = measure(problem, problem.load_scene(), data, hold_out)
        model = ForwardModel(problem, scene, get_engine(engine), measurement, deadline)
        if deadline is not None:
            model.warm_up()
    model, begun = _assembled(model)
    notes += begun
    unless_late(lambda: check_constant(model.measurement, model.at_start), None)
    if paces:
        model = _paced(model)
    if checkpoint is not None:
        model.memory = Memory(checkpoint, _fingerprint(model, name, seed, tolerance))
    with nullcontext() if model.memory is None else closing(model.memory):
        begin = clock.now()
        model, outcome, stages = _search(model, search, np.random.default_rng(seed), tolerance, paces, progress)
        wall = clock.now() - begin
        estimate = _concluded(model, outcome, name, seed, wall, stages, wishes)
    compiled = time.monotonic() - begun_at - (clock.now() - counted_from)
    if deadline is not None and compiled >= _WORTH_A_NOTE:
        notes.append(f"compiling kernels took {compiled:.0f} s, which the limit of {deadline.limit:g} s does not count")
    return replace(estimate, notes=[*notes, *estimate.notes])


def _concluded(model: ForwardModel, outcome: Outcome, *how: Any) -> Estimate:
    """The estimate of an outcome; where the time ends while it is made, what needs no further run."""
    try:
        return conclude(model, outcome, *how)
    except TimeIsUp:
        assert model.deadline is not None
        model.deadline.spend()
        return conclude(model, replace(outcome, ended=False, message="no time was left to judge the answer"), *how)


def _assembled(model: ForwardModel) -> tuple[ForwardModel, list[str]]:
    """The model, begun from the scene's own values where those it begins from close no loop, and a note if so."""
    sought = dict(model.problem.parameters)
    for name, parameter in sought.items():
        own = None if parameter.path is None or parameter.of_measurement else model.scene.value(parameter.path)
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


def _paced(model: ForwardModel) -> ForwardModel:
    """With the step that suits the noise where the search begins."""
    return unless_late(lambda: paced(model, starting_points(model)[0]), model)


def _search(
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
    """Why nothing could be simulated, and what to state where that may be due to where the search began."""
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
    end, _, reached = model.reached
    message = f"stopped after {deadline.limit:g} s, before the method had ended"
    if end > 0.0:
        there = unless_late(lambda: float(model.cost(model.uncounted(reached[None]))[0]), np.inf)
        if there < fitness:
            best, fitness, message = reached, there, f"{message}: fitted on the first {end:.3g} s"
    if not np.isfinite(fitness):
        start = unless_late(lambda: starting_points(model)[:1], model.parameters.start[None])
        fitness = unless_late(lambda: float(model.fitness(start)[0]), np.inf)
        best, message = start[0], f"{message} or found more than a start"
    if not np.isfinite(fitness):
        slow = f"; a simulation takes about {deadline.cost:.2g} s" if deadline.cost > 0.1 * deadline.limit else ""
        raise InputError(f"time_limit: nothing was found in {deadline.limit:g} s{slow}; allow more, or a shorter part")
    rows = [(k, float(value), float(value)) for k, value in enumerate(counter.history[1])]
    return Outcome(best, fitness, rows, message, ended=False)


def _fingerprint(model: ForwardModel, method: str, seed: int, tolerance: float | None) -> str:
    """Of everything that the evaluations of a run depend on."""
    parts: list[Any] = [model.problem.model_dump_json(), model.scene.fingerprint, model.engine.name, method, seed]
    parts += [tolerance, versions(("numpy", "numba", "shoal"))]
    text = hashlib.sha256(repr(parts).encode())
    for recording in model.measurement.recordings.values():
        text.update(recording.times.tobytes() + recording.values.tobytes())
    return text.hexdigest()[:32]
