"""From where a method ended to an estimate: intervals, what is identifiable, residuals, and the verdict."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from shoal.identification.adapt import Stage
from shoal.identification.carried import fitted, joint
from shoal.identification.deadline import unless_late
from shoal.identification.estimate import Estimate
from shoal.identification.forward import ForwardModel
from shoal.identification.judge.other_laws import OtherLaw, other_laws, sentences
from shoal.identification.judge.remarks import remarks
from shoal.identification.judge.residual_tests import ResidualTests, residual_tests
from shoal.identification.judge.rivals import valley
from shoal.identification.judge.verdict import Judgement, Verdict, judge
from shoal.identification.methods.lanes import Descent, descend_many
from shoal.identification.methods.outcome import Outcome
from shoal.identification.spread import intervals
from shoal.identification.spread.bootstrap import bootstrap
from shoal.identification.spread.covariance import blocks_of
from shoal.identification.spread.curvature import bent, by_profile
from shoal.identification.spread.model_error import ModelError, model_error, rms_of
from shoal.identification.spread.posterior import Posterior, news, posterior
from shoal.identification.spread.prediction import Prediction, predictions
from shoal.identification.spread.profiles import Profile, profiles
from shoal.identification.spread.rank import combinations
from shoal.identification.spread.sensitivity import Sensitivity, believed
from shoal.identification.spread.uncertainty import Linearisation, autocorrelation, linearise
from shoal.scene import Rod, Scene
from shoal.trajectory import Array

_LOWER = 1e-6
"""Of the fitness: an answer that is better by more is another one."""
_ROUNDS = 2
"""How often an answer moves on to a better minimum that was met."""


@dataclass(frozen=True)
class Wishes:
    """What a user wants to know beyond the answer.

    profiles: whether every parameter gets its profile likelihood; bootstrap: how many draws; sample: how many effective
    draws from the posterior
    """

    profiles: bool = False
    bootstrap: int = 0
    sample: int = 0


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
    model = model.aside()
    if model.deadline is not None:
        model.deadline.extend()
    predicted = {name: _predicted(model, point, name) for name in measurement.recordings}
    # The intervals look at the neighbourhood of the answer.
    residual = model.compared(point[None], {name: seen[None] for name, seen in predicted.items()})[0]
    looked = unless_late(lambda: believed(model, point, residual), None)
    seen = looked or _unseen(model)
    if looked is None:
        outcome = replace(outcome, ended=False, message=outcome.message or "no time was left for the intervals")
    possible = bool(np.all(np.isfinite(seen.residual)))
    if not possible:
        seen = replace(seen, residual=np.zeros_like(seen.residual), jacobian=np.zeros_like(seen.jacobian))
    known = possible and looked is not None
    blocks = blocks_of(model, len(seen.residual))
    at = linearise(seen.jacobian, seen.residual, model.sizes(point), blocks)
    error = ModelError(None, None)
    if known:
        error = unless_late(lambda: model_error(model, point, predicted, seen.residual), error)
    correction = error.corrections(at.pseudo_inverse)
    mesh, theory = (
        None if part is None else rms_of(part[: len(model.rows.time)]) for part in (error.mesh, error.theory)
    )
    refined = error.refined(seen.residual, seen.jacobian, at.pseudo_inverse)
    tests = residual_tests(model, seen.residual, blocks, at.noise, float(np.hypot(mesh or 0.0, theory or 0.0)), refined)
    told = float(np.sqrt(np.sum(np.any(seen.jacobian != 0.0, axis=1))))
    at = replace(at, systematic=tests.excess * told)
    found, beside = outcome, list[Array]()
    if known:
        found, beside = unless_late(lambda: valley(model, outcome, at), (found, beside))
    laws = unless_late(lambda: other_laws(model, point, seen), list[OtherLaw]()) if known else []
    # Where there is a misfit, what it may be due to is in the intervals; else it is said.
    ends = [point, *beside, *(law.end for law in laws if law.fits and tests.limited)]
    values = intervals.possible(
        model, intervals.spanning([intervals.parameters(model, end, at, correction) for end in ends])
    )
    if looked is None:
        values = {n: replace(p, std=np.nan, lower=np.nan, upper=np.nan) for n, p in values.items()}
    curved = _curved(model, outcome, at, seen, tests) if known else []
    values, profiled = by_profile(model, ends, at, values, curved)
    if wishes.profiles and known:
        profiled = profiles(model, point, at, profiled)
    values |= {n: replace(values[n], identifiable=False) for n, p in profiled.items() if p.open}
    unknown = combinations(model, point, at) if known else []
    if possible:
        judgement = judge(model, found, seen, at, tests, values, unknown)
        values = intervals.with_refits(values, judgement.refits)
    else:
        why = f" ({model.failure})" if model.failure else ""
        message = f"no parameter set could be simulated{why}; look at the bounds and the scene"
        judgement = Judgement(Verdict.FAILED, message)
    ended = outcome.ended and judgement.verdict is not Verdict.UNFINISHED
    better = judgement.better or (unless_late(lambda: _lower(model, outcome, profiled), None) if ended else None)
    if better is not None and rounds > 0:
        return conclude(searched, _moved(outcome, better), method, seed, wall, stages, wishes, rounds - 1)
    selected = {"selection": [vars(stage) for stage in stages]} if stages else {}
    correlation = autocorrelation(seen.residual, blocks)
    draws = wishes.bootstrap if known else 0
    rng = np.random.default_rng(seed)
    # Away from the minimum the mesh is not what limits the fit.
    limits = judgement.verdict is not Verdict.UNFINISHED and not stages
    names = [model.names[k] for k in curved]
    carried, left = fitted(model.parameters, point)
    foretold: list[Prediction] = unless_late(
        lambda: predictions(model, point, seen if known else None, at, blocks, error), []
    )
    square, minimum = float(residual @ residual), judgement.verdict not in (Verdict.FAILED, Verdict.UNFINISHED)
    drawn: Posterior | None = None
    if wishes.sample and minimum:
        drawn = unless_late(lambda: posterior(model, point, at, blocks, square, wishes.sample, seed), None)
    notes = [judgement.message or outcome.message]
    if judgement.verdict.trusted:
        notes += sentences(laws, values, lambda law: intervals.parameters(model, law.end, at, correction)[law.sought])
    notes += remarks(values, profiled, names, tests, mesh if limits else None, theory)
    if drawn is not None:
        alone = judgement.verdict is Verdict.AMBIGUOUS
        notes += [drawn.sentence(), *news(drawn, values), "the draws are about the first of them alone" * alone]
    elif wishes.sample:
        why = "no time was left" if minimum else f"'{judgement.verdict}' is no minimum to draw about"
        notes.append(f"no posterior was drawn: {why}")
    several = len(measurement.recordings) > 1
    notes += [one.sentence(named=several) for one in foretold]
    beyond = ["look for what the model leaves out: a prediction is worse than the estimate states"]
    return Estimate(
        problem=model.problem.name,
        method=method,
        engine=model.engine.name,
        seed=seed,
        verdict=judgement.verdict,
        message="; ".join(note for note in notes if note),
        advice=judgement.advice + beyond * any(one.inside is False for one in foretold),
        choice=outcome.choice,
        parameters=values,
        quantities=intervals.spanning(
            [
                *(intervals.quantities(model, end, at, correction, curved) for end in ends),
                *(refit.quantities() for refit in judgement.refits),
            ]
        ),
        combinations=unknown,
        fitness=outcome.fitness,
        rms=float(np.sqrt(outcome.fitness / model.rows.things)),
        evaluations=searched.counter.evaluations,
        work=searched.work,
        placements=searched.placements,
        wall_s=wall,
        history=searched.counter.history,
        iterations=outcome.iterations,
        minima=[
            {**model.parameters.told(p), "fitness": f}
            for p, f in sorted(found.minima, key=lambda end: end[1])
            if np.isfinite(f)
        ],
        residual_autocorrelation=correlation,
        residual_tests=tests,
        suspects=judgement.suspects,
        profiles=profiled,
        bootstrap=bootstrap(model, point, predicted, correlation, draws, rng) if draws else None,
        posterior=drawn,
        sensitivity_doubt=seen.doubt,
        model_error_rms=_by_thing(model, error.mesh),
        theory_error_rms=_by_thing(model, error.theory),
        truth=dict(measurement.truth),
        data=measurement.origin,
        notes=[note for recording in measurement.recordings.values() for note in recording.notes],
        model={"scene": model.scene.name, **model.problem.values, **_fitted(model.scene), **selected},
        scenes={name: model.scene_at(point, name) for name in measurement.recordings},
        predicted=predicted,
        measurement=measurement,
        covariance=intervals.covariance(model, point, at),
        values=carried,
        left_out=left,
        prediction=foretold,
        joint=joint(model.parameters, point, intervals.covariance(model, point, at), values),
    )


def _unseen(model: ForwardModel) -> Sensitivity:
    """What is known of the neighbourhood of an answer where there is no time to look: nothing."""
    rows = len(model.rows.time) + len(model.parameters.priors)
    return Sensitivity(np.zeros(rows), np.zeros((rows, len(model.names))), np.inf, np.inf)


def _predicted(model: ForwardModel, point: Array, name: str) -> Array:
    """Channels of a recording at an answer, (samples, channels); nan where there is no time to run it."""
    nothing = np.full((1, *model.measurement.recordings[name].values.shape), np.nan)
    return np.asarray(unless_late(lambda: model.observe(point[None], name), nothing)[0])


def _fitted(scene: Scene) -> dict[str, Any]:
    """Mesh and steps of the scene that was fitted, by their paths."""
    found: dict[str, Any] = {}
    for name, body in scene.bodies.items():
        if isinstance(body, Rod):
            found[f"bodies.{name}.element"] = body.element
            found |= {f"bodies.{name}.{field}": number for field, number in body.mesh.items()}
            found |= {f"bodies.{name}.quadrature": body.quadrature} if body.element == "ancf-cable" else {}
    return found | {f"solver.{name}": getattr(scene.solver, name) for name in ("integrator", "step", "inertia_cap")}


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
    return None if rows is None else float(np.sqrt(np.sum(rows**2) / model.rows.samples / model.rows.things))


def _curved(
    model: ForwardModel, outcome: Outcome, at: Linearisation, seen: Sensitivity, tests: ResidualTests
) -> list[int]:
    """Parameters whose intervals linear theory does not tell; where the model limits them they are wider anyway."""
    if not outcome.ended or not outcome.converged or tests.limited or not seen.reliable:
        return []
    return unless_late(lambda: bent(model, outcome.point, at, seen), [])
