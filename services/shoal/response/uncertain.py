"""The main path: scene, what is known of its parameters -> runs by a method -> bounds or statistics -> their errors."""

from __future__ import annotations

import hashlib
import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from shoal.arguments import check
from shoal.compile import clock
from shoal.engines import get_engine
from shoal.engines.contract import sampling_times
from shoal.engines.starts import Stated, Tally
from shoal.errors import ComputationError, InputError
from shoal.mechanics import reach
from shoal.memory import Memory
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
from shoal.response.inputs import Correlations, Inputs, Parameter
from shoal.response.kept import Keep, TimeIsUpError
from shoal.response.limits import MOST as LIMIT_RUNS
from shoal.response.limits import Judged, judge, read_limits
from shoal.response.limits.choice import get_way
from shoal.response.limits.crosschecked import allowing, crosschecked
from shoal.response.limits.judge import Reach, require, watched
from shoal.response.limits.limit import Limit
from shoal.response.limits.quantities import of_section
from shoal.response.machine import Machine
from shoal.response.model_errors import model_errors, unestimated
from shoal.response.read import parameters
from shoal.response.respond import MOST, Answer, respond
from shoal.response.result import Bounds, Response
from shoal.response.runs import Model
from shoal.scene import Scene
from shoal.scene.load import as_scene
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


def uncertain(
    scene: Scene | Mapping[str, Any] | str | Path,
    vary: Mapping[str, Any] | Sequence[str | Parameter],
    times: Sequence[float] | Array | None = None,
    *,
    values: Mapping[str, Any] | None = None,
    method: str = "auto",
    gap: float | None = None,
    correlations: Correlations | None = None,
    degree: int | None = None,
    count: int | None = None,
    tolerance: float | None = None,
    engine: str = "gauss",
    verify: bool = True,
    seed: int = 0,
    most: int = MOST,
    limits: Sequence[str] = (),
    requirements: Sequence[str] = (),
    limit_method: str = "auto",
    limit_runs: int = LIMIT_RUNS,
    allocate: bool = False,
    costs: Mapping[str, float] | None = None,
    target: float | None = None,
    checkpoint: Path | str | None = None,
    time_limit: float | None = None,
    progress: Callable[[int], None] | None = None,
) -> Response:
    """How the markers of a scene may move if some of its fields are known as intervals or distributions only.

    vary: path -> (low, high), a text such as "normal(1, 0.01)" or a frozen distribution of scipy, or a list of what
    `--vary` takes; times: instants [s], else the scene's own; method: one of `METHODS`; gap: between outer and attained
    bounds, as a share of the largest width, that must be reached; correlations: of pairs of random parameters;
    degree, count: of a method that has one; tolerance: error [m] that the markers of the middle machine may have, for
    which the cheapest model is found (runs that attain bounds are then repeated on a finer mesh); verify: estimate mesh
    and step errors of extremal runs; most: runs that may be made; limits: what must not happen, such as "B.y < -1.2";
    requirements: what must hold, such as "B.y > -1.2"; limit_method: one of `WAYS`; limit_runs: for each of them;
    allocate: look for the widest tolerances that keep the limit, with `costs` (by path, else 1) of tightening each;
    target: probability of passing it that is allowed, else `TARGET`; checkpoint: file that keeps the runs, from which
    the same study goes on; time_limit [s]: after which, compiling aside, it ends with what is known; progress: is told
    how many runs there are. Raises InputError, ComputationError.
    """
    begin = clock.now()
    check(gap=gap, degree=degree, count=count, tolerance=tolerance, seed=seed, most=most)
    check(limit_runs=limit_runs, target=target, time_limit=time_limit)
    for name, given in {"costs": costs, "target": target}.items():
        if given and not allocate:
            raise InputError(f"{name}: belongs to allocate, the search for the widest tolerances; ask for that too")
    for name, stated in {"limit_method": limit_method != "auto", "limit_runs": limit_runs != LIMIT_RUNS}.items():
        if stated and not limits and not requirements:
            raise InputError(f"{name}: belongs to a limit, whose probability it is for; state one, such as B.y < -1.2")
    end = None if time_limit is None else clock.now() + time_limit
    wanted = as_scene(scene)
    wanted = wanted.with_values(values) if values else wanted
    inputs = Inputs(parameters(vary, wanted), correlations)
    starts = Tally(Stated.of(wanted, [path for one in inputs.parameters for path in one.factors]))
    get_way(limit_method)
    # The start is stated, not a response: of the scene's own instants those after it count.
    when = sampling_times(wanted, times) if times is not None else sampling_times(wanted, None)[1:]
    asked = read_limits(limits, requirements, wanted)
    if allocate and len(asked) != 1:
        raise InputError(f"allocate: needs one limit, found {len(asked)}; state it with --require or --limit")
    costs_of(costs or {}, inputs)
    if tolerance is not None:
        wanted = _modelled(wanted, inputs, tolerance, when, engine, asked)
    keep = _keep(wanted, when, engine, checkpoint, end)
    machine = Machine(wanted, when, get_engine(engine), keep=keep, starts=starts)
    for one in asked:
        require(machine, one, inputs)
    count_t, count_m, count_q = machine.columns
    try:
        answer = respond(
            machine,
            inputs,
            count_t * count_m * count_q,
            method=method,
            groups=np.tile(np.arange(count_m * count_q), count_t),
            instants=np.repeat(when, count_m * count_q),
            gap=gap,
            degree=degree,
            count=count,
            seed=seed,
            most=most,
            progress=progress,
            over_time=lambda instants: replace(machine, times=instants, keep=None),
        )
    except TimeIsUpError:
        raise ComputationError("time-limit: it was over before the first runs were made") from None
    bounds = answer.bounds
    if bounds is not None and math.isfinite(answer.horizon):
        bounds = _beyond(wanted, inputs, bounds, machine)
    known = (
        model_errors(machine, answer.runs, _deciding(answer, seed))
        if verify and not keep.over
        else unestimated(machine)
    )
    bounds = None if bounds is None else known.of_bounds(bounds)
    judged, allocation, finer = list[Judged](), None, None
    try:
        if tolerance is not None and bounds is not None and verify and not keep.over:
            finer = repeated(machine, answer.runs)
        how = dict[str, Any](way=limit_method, most=limit_runs, seed=seed, verify=verify, progress=progress)
        for passed in asked:
            if inputs.mixed:
                judged.append(between(passed, machine, inputs, **how))
            else:
                found = judge(passed, machine, inputs, _reach(inputs, when, gap, seed, most), **how)
                shared = answer.found.indices is not None
                judged.append(crosschecked(found, machine, answer.drawn, shared=shared))
        if allocate:
            allocation = _allocated(judged[0], machine, costs or {}, TARGET if target is None else target, most, how)
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
    status, message = _status(answer, gap, known.rejected, judged)
    message = "; ".join([message] * bool(message) + lacks)
    if status in REFUSED:
        judged = [replace(told, kept=None) if told.kept else told for told in judged]
    if keep.over:
        missing = [one.text for one in asked[len(judged) :]]
        status, message = (
            "time-limit",
            f"the {time_limit:g} s were over"
            + (f"; nothing is known of {', '.join(missing)}" if missing else "")
            + ("; the same again goes on from here" if checkpoint else ""),
        )
    if status == "ok" and allocation is not None and not allocation.ok:
        status, message = "allocation-not-met", allocation.message
    response = Response(
        status=status,
        message=message,
        scene=wanted.name,
        method=method,
        why=answer.found.why,
        inputs=inputs,
        times=when,
        markers=tuple(wanted.markers),
        quantities=machine.quantities,
        evaluations=answer.runs.evaluations,
        repeated=answer.runs.repeated,
        failed=answer.runs.failed,
        seed=seed,
        wall_s=clock.now() - begin,
        horizon=min(answer.horizon, float(when[-1])),
        bounds=bounds,
        statistics=statistics,
        errors=known.budget,
        model=known.columns,
        stated=wanted,
        engine=engine,
        limits=tuple(judged),
        allocation=allocation,
        boxes=boxes,
        finer=finer,
        controls=answer.runs.controls,
        elsewhere=starts.elsewhere,
    )
    if status == "gap-not-reached" and bounds is not None and gap is not None:
        response = replace(response, message=message + _named(response.missed(gap)))
    return response


def _named(missed: Mapping[str, float]) -> str:
    """The first of what missed a gap, in words."""
    told = ", ".join(f"{name} {gap:.1e}" for name, gap in list(missed.items())[:NAMED])
    more = f" and {len(missed) - NAMED} more" if len(missed) > NAMED else ""
    return f": {told}{more}" if told else ""


def _beyond(scene: Scene, inputs: Inputs, bounds: Bounds, machine: Machine) -> Bounds:
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


def _deciding(answer: Answer, seed: int) -> list[int]:
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
    stated: Judged, machine: Machine, costs: Mapping[str, float], target: float, most: int, how: Mapping[str, Any]
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


def _status(answer: Answer, gap: float | None, rejected: str, judged: Sequence[Judged]) -> tuple[str, str]:
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
