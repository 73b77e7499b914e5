"""The main path: scene, what is known of its parameters -> runs by a method -> bounds or statistics -> their errors."""

from __future__ import annotations

import hashlib
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from shoal.compile import clock
from shoal.engines import get_engine
from shoal.engines.contract import sampling_times
from shoal.engines.starts import StatedStart, Tally
from shoal.errors import ComputationError, InputError
from shoal.mechanics import reach
from shoal.memory import Memory
from shoal.requests.uncertain import Uncertain
from shoal.response.allocation import (
    TARGET,
    Allocation,
    Reached,
    accepted,
    costs_of,
    of_intervals,
)
from shoal.response.allocation_of_random import of_random
from shoal.response.attained import DRAWN
from shoal.response.between import between
from shoal.response.boxes import HOPELESS
from shoal.response.finer import repeated
from shoal.response.inputs import Inputs
from shoal.response.kept import Keep, TimeIsUpError
from shoal.response.limits import Judged, judge, read_limits
from shoal.response.limits.choice import get_way
from shoal.response.limits.crosschecked import allowing, crosschecked
from shoal.response.limits.judge import Reach, require, watched
from shoal.response.limits.limit import Limit
from shoal.response.limits.quantities import of_section
from shoal.response.machine import ResponseModel
from shoal.response.model_errors import model_errors, unestimated
from shoal.response.read import parameters
from shoal.response.respond import ModelResponse, respond
from shoal.response.result import Bounds, Response
from shoal.response.runs import Model
from shoal.scene import Scene
from shoal.trajectory import Array
from shoal.versions import versions

CHECKED = 6
"""Extremal runs, or drawn ones, that are looked at by more careful runs."""
UNRESOLVED = 1e-8
"""Runs that differ by less than this share of a limit's quantity differ by the errors of their steps."""
REFUSED = "failed-runs", "model-rejected", "beyond-horizon"
"""Where the answer is not believed, nor is that a limit is kept, as runs show only that one is passed."""
NAMED = 3
"""Of what missed the gap asked for, in the message."""


def uncertain(asked: Uncertain, scene: Scene) -> Response:
    """How the markers of a scene may move if some of its fields are known as intervals or distributions only.

    scene: that of the request, with its fields set. Raises InputError, ComputationError.
    """
    begin = clock.now()
    end = None if asked.time_limit is None else clock.now() + asked.time_limit
    wanted = scene
    inputs = Inputs(parameters(asked.vary, wanted), asked.correlate or None)
    starts = Tally(StatedStart.of(wanted, [path for one in inputs.parameters for path in one.factors]))
    get_way(asked.limit_method)
    # The start is stated, not a response: of the scene's own instants those after it count.
    when = sampling_times(wanted, asked.at) if asked.at is not None else sampling_times(wanted, None)[1:]
    conditions = read_limits(asked.limit, asked.require, wanted)
    costs_of(asked.cost or {}, inputs)
    if asked.tolerance is not None:
        wanted = _modelled(wanted, inputs, asked.tolerance, when, asked.engine, conditions)
    keep = _keep(wanted, when, asked.engine, asked.checkpoint, end)
    machine = ResponseModel(wanted, when, get_engine(asked.engine), keep=keep, starts=starts)
    for one in conditions:
        require(machine, one, inputs)
    count_t, count_m, count_q = machine.columns
    try:
        answer = respond(
            machine,
            inputs,
            count_t * count_m * count_q,
            method=asked.method,
            groups=np.tile(np.arange(count_m * count_q), count_t),
            instants=np.repeat(when, count_m * count_q),
            gap=asked.gap,
            degree=asked.degree,
            count=asked.count,
            seed=asked.seed,
            most=asked.runs,
            progress=asked.progress,
            over_time=lambda instants: replace(machine, times=instants, keep=None),
        )
    except TimeIsUpError:
        raise ComputationError("time-limit: it was over before the first runs were made") from None
    bounds = answer.bounds
    if bounds is not None and math.isfinite(answer.horizon):
        bounds = _beyond(wanted, inputs, bounds, machine)
    known = (
        model_errors(machine, answer.runs, _deciding(answer, asked.seed))
        if asked.verify and not keep.over
        else unestimated(machine)
    )
    bounds = None if bounds is None else known.of_bounds(bounds)
    judged, allocation, finer = list[Judged](), None, None
    try:
        if asked.tolerance is not None and bounds is not None and asked.verify and not keep.over:
            finer = repeated(machine, answer.runs)
        same = {name: getattr(asked, name) for name in ("seed", "verify", "progress")}
        how = {"way": asked.limit_method, "most": asked.limit_runs, **same}
        for passed in conditions:
            if inputs.mixed:
                judged.append(between(passed, machine, inputs, **how))
            else:
                found = judge(passed, machine, inputs, _reach(inputs, when, asked.gap, asked.seed, asked.runs), **how)
                shared = answer.found.indices is not None
                judged.append(crosschecked(found, machine, answer.drawn, shared=shared))
        if asked.allocate:
            target = TARGET if asked.target is None else asked.target
            allocation = _allocated(judged[0], machine, asked.cost or {}, target, asked.runs, how)
    except TimeIsUpError:
        pass
    finally:
        keep.close()
    statistics = None if answer.statistics is None else known.of_statistics(answer.statistics)
    boxes = None if answer.boxes is None else known.of_boxes(answer.boxes)
    lacks = list[str]()
    for told in judged:
        if statistics is not None and told.passing is not None and not told.doubt:
            statistics, lack = allowing(statistics, machine, told.limit, told.passing.estimate)
            lacks += [lack] if lack else []
    status, message = _status(answer, asked.gap, known.rejected, judged)
    message = "; ".join([message] * bool(message) + lacks)
    if status in REFUSED:
        judged = [replace(told, kept=None) if told.kept else told for told in judged]
    if keep.over:
        missing = [one.text for one in conditions[len(judged) :]]
        status, message = (
            "time-limit",
            f"the {asked.time_limit:g} s were over"
            + (f"; nothing is known of {', '.join(missing)}" if missing else "")
            + ("; the same again goes on from here" if asked.checkpoint else ""),
        )
    if status == "ok" and allocation is not None and not allocation.ok:
        status, message = "allocation-not-met", allocation.message
    response = Response(
        status=status,
        message=message,
        scene=wanted.name,
        method=asked.method,
        why=answer.found.why,
        inputs=inputs,
        times=when,
        markers=tuple(wanted.markers),
        quantities=machine.quantities,
        evaluations=answer.runs.evaluations,
        repeated=answer.runs.repeated,
        failed=answer.runs.failed,
        seed=asked.seed,
        wall_s=clock.now() - begin,
        horizon=min(answer.horizon, float(when[-1])),
        bounds=bounds,
        statistics=statistics,
        errors=known.budget,
        model=known.columns,
        stated=wanted,
        engine=asked.engine,
        limits=tuple(judged),
        allocation=allocation,
        boxes=boxes,
        finer=finer,
        controls=answer.runs.controls,
        elsewhere=starts.elsewhere,
    )
    if status == "gap-not-reached" and bounds is not None and asked.gap is not None:
        response = replace(response, message=message + _named(response.missed(asked.gap)))
    return response


def _named(missed: Mapping[str, float]) -> str:
    """The first of what missed a gap, in words."""
    told = ", ".join(f"{name} {gap:.1e}" for name, gap in list(missed.items())[:NAMED])
    more = f" and {len(missed) - NAMED} more" if len(missed) > NAMED else ""
    return f": {told}{more}" if told else ""


def _beyond(scene: Scene, inputs: Inputs, bounds: Bounds, machine: ResponseModel) -> Bounds:
    """Outer bounds that are the kinematic reach beyond the horizon, where there is one; angles have none."""
    ends = inputs.values(np.array([-np.ones(len(inputs)), np.ones(len(inputs))]))
    length = max(float(np.max(reach.size(scene.with_lanes(ends)))), 0.0) if reach.tethered(scene) else math.inf
    anchors = reach.anchors(scene)
    far = np.full((*machine.columns, 2), math.nan)
    for axis in range(scene.dimensions):
        far[:, :, axis, 0] = anchors[:, axis].min() - reach.MARGIN * length
        far[:, :, axis, 1] = anchors[:, axis].max() + reach.MARGIN * length
    late = np.repeat(machine.times > bounds.horizon, int(np.prod(machine.columns[1:])))
    lower, upper = bounds.lower_outer.copy(), bounds.upper_outer.copy()
    lower[late], upper[late] = far.reshape(-1, 2)[late].T
    return replace(bounds, lower_outer=lower, upper_outer=upper)


def _deciding(answer: ModelResponse, seed: int) -> list[int]:
    """The runs that attain most bounds, or some that were drawn."""
    runs = answer.runs
    if answer.bounds is None:
        drawn = np.random.default_rng(seed).choice(len(runs.germs), min(CHECKED, len(runs.germs)), False)
        return list(drawn.tolist())
    used = Counter([*runs.values.argmin(axis=0).tolist(), *runs.values.argmax(axis=0).tolist()])
    return [run for run, _ in used.most_common(CHECKED)]


def _keep(scene: Scene, times: Array, engine: str, checkpoint: Path | str | None, end: float | None) -> Keep:
    """Raises InputError."""
    if checkpoint is None:
        return Keep(None, end)
    study = repr((scene.fingerprint, times.tolist(), engine, versions(("shoal",))))
    return Keep(Memory(Path(checkpoint), hashlib.sha1(study.encode()).hexdigest(), "study"), end)


def _reach(inputs: Inputs, when: Array, gap: float | None, seed: int, most: int) -> Reach:
    """Bounds of the margins of a model over time."""

    def reach(model: Model, size: float) -> tuple[Array, Array, Array, int, int]:
        answer = respond(
            model, inputs, len(when), groups=np.zeros(len(when)), instants=when, gap=gap, seed=seed, most=most
        )
        bounds, runs = answer.bounds, answer.runs
        assert bounds is not None
        outer = np.where(when <= bounds.horizon, bounds.lower_outer, -math.inf)
        values = runs.values
        spread = values.max(axis=0) - values.min(axis=0)
        if spread.max() <= UNRESOLVED * max(size, np.abs(values).max()):
            # No surrogate foretells how the steps of a solver fall: an energy that is the same in all runs.
            outer = bounds.lower - spread
        return bounds.lower, outer, runs.germs[runs.values.argmin(axis=0)], runs.evaluations, runs.failed

    return reach


def _allocated(
    stated: Judged, machine: ResponseModel, costs: Mapping[str, float], target: float, most: int, how: Mapping[str, Any]
) -> Allocation:
    """The cheapest tolerances that keep a limit. stated: what is known of it with those that are stated."""
    wanted, inputs, seed = stated.limit, stated.inputs, how["seed"]
    prices, widest = costs_of(costs, inputs), accepted(machine.scene, inputs)
    if inputs.random.any():
        return of_random(wanted, machine, inputs, stated, target, prices, widest, **how)
    # Tolerances that keep the limit keep it by the known error of the model.
    told, when = watched(machine, wanted.tightened(stated.errors.total or 0.0)), machine.times

    def least(here: Inputs) -> Reached:
        lower, outer, germs, evaluations, _ = _reach(here, when, None, seed, most)(told, abs(wanted.bound))
        worst = int(lower.argmin())
        return Reached(float(outer.min()), float(lower[worst]), germs[worst], evaluations)

    return of_intervals(wanted.required, told, inputs, least, prices, widest)


def _status(answer: ModelResponse, gap: float | None, rejected: str, judged: Sequence[Judged]) -> tuple[str, str]:
    """ok, or what speaks against believing the answer, and why."""
    runs, bounds = answer.runs, answer.bounded
    if runs.failed:
        failed = f"{runs.failed} of {runs.evaluations} runs failed even with smaller steps: {runs.why}"
        return "failed-runs", f"{failed}; they have {runs.describe_failed()}"
    if rejected:
        return "model-rejected", rejected
    if answer.boxes is not None and math.isfinite(answer.horizon):
        return "beyond-horizon", (
            f"statistics are known until {answer.horizon:g} s; beyond, no polynomial tells them, and what is told are "
            f"their extremes over {answer.boxes.places} interval values with {answer.boxes.inner} runs each"
            if answer.boxes.places
            else f"statistics are known until {answer.horizon:g} s; beyond, what is told is not to be believed"
        )
    if math.isfinite(answer.horizon):
        return "beyond-horizon", (
            f"bounds hold until {answer.horizon:g} s; beyond, small changes of the parameters change everything, and "
            "what is told is what runs attained, how far the machine reaches, and, if every value is as likely as "
            f"another, where with 95 % confidence 95 % of all runs lie ({DRAWN} random runs)"
        )
    if bounds is not None and gap is not None and not bounds.gap <= gap:
        found = "is not known" if math.isnan(bounds.gap) else f"is {bounds.gap:.1e} of the width"
        return "gap-not-reached", f"the gap between outer and attained bounds {found}, asked for {gap:g}"
    if answer.boxes is not None and answer.boxes.std_gap > HOPELESS:
        return "deviation-in-doubt", (
            f"deviations are known to {answer.boxes.std_gap:.1e} of their size only, within the outer values; more "
            "runs or narrower intervals tell more"
        )
    doubts = [one.doubt for one in judged if one.doubt]
    if doubts:
        return "limit-in-doubt", "; ".join(doubts)
    if bounds is not None and math.isnan(bounds.gap):
        return "ok", "bounds are what runs attained; this method cannot tell how far beyond them others lie"
    return "ok", ""


def _modelled(
    scene: Scene, inputs: Inputs, tolerance: float, times: Array, engine: str, asked: Sequence[Limit]
) -> Scene:
    """The cheapest model for the machine in the middle that tells what is asked."""
    from shoal.selection import select

    if engine != "gauss":
        raise InputError(f"tolerance: models are chosen for engine gauss only, found engine {engine!r}")
    middle = inputs.values(inputs.germs(np.full((1, len(inputs)), 0.5)))
    sections = (scene.markers[one.place].body for one in asked if of_section(one.quantity, scene))
    middling = scene.with_values({path: float(at[0]) for path, at in middle.items()})
    selection = select(middling, tolerance, times, meshed=tuple(sections))
    if not selection.met:
        raise ComputationError(f"tolerance: no model within {tolerance:g} m: {selection.reason}")
    stated = {path: scene.value(path) for path in middle}
    return selection.chosen.scene.with_values(stated)
