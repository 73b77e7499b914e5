"""The main path: problem -> measurement -> method -> estimate with intervals and a verdict."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Mapping
from contextlib import closing, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from shoal.arguments import check
from shoal.compile import clock
from shoal.engines import get_engine
from shoal.errors import InputError
from shoal.evaluation_cache import EvaluationCache
from shoal.identification.carried import Carried
from shoal.identification.conclude import DEFAULTS, Options, conclude
from shoal.identification.deadline import Deadline, TimeIsUp, unless_late
from shoal.identification.estimate import Estimate
from shoal.identification.forward import ForwardModel
from shoal.identification.measure import Windows, measure
from shoal.identification.methods import Outcome, get_method
from shoal.identification.problem import Problem
from shoal.identification.recording.measurement import Measurement
from shoal.identification.recording.plausible import check_constant
from shoal.identification.recording.source import EngineSource
from shoal.identification.run_method import Watch, assembled, run_method, with_step
from shoal.identification.uncertainty.posterior import require_sampler
from shoal.versions import versions

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
    options: Options = DEFAULTS,
    progress: Watch = lambda *_: None,
) -> Estimate:
    """Find the parameters of a problem.

    method: one of METHODS, else the problem's; data: recordings instead of the problem's own (see `measure`);
    values: fields of the scene to set; fitted: values found before, starts of parameters sought here, else set unless
    `values` sets them; measurement: one made earlier, to share it between methods;
    tolerance: error [m] that the model may have at the markers, for which elements, integrator and step are chosen
    instead of taken from the scene (coarse while searching);
    hold_out: windows that are predicted instead of fitted (see `measure`);
    time_limit [s]: of everything but data that are computed and kernels that are compiled; then the best so far is the
    answer; checkpoint: file of evaluations, which a run that was broken off finds when it is started again;
    options: results that are computed in addition to the answer;
    progress: called with the state of the search. Raises InputError, ComputationError.
    """
    begun_at, counted_from = time.monotonic(), clock.now()
    check(seed=seed, tolerance=tolerance, time_limit=time_limit, bootstrap=options.bootstrap, sample=options.sample)
    name = method or problem.method
    search = get_method(name)
    if tolerance is not None and engine != "gauss":
        raise InputError(f"tolerance: models are chosen for engine gauss only, found engine {engine!r}")
    if options.sample:
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
    model, begun = assembled(model)
    notes += begun
    unless_late(lambda: check_constant(model.measurement, model.at_start), None)
    if paces:
        model = with_step(model)
    if checkpoint is not None:
        model.memory = EvaluationCache(checkpoint, _fingerprint(model, name, seed, tolerance))
    with nullcontext() if model.memory is None else closing(model.memory):
        begin = clock.now()
        model, outcome, stages = run_method(model, search, np.random.default_rng(seed), tolerance, paces, progress)
        wall = clock.now() - begin
        estimate = _concluded(model, outcome, name, seed, wall, stages, options)
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


def _fingerprint(model: ForwardModel, method: str, seed: int, tolerance: float | None) -> str:
    """Hash of everything that the evaluations of a run depend on."""
    parts: list[Any] = [model.problem.model_dump_json(), model.scene.fingerprint, model.engine.name, method, seed]
    parts += [tolerance, versions(("numpy", "numba", "shoal"))]
    text = hashlib.sha256(repr(parts).encode())
    for recording in model.measurement.recordings.values():
        text.update(recording.times.tobytes() + recording.values.tobytes())
    return text.hexdigest()[:32]
