"""From where a method ended to an estimate: intervals, what is identifiable, residuals, and the verdict."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from shoal.identification.adapt import Stage
from shoal.identification.bootstrap import bootstrap
from shoal.identification.covariance import blocks_of
from shoal.identification.curvature import bent, by_profile
from shoal.identification.deadline import unless_late
from shoal.identification.estimate import Estimate, Value, Verdict
from shoal.identification.forward import ForwardModel, accepts
from shoal.identification.judge import Judgement, few, judge
from shoal.identification.methods import Outcome
from shoal.identification.methods.lanes import Descent, descend_many
from shoal.identification.model_error import Corrections, ModelError, model_error, rms_of
from shoal.identification.problem import RESERVED
from shoal.identification.profiles import Profile, profiles
from shoal.identification.rank import combinations
from shoal.identification.residual_tests import ResidualTests, residual_tests
from shoal.identification.rivals import valley
from shoal.identification.sensitivity import Sensitivity, believed
from shoal.identification.uncertainty import Linearisation, Spread, autocorrelation, linearise, spread
from shoal.identification.units import unit
from shoal.scene import Rod, Scene, expression
from shoal.trajectory import Array

_NOTICED = 0.1
"""Of half an interval: a contribution to it that is worth a word."""
_ALIKE = 3.0
"""A residual within this factor of the mesh error is explained by it."""


_LOWER = 1e-6
"""Of the fitness: an answer that is better by more is another one."""
_ROUNDS = 2
"""How often an answer moves on to a better minimum that was met."""


@dataclass(frozen=True)
class Wishes:
    """What a user wants to know beyond the answer.

    profiles: whether every parameter gets its profile likelihood; bootstrap: how many draws
    """

    profiles: bool = False
    bootstrap: int = 0


NOTHING = Wishes()


def conclude(
    model: ForwardModel,
    outcome: Outcome,
    method: str,
    seed: int,
    wall: float,
    stages: list[Stage],
    wishes: Wishes,
    rounds: int = _ROUNDS,
) -> Estimate:
    """The estimate of an outcome. The runs it takes are not counted: no method is charged for them.

    Where what looks for the cause of a misfit meets a better minimum, that one is concluded from, so many times.
    """
    searched, point, measurement = model, outcome.point, model.measurement
    model = replace(model, memory=None, whole=None)
    if model.deadline is not None:
        model.deadline.extend()
    # The intervals look at the neighbourhood of the answer.
    looked = unless_late(lambda: believed(model, point), None)
    seen = looked or _unseen(model)
    if looked is None:
        outcome = replace(outcome, ended=False, message=outcome.message or "no time was left for the intervals")
    possible = bool(np.all(np.isfinite(seen.residual)))
    if not possible:
        seen = replace(seen, residual=np.zeros_like(seen.residual), jacobian=np.zeros_like(seen.jacobian))
    blocks = blocks_of(model, len(seen.residual))
    at = linearise(seen.jacobian, seen.residual, model.sizes(point), blocks)
    predicted = {name: _predicted(model, point, name) for name in measurement.recordings}
    nothing = ModelError(None, None)
    error = (
        unless_late(lambda: model_error(model, point, predicted, seen.residual), nothing)
        if possible and looked
        else nothing
    )
    correction = error.corrections(at.pseudo_inverse)
    mesh, theory = (
        None if part is None else rms_of(part[: len(model.rows.time)]) for part in (error.mesh, error.theory)
    )
    refined = error.refined(seen.residual, seen.jacobian, at.pseudo_inverse)
    tests = residual_tests(model, seen.residual, blocks, at.noise, float(np.hypot(mesh or 0.0, theory or 0.0)), refined)
    told = float(np.sqrt(np.sum(np.any(seen.jacobian != 0.0, axis=1))))
    at = replace(at, systematic=tests.excess * told)
    alone: tuple[Outcome, list[Array]] = (outcome, [])
    found, beside = unless_late(lambda: valley(model, outcome, at), alone) if looked and possible else alone
    ends = [point, *beside]
    parameters = _spanning([_parameters(model, end, at, correction) for end in ends])
    if looked is None:
        parameters = {n: replace(p, std=np.nan, lower=np.nan, upper=np.nan) for n, p in parameters.items()}
    curved = _curved(model, outcome, at, seen, tests) if possible and looked else []
    parameters, profiled = by_profile(model, ends, at, parameters, curved)
    if wishes.profiles and possible and looked:
        profiled = profiles(model, point, at, profiled)
    parameters |= {n: replace(parameters[n], identifiable=False) for n, p in profiled.items() if p.open}
    unknown = combinations(model, point, at) if possible and looked else []
    if possible:
        judgement = judge(model, found, seen, at, tests, parameters, unknown)
    else:
        message = "no parameter set could be simulated; look at the bounds and the scene"
        judgement = Judgement(Verdict.FAILED, message)
    ended = outcome.ended and judgement.verdict is not Verdict.UNFINISHED
    better = judgement.better or (unless_late(lambda: _lower(model, outcome, profiled), None) if ended else None)
    if better is not None and rounds > 0:
        return conclude(searched, _moved(outcome, better), method, seed, wall, stages, wishes, rounds - 1)
    correlation = autocorrelation(seen.residual, blocks)
    draws = wishes.bootstrap if possible and looked else 0
    rng = np.random.default_rng(seed)
    # Away from the minimum the mesh is not what limits the fit.
    limits = judgement.verdict is not Verdict.UNFINISHED and not stages
    coarse = _coarse(model, mesh if limits else None, tests)
    remarks = (_better(profiled), _bent(model, curved), coarse, _slender(parameters, tests, theory))
    notes = (judgement.message or outcome.message, *remarks)
    return Estimate(
        problem=model.problem.name,
        method=method,
        engine=model.engine.name,
        seed=seed,
        verdict=judgement.verdict,
        message="; ".join(note for note in notes if note),
        advice=judgement.advice,
        choice=outcome.choice,
        parameters=parameters,
        quantities=_spanning([_quantities(model, end, at, correction, curved) for end in ends]),
        combinations=unknown,
        fitness=outcome.fitness,
        rms=float(np.sqrt(outcome.fitness / model.things)),
        evaluations=searched.counter.evaluations,
        work=searched.work,
        placements=searched.placements,
        wall_s=wall,
        history=searched.counter.history,
        iterations=outcome.iterations,
        minima=[{**_values_of(model, p), "fitness": f} for p, f in found.minima if np.isfinite(f)],
        residual_autocorrelation=correlation,
        residual_tests=tests,
        suspects=judgement.suspects,
        profiles=profiled,
        bootstrap=bootstrap(model, point, predicted, correlation, draws, rng) if draws else None,
        sensitivity_doubt=seen.doubt,
        model_error_rms=_by_thing(model, error.mesh),
        theory_error_rms=_by_thing(model, error.theory),
        truth=dict(measurement.truth),
        data=measurement.origin,
        notes=[note for recording in measurement.recordings.values() for note in recording.notes],
        model={"scene": model.scene.name, **model.problem.values, **_fitted(model.scene), **_chosen(stages)},
        scenes={name: model.scene_at(point, name) for name in measurement.recordings},
        predicted=predicted,
        measurement=measurement,
        covariance=_covariance(model, point, at),
    )


def _unseen(model: ForwardModel) -> Sensitivity:
    """What is known of the neighbourhood of an answer where there is no time to look: nothing."""
    priors = sum(entry.parameter.prior is not None for entry in model.parameters.entries.values())
    rows = len(model.rows.time) + priors
    return Sensitivity(np.zeros(rows), np.zeros((rows, len(model.names))), np.inf, np.inf)


def _predicted(model: ForwardModel, point: Array, name: str) -> Array:
    """Channels of a recording at an answer, (samples, channels); nan where there is no time to run it."""
    nothing = np.full((1, *model.measurement.recordings[name].values.shape), np.nan)
    return np.asarray(unless_late(lambda: model.observe(point[None], name), nothing)[0])


def _values_of(model: ForwardModel, point: Array) -> dict[str, float]:
    return dict(zip(model.names, model.parameters.to_values(point).tolist(), strict=True))


def _fitted(scene: Scene) -> dict[str, Any]:
    """Mesh and steps of the scene that was fitted, by their paths."""
    found: dict[str, Any] = {}
    for name, body in scene.bodies.items():
        if isinstance(body, Rod):
            found[f"bodies.{name}.element"] = body.element
            found |= {f"bodies.{name}.elements": body.elements} if body.element != "rigid" else {}
            found |= {f"bodies.{name}.quadrature": body.quadrature} if body.element == "ancf-cable" else {}
    return found | {f"solver.{name}": getattr(scene.solver, name) for name in ("integrator", "step")}


def _chosen(stages: list[Stage]) -> dict[str, Any]:
    return {"selection": [stage.to_json() for stage in stages]} if stages else {}


def _coarse(model: ForwardModel, mesh: float | None, tests: ResidualTests) -> str:
    """A word where the mesh, and not the measurement, limits the answer; empty if it does not."""
    if mesh is None:
        return ""
    if model.noise is not None and mesh > model.noise:
        excess, wanted = f"exceeds the noise of {tests.sized(model.noise)}", model.noise
    elif model.noise is None and mesh / _ALIKE < tests.size < mesh * _ALIKE:
        excess, wanted = "is all that the fit leaves", mesh
    else:
        return ""
    return f"the mesh error of {tests.sized(mesh)} {excess}; --tolerance {wanted / 3:.1g} finds a better mesh"


def _moved(outcome: Outcome, better: Descent) -> Outcome:
    """The outcome at a better minimum; where it was is left as another one."""
    choice = "; then ".join(part for part in (outcome.choice, "least squares from a refit") if part)
    minima = [(outcome.point, outcome.fitness), *outcome.minima]
    message = "" if better.converged else "no convergence"
    moved = replace(outcome, point=better.point, fitness=better.fitness, minima=minima, choice=choice)
    return replace(moved, message=message, converged=better.converged)


def _lower(model: ForwardModel, outcome: Outcome, profiled: dict[str, Profile]) -> Descent | None:
    """Where a descent ends from what profiles found below the answer; None if nothing was."""
    places = [found.place for found in profiled.values() if found.better]
    ends = descend_many(model, np.array(places)) if places else []
    best = min(ends, key=lambda end: end.fitness, default=None)
    return best if best is not None and best.fitness < outcome.fitness * (1.0 - _LOWER) else None


def _by_thing(model: ForwardModel, rows: Array | None) -> float | None:
    """Root mean square per observed thing."""
    return None if rows is None else float(np.sqrt(np.sum(rows**2) / model.samples / model.things))


def _slender(parameters: dict[str, Value], tests: ResidualTests, theory: float | None) -> str:
    """A word where what slender beams neglect limits the answer; empty if it does not."""
    limited = [n for n, v in parameters.items() if abs(v.theory or 0.0) > _NOTICED * (v.upper - v.lower) / 2]
    if theory is None or not limited:
        return ""
    change = f"change the motion by about {tests.sized(theory)} and widen the interval of {', '.join(limited)}"
    return f"shear and rotary inertia, which slender beams neglect, {change}"


def _curved(
    model: ForwardModel, outcome: Outcome, at: Linearisation, seen: Sensitivity, tests: ResidualTests
) -> list[int]:
    """Parameters whose intervals linear theory does not tell; where the model limits them they are wider anyway."""
    if not outcome.ended or not outcome.converged or tests.limited or not seen.reliable:
        return []
    return unless_late(lambda: bent(model, outcome.point, at, seen), [])


def _bent(model: ForwardModel, curved: list[int]) -> str:
    names = ", ".join(model.names[k] for k in curved)
    return f"the misfit is no parabola within the interval of {names}, which is that of the profile" if names else ""


def _better(profiled: dict[str, Profile]) -> str:
    names = ", ".join(name for name, found in profiled.items() if found.better)
    return f"a better fit than the answer was found on the profile of {names}" if names else ""


def _parameters(model: ForwardModel, point: Array, at: Linearisation, correction: Corrections) -> dict[str, Value]:
    found = {}
    for k, name in enumerate(model.names):
        about = spread(lambda p, k=k: float(p[k]), point, at)  # type: ignore[misc]
        span = model.upper[k] - model.lower[k]
        at_bound = bool(min(point[k] - model.lower[k], model.upper[k] - point[k]) < 1e-6 * span)
        shift = correction.of(lambda p, k=k: float(p[k]), point)  # type: ignore[misc]
        told = about.fixed and not at_bound and about.std < span and not few(model)
        known = _value(float(point[k]), about, told, shift, at_bound)
        path = model.parameters.entries[name].parameter.path or ""
        known = known.exponential() if model.parameters.logarithmic[k] else known
        told = known.identifiable and _possible(model, path, known)
        found[name] = replace(known, unit=unit(path), identifiable=told)
    return found


def _possible(model: ForwardModel, path: str, known: Value) -> bool:
    """Whether an interval ends at values that can be: a mass whose interval reaches below zero is not known."""
    head, _, name = path.partition(".")
    if head == RESERVED:
        return known.lower > 0.0 or name not in ("clock", "scale")
    return not path or all(accepts(model.scene, path, end) for end in (known.lower, known.upper))


def _spanning(ends: list[dict[str, Value]]) -> dict[str, Value]:
    """The values of the first, with intervals that span those at all ends of its valley."""
    first = ends[0]
    lower = {name: min(end[name].lower for end in ends) for name in first}
    upper = {name: max(end[name].upper for end in ends) for name in first}
    return {name: replace(value, lower=lower[name], upper=upper[name]) for name, value in first.items()}


def _covariance(model: ForwardModel, point: Array, at: Linearisation) -> Array:
    """Of the values, (parameters, parameters): d exp(p) = exp(p) dp for those that are sought by their logarithm."""
    slope = np.where(model.parameters.logarithmic, model.parameters.to_values(point), 1.0)
    return np.asarray(slope[:, None] * at.covariance * slope)


def _quantities(
    model: ForwardModel, point: Array, at: Linearisation, correction: Corrections, curved: list[int]
) -> dict[str, Value]:
    found, entries = {}, list(model.parameters.entries.values())
    doubtful = {entries[k].key for k in curved}
    for name, text in model.problem.quantities.items():
        for recording in model.measurement.recordings if _own(model, text) else [None]:

            def value_at(p: Array, text: str = text, recording: str | None = recording) -> float:
                named = model.parameters.named(p[None], recording)
                return expression.evaluate(text, {key: float(x[0]) for key, x in named.items()})

            about = spread(value_at, point, at)
            shift = correction.of(value_at, point)
            told = about.fixed and not doubtful & set(expression.names(text))
            found[f"{recording}.{name}" if recording else name] = _value(value_at(point), about, told, shift, False)
    return found


def _own(model: ForwardModel, text: str) -> bool:
    """Whether an expression has a value for each recording."""
    keys = {entry.key for entry in model.parameters.entries.values() if entry.recording is not None}
    return bool(expression.names(text) & keys)


def _value(
    value: float, about: Spread, identifiable: bool, shift: tuple[float | None, float | None], at_bound: bool
) -> Value:
    mesh, theory = shift
    half = about.half + abs(mesh or 0.0) + abs(theory or 0.0)
    return Value(value, about.std, value - half, value + half, bool(identifiable), mesh, at_bound, theory=theory)
