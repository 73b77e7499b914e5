"""The main path: problem -> measurement -> method -> estimate with intervals and a verdict."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

import numpy as np

from shoal.engines import get_engine
from shoal.errors import InputError
from shoal.identification.adapt import Stage, coarse_to_fine
from shoal.identification.estimate import Estimate, Value, Verdict
from shoal.identification.forward import ForwardModel, Progress
from shoal.identification.measurement import Measurement, measure
from shoal.identification.methods import Outcome, get_method
from shoal.identification.methods.least_squares import linearise as difference
from shoal.identification.problem import Problem
from shoal.identification.uncertainty import Linearisation, autocorrelation, combinations, linearise, spread
from shoal.scene import Rod, Scene, expression
from shoal.trajectory import Array

_BAD_FIT = 0.2
"""An RMS above this fraction of the signal's own spread is no fit at all."""


def identify(
    problem: Problem,
    *,
    method: str | None = None,
    data: str | None = None,
    engine: str = "gauss",
    values: Mapping[str, Any] | None = None,
    seed: int = 0,
    measurement: Measurement | None = None,
    tolerance: float | None = None,
    progress: Progress = lambda *_: None,
) -> Estimate:
    """Find the parameters of a problem.

    method: one of METHODS, else the problem's; data: a recording instead of the problem's own;
    values: fields of the scene to set; measurement: one made earlier, to share it between methods;
    tolerance: error [m] that the model may have at the markers, for which elements, integrator and step are chosen
    instead of taken from the scene (coarse while searching);
    progress: called with (iteration, best fitness, mean fitness). Raises InputError, ComputationError.
    """
    name = method or problem.method
    search = get_method(name)
    scene = problem.load_scene(values)
    if measurement is None:
        measurement = measure(problem, load_truth(problem), data)
    model = ForwardModel(problem, scene, get_engine(engine), measurement)
    begin = time.perf_counter()
    rng, stages = np.random.default_rng(seed), list[Stage]()
    if tolerance is None:
        outcome = search(model, rng, progress)
    elif engine != "gauss":
        raise InputError(f"tolerance: models are chosen for engine gauss only, found engine {engine!r}")
    else:
        model, outcome, stages = coarse_to_fine(model, search, tolerance, rng, progress)
    wall = time.perf_counter() - begin
    evaluations = model.counter.evaluations
    return _estimate(model, outcome, name, engine, seed, wall, evaluations, stages)


def load_truth(problem: Problem) -> Scene:
    """The scene of a problem as the data are computed from it: with the problem's values, not the user's."""
    return problem.load_scene()


def _estimate(
    model: ForwardModel,
    outcome: Outcome,
    method: str,
    engine: str,
    seed: int,
    wall: float,
    evaluations: int,
    stages: list[Stage],
) -> Estimate:
    point = outcome.point
    measurement = model.measurement
    history = model.counter.history
    # The intervals look at the neighbourhood of the answer: extra runs that no method is charged for.
    residual, jacobian = difference(model, point)
    if not np.all(np.isfinite(residual)):
        verdict, message = Verdict.FAILED, "no parameter set could be simulated; look at the bounds and the scene"
        residual, jacobian = np.zeros_like(residual), np.zeros_like(jacobian)
    else:
        verdict, message = Verdict.IDENTIFIED, ""
    scale = np.maximum(np.abs(point), 1e-3 * (model.upper - model.lower))
    at = linearise(jacobian, residual, scale, len(measurement.channels))
    model_error = _model_error(model, point)
    correction = None if model_error is None else -at.pseudo_inverse @ model_error.ravel()
    parameters = _parameters(model, point, at, correction)
    quantities = _quantities(model, point, at, correction)
    unknown = combinations(at.unknown, model.names)
    if verdict is Verdict.IDENTIFIED:
        verdict, message = _judge(model, outcome, residual, parameters, unknown)
    return Estimate(
        problem=model.problem.name,
        method=method,
        engine=engine,
        seed=seed,
        verdict=verdict,
        message="; ".join(note for note in (message or outcome.message, _coarse(model, model_error)) if note),
        parameters=parameters,
        quantities=quantities,
        combinations=unknown,
        fitness=outcome.fitness,
        rms=float(np.sqrt(outcome.fitness / measurement.things)),
        evaluations=evaluations,
        placements=model.placements,
        wall_s=wall,
        history=history,
        iterations=outcome.iterations,
        minima=[{**dict(zip(model.names, p.tolist(), strict=True)), "fitness": f} for p, f in outcome.minima],
        residual_autocorrelation=autocorrelation(residual, len(measurement.channels)),
        model_error_rms=None
        if model_error is None
        else float(np.sqrt(np.sum(model_error**2) / len(measurement.times) / measurement.things)),
        truth=measurement.truth,
        data=measurement.origin,
        model={"scene": model.scene.name, **model.problem.values, **_chosen(stages)},
        scene=model.scene.with_values(
            {p.path: float(v) for p, v in zip(model.problem.parameters.values(), point, strict=True)}
        ),
        measurement=measurement,
    )


def _model_error(model: ForwardModel, point: Array) -> Array | None:
    """Motion on twice as many elements minus motion on the model's mesh, (samples, channels).

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
    try:
        fine_scene = scene.with_values({**finer, "solver.step": scene.solver.step / 4})
        fine = model.observe(point[None], model.measurement.times, fine_scene)[0]
        coarse = model.observe(point[None], model.measurement.times)[0]
    except InputError:
        return None
    error = fine - coarse
    return error if np.all(np.isfinite(error)) else None


def _chosen(stages: list[Stage]) -> dict[str, Any]:
    return {"selection": [stage.to_json() for stage in stages]} if stages else {}


def _coarse(model: ForwardModel, model_error: Array | None) -> str:
    """A word where the error of the model is larger than that of the measurement; empty if it is not."""
    noise = model.problem.noise
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
        found[name] = _value(float(point[k]), std, fixed and not at_bound and std < span, shift, at_bound)
    return found


def _quantities(model: ForwardModel, point: Array, at: Linearisation, correction: Array | None) -> dict[str, Value]:
    constants = {name: float(model.scene.value(path)) for name, path in model.problem.constants.items()}
    found = {}
    for name, text in model.problem.quantities.items():

        def value_at(p: Array, text: str = text) -> float:
            return expression.evaluate(text, {**constants, **dict(zip(model.names, p.tolist(), strict=True))})

        std, fixed = spread(value_at, point, at)
        shift = None if correction is None else value_at(point + correction) - value_at(point)
        found[name] = _value(value_at(point), std, fixed, shift, False)
    return found


def _value(value: float, std: float, identifiable: bool, correction: float | None, at_bound: bool) -> Value:
    half = 1.96 * std + abs(correction or 0.0)
    return Value(value, std, value - half, value + half, bool(identifiable), correction, at_bound)


def _judge(
    model: ForwardModel, outcome: Outcome, residual: Array, parameters: dict[str, Value], unknown: list[str]
) -> tuple[Verdict, str]:
    values = model.measurement.values
    size = float(np.sqrt(np.mean(residual**2)))
    spread_of_data = float(np.sqrt(np.mean((values - values.mean(axis=0)) ** 2)))
    noise = model.problem.noise
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


def _apart(model: ForwardModel, one: Array, other: Array) -> bool:
    return bool(np.max(np.abs(one - other) / (model.upper - model.lower)) > 1e-3)
