"""From where a method ended to an estimate: intervals, what is identifiable, residuals, and the verdict."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from shoal.errors import InputError
from shoal.identification.adapt import Stage
from shoal.identification.estimate import Estimate, Value, Verdict
from shoal.identification.forward import ForwardModel
from shoal.identification.methods import Outcome
from shoal.identification.sensitivity import sensitivity
from shoal.identification.uncertainty import Linearisation, autocorrelation, combinations, linearise, spread
from shoal.scene import Rod, expression
from shoal.trajectory import Array

_BAD_FIT = 0.2
"""An RMS above this fraction of the signal's own spread is no fit at all."""


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
) -> Estimate:
    """The estimate of an outcome. The runs it takes are not counted: no method is charged for them."""
    point, measurement = outcome.point, model.measurement
    evaluations, work, history = model.counter.evaluations, model.work, model.counter.history
    # The intervals look at the neighbourhood of the answer.
    seen = sensitivity(model, point)
    residual, jacobian = seen.residual, seen.jacobian
    if not np.all(np.isfinite(residual)):
        verdict, message = Verdict.FAILED, "no parameter set could be simulated; look at the bounds and the scene"
        residual, jacobian = np.zeros_like(residual), np.zeros_like(jacobian)
    else:
        verdict, message = Verdict.IDENTIFIED, ""
    channels = len(measurement.first.channels)
    at = linearise(jacobian, residual, model.sizes(point), channels)
    predicted = {name: model.observe(point[None], name)[0] for name in measurement.recordings}
    model_error = _model_error(model, point, predicted)
    correction = None if model_error is None else -at.pseudo_inverse @ model_error
    parameters = _parameters(model, point, at, correction)
    quantities = _quantities(model, point, at, correction)
    unknown = combinations(at.unknown, model.names)
    if verdict is Verdict.IDENTIFIED:
        verdict, message = _judge(model, outcome, residual, parameters, unknown)
    return Estimate(
        problem=model.problem.name,
        method=method,
        engine=model.engine.name,
        seed=seed,
        verdict=verdict,
        message="; ".join(note for note in (message or outcome.message, _coarse(model, model_error)) if note),
        choice=outcome.choice,
        parameters=parameters,
        quantities=quantities,
        combinations=unknown,
        fitness=outcome.fitness,
        rms=float(np.sqrt(outcome.fitness / model.things)),
        evaluations=evaluations,
        work=work,
        placements=model.placements,
        wall_s=wall,
        history=history,
        iterations=outcome.iterations,
        minima=[{**_values_of(model, p), "fitness": f} for p, f in outcome.minima],
        residual_autocorrelation=autocorrelation(residual, channels),
        model_error_rms=None
        if model_error is None
        else float(np.sqrt(np.sum(model_error**2) / model.samples / model.things)),
        truth=dict(measurement.truth),
        data=measurement.origin,
        notes=[note for recording in measurement.recordings.values() for note in recording.notes],
        model={"scene": model.scene.name, **model.problem.values, **_chosen(stages)},
        scenes={name: model.scene_at(point, name) for name in measurement.recordings},
        predicted=predicted,
        measurement=measurement,
    )


def _values_of(model: ForwardModel, point: Array) -> dict[str, float]:
    return dict(zip(model.names, model.parameters.to_values(point).tolist(), strict=True))


def _model_error(model: ForwardModel, point: Array, predicted: dict[str, Array]) -> Array | None:
    """Motion on twice as many elements minus motion on the model's mesh, (rows,), with zeros for priors.

    None for rigid scenes, and where the finer mesh cannot be run.
    """
    scene = model.scene
    finer = {
        f"bodies.{name}.elements": 2 * body.elements
        for name, body in scene.bodies.items()
        if isinstance(body, Rod) and body.element != "rigid"
    }
    if not finer:
        return None
    columns = []
    try:
        fine_scene = scene.with_values({**finer, "solver.step": scene.solver.step / 4})
        for name, recording in model.measurement.recordings.items():
            error = model.observe(point[None], name, scene=fine_scene)[0] - predicted[name]
            columns.append(error[np.isfinite(recording.values)])
    except InputError:
        return None
    rows = np.concatenate(columns) * model.rows.weight
    priors = sum(entry.parameter.prior is not None for entry in model.parameters.entries.values())
    return np.append(rows, np.zeros(priors)) if np.all(np.isfinite(rows)) else None


def _chosen(stages: list[Stage]) -> dict[str, Any]:
    return {"selection": [stage.to_json() for stage in stages]} if stages else {}


def _coarse(model: ForwardModel, model_error: Array | None) -> str:
    """A word where the error of the model is larger than that of the measurement; empty if it is not."""
    noise = model.noise
    if model_error is None or noise is None or (size := float(np.sqrt(np.mean(model_error**2)))) <= noise:
        return ""
    return f"the mesh error of {size:.1g} exceeds the noise of {noise:.1g}; --tolerance {noise / 3:.1g} chooses a mesh"


def _parameters(model: ForwardModel, point: Array, at: Linearisation, correction: Array | None) -> dict[str, Value]:
    found = {}
    for k, name in enumerate(model.names):
        std, fixed = spread(lambda p, k=k: float(p[k]), point, at)  # type: ignore[misc]
        span = model.upper[k] - model.lower[k]
        at_bound = bool(min(point[k] - model.lower[k], model.upper[k] - point[k]) < 1e-6 * span)
        shift = None if correction is None else float(correction[k])
        known = _value(float(point[k]), std, fixed and not at_bound and std < span, shift, at_bound)
        found[name] = known.exponential() if model.parameters.logarithmic[k] else known
    return found


def _quantities(model: ForwardModel, point: Array, at: Linearisation, correction: Array | None) -> dict[str, Value]:
    found = {}
    for name, text in model.problem.quantities.items():
        for recording in model.measurement.recordings if _own(model, text) else [None]:

            def value_at(p: Array, text: str = text, recording: str | None = recording) -> float:
                named = model.parameters.named(p[None], recording)
                return expression.evaluate(text, {key: float(x[0]) for key, x in named.items()})

            std, fixed = spread(value_at, point, at)
            shift = None if correction is None else value_at(point + correction) - value_at(point)
            found[f"{recording}.{name}" if recording else name] = _value(value_at(point), std, fixed, shift, False)
    return found


def _own(model: ForwardModel, text: str) -> bool:
    """Whether an expression has a value for each recording."""
    keys = {entry.key for entry in model.parameters.entries.values() if entry.recording is not None}
    return bool(expression.names(text) & keys)


def _value(value: float, std: float, identifiable: bool, correction: float | None, at_bound: bool) -> Value:
    half = 1.96 * std + abs(correction or 0.0)
    return Value(value, std, value - half, value + half, bool(identifiable), correction, at_bound)


def _judge(
    model: ForwardModel, outcome: Outcome, residual: Array, parameters: dict[str, Value], unknown: list[str]
) -> tuple[Verdict, str]:
    size = float(np.sqrt(np.mean(residual**2)))
    spread_of_data = _spread_of_data(model)
    noise = model.noise
    if size > _BAD_FIT * spread_of_data and (noise is None or size > 3 * noise):
        return Verdict.REJECTED, f"the best fit is off by {size:.3g}, the data vary by {spread_of_data:.3g}"
    if noise is not None and size > 3 * noise:
        return Verdict.REJECTED, f"residuals of {size:.3g} are {size / noise:.0f} times the noise of {noise:.3g}"
    rivals = [f for p, f in outcome.minima if f < 1.5 * outcome.fitness + 1e-18 and _apart(model, p, outcome.point)]
    if rivals:
        return Verdict.AMBIGUOUS, f"{1 + len(rivals)} different parameter sets fit equally well"
    at_bound = [name for name, value in parameters.items() if value.at_bound]
    if at_bound:
        return Verdict.COMBINATION, f"{', '.join(at_bound)} ended at a bound and is not identified"
    if unknown:
        return (
            Verdict.COMBINATION,
            f"only combinations are known: {len(unknown)} direction(s) leave the motion unchanged",
        )
    return Verdict.IDENTIFIED, ""


def _spread_of_data(model: ForwardModel) -> float:
    """Standard deviation of the (weighted) data about the mean of each channel."""
    parts = []
    for recording in model.measurement.recordings.values():
        deviation = recording.values - np.nanmean(recording.values, axis=0)
        parts.append(deviation[np.isfinite(recording.values)])
    return float(np.sqrt(np.mean((np.concatenate(parts) * model.rows.weight) ** 2)))


def _apart(model: ForwardModel, one: Array, other: Array) -> bool:
    return bool(np.max(np.abs(one - other) / (model.upper - model.lower)) > 1e-3)
