"""Assessment of a limit of a machine: its probability, or its worst margin over interval values."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from shoal.engines.contract import Engine
from shoal.engines.verification import run_verified
from shoal.errors import ComputationError, InputError
from shoal.response.inputs import Inputs
from shoal.response.limits.choice import get_way, probability
from shoal.response.limits.limit import Limit, margin_errors
from shoal.response.limits.margins import Margins
from shoal.response.limits.result import LimitResult, VerifiedRun
from shoal.response.machine import ResponseModel, stable
from shoal.response.runs import Model
from shoal.scene import Scene
from shoal.trajectory import Array, Trajectory

MOST = 5_000
"""Runs for the probability of a limit unless another number is asked for."""
FINER = 200
"""Instants at which the run nearest to a limit is evaluated, from the first instant to the last,"""
CLOSER = 3
"""and so often at most, each time between the two where it may come nearest, such as where a quantity changes sign."""
Reach = Callable[[Model, float], tuple[Array, Array, Array, int, int]]
"""Of the margins of a model over time, from a bound of some size: the least that runs attain, that may be, (instants,);
the standardised variables of the former, (instants, parameters); runs made, and how many failed."""


@dataclass(frozen=True)
class MarginWatch:
    """Margins of a limit at the last instants of a trajectory."""

    limit: Limit
    instants: int

    def margins(self, motion: Trajectory, scene: Scene, values: Mapping[str, Array]) -> Array:
        """Return the margins of every lane, (lanes, instants). Raises InputError."""
        return self.limit.margins(motion, scene, values)[:, -self.instants :]


def watched(machine: ResponseModel, limit: Limit) -> ResponseModel:
    """Return the machine with the margins of a limit as its answers."""
    return replace(
        machine,
        scene=limit.scene(machine.scene),
        times=limit.instants(machine.times),
        engine=limit.engine(machine.engine, machine.scene),
        reduce=MarginWatch(limit, len(machine.times)).margins,
    )


def require(machine: ResponseModel, limit: Limit, inputs: Inputs) -> None:
    """Check by a run in the middle that the machine gives the quantity of a limit. Raises InputError."""
    if limit.is_dynamic:
        middle = inputs.values(inputs.quantiles(np.full((1, len(inputs)), 0.5)))
        watched(replace(machine, keep=None), limit)(middle)


def _show(limit: Limit, machine: ResponseModel, inputs: Inputs, xi: Array, verify: bool) -> VerifiedRun:
    """Run the machine once more at xi; a run that is refused costs the other answers nothing and is a doubt."""
    named = inputs.named(xi[None])[0]
    try:
        return _run_shown(limit, machine, inputs, named, verify)
    except (InputError, ComputationError) as error:
        values = dict(zip(inputs.names, named.tolist(), strict=True))
        return VerifiedRun(values, inputs.at(named), math.nan, math.nan, "refused", str(error))


def _run_shown(limit: Limit, machine: ResponseModel, inputs: Inputs, named: Array, verify: bool) -> VerifiedRun:
    """Run the machine at the decisive values. Raises InputError, ComputationError."""
    if verify:
        return show(limit, machine.scene, machine.times, machine.engine, inputs, named)
    scene = limit.scene(machine.scene.with_values(inputs.at(named)))
    engine, when = limit.engine(machine.engine, scene), limit.instants(machine.times)
    motion, settings = stable(scene, lambda one: engine.simulate(one, when))
    return _shown(limit, machine.times, inputs, named, scene, motion, settings)


def judge(
    limit: Limit,
    machine: ResponseModel,
    inputs: Inputs,
    reach: Reach,
    *,
    way: str = "auto",
    most: int = MOST,
    seed: int = 0,
    verify: bool = True,
    progress: Callable[[int], None] | None = None,
) -> LimitResult:
    """Assess a limit: probability of random parameters, bounds of the margin over intervals.

    Where there are both, see `response.assess.between`. reach: bounds a model; way: one of `WAYS`; most: runs for a
    probability. Raises InputError, ComputationError.
    """
    get_way(way)
    model, times = watched(machine, limit), machine.times
    if inputs.random.all():
        margins = Margins(model, inputs, most, progress)
        exceedance = probability(margins, way, seed)
        shown, shifted = None, None
        if exceedance.shown is not None:
            shown = _show(limit, machine, inputs, inputs.standard(exceedance.shown[None])[0], verify)
        if exceedance.sample is not None and shown is not None and shown.errors is not None:
            shifted = exceedance.sample.shifted(shown.errors.over_time)
        nan, exceedance = float("nan"), replace(exceedance, sample=None)  # which takes much room
        return LimitResult(
            *(limit, way, inputs, times, exceedance, None, nan, nan),
            *(shown, margins.evaluations, margins.failed, margins.why),
            shifted=shifted,
        )
    lower, outer, xi, evaluations, failed = reach(model, abs(limit.bound))
    worst = int(lower.argmin())
    shown = _show(limit, machine, inputs, xi[worst], verify)
    off = np.zeros(1) if shown.errors is None else shown.errors.over_time
    kept = _decided(lower + off, outer - off)
    hidden = kept is None and _decided(lower, outer) is not None
    if shown.errors is not None and shown.errors.unknown:
        kept, hidden = None, True
    if verify and shown.status == "ok" and kept is not False and 1 < len(times) < FINER:
        shown = replace(shown, between=_between(limit, machine, shown))
    return LimitResult(
        *(limit, "bounds", inputs, times, None, kept, float(lower[worst]), float((outer - off).min())),
        *(shown, evaluations, failed, ""),
        hidden=hidden,
    )


def _decided(attained: Array, outer: Array) -> bool | None:
    """Return whether a limit is kept by margins over time: those that a run attains, and those that any may have."""
    return False if attained.min() < 0 else True if outer.min() >= 0 else None


def _between(limit: Limit, machine: ResponseModel, shown: VerifiedRun) -> float | None:
    """Return the first instant [s] at which a run exceeds a limit between those of a machine; None if at none."""
    begin, end = float(machine.times[0]), float(machine.times[-1])
    scene = limit.scene(machine.scene.with_values(shown.values))
    engine = limit.engine(machine.engine, scene)
    for _ in range(CLOSER):
        when = np.linspace(begin, end, FINER)
        motion = engine.simulate(scene, limit.instants(when))
        if not motion.ok:
            return None
        margins = MarginWatch(limit, len(when)).margins(motion, scene, {})[0]
        if (beyond := margins < 0).any():
            return float(when[beyond.argmax()])
        steps = np.abs(np.diff(margins))
        # As steep as beside it, the margin may go down so far before the next instant.
        within = margins - np.maximum(np.append(steps, 0.0), np.append(0.0, steps))
        nearest = int(within.argmin())
        if within[nearest] >= 0:
            return None
        begin, end = float(when[max(nearest - 1, 0)]), float(when[min(nearest + 1, FINER - 1)])
    return None


def show(limit: Limit, scene: Scene, times: Array, engine: Engine, inputs: Inputs, named: Array) -> VerifiedRun:
    """Run a scene once more, with care, with these values of the parameters, (parameters,). Raises InputError."""
    here = limit.scene(scene.with_values(inputs.at(named)))
    able, when = limit.engine(engine, here), limit.instants(times)
    (motion, verification), settings = stable(here, lambda one: run_verified(able, one, when))
    shown = _shown(limit, times, inputs, named, here, motion, settings)
    return replace(shown, errors=margin_errors(limit, verification, len(times)))


def _shown(
    limit: Limit,
    times: Array,
    inputs: Inputs,
    named: Array,
    scene: Scene,
    motion: Trajectory,
    settings: Mapping[str, float],
) -> VerifiedRun:
    margins = MarginWatch(limit, len(times)).margins(motion, scene, {})[0]
    instant = int(np.argmin(margins))
    return VerifiedRun(
        dict(zip(inputs.names, named.tolist(), strict=True)),
        {**inputs.at(named), **settings},
        float(times[instant]),
        float(margins[instant]),
        str(motion.status[0]),
        motion.message,
    )
