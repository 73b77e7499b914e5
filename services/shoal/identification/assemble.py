"""The estimate of a judged answer: all findings, predictions of held-out windows, draws, and the fields of a result."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from shoal.findings import Finding
from shoal.identification import findings as kinds
from shoal.identification.adapt import AdaptedModel
from shoal.identification.carried import fitted, joint
from shoal.identification.deadline import unless_late
from shoal.identification.diagnostics.judgement import Judgement
from shoal.identification.diagnostics.other_laws import wider_by_other_laws
from shoal.identification.diagnostics.remarks import beyond_noise, remarks
from shoal.identification.estimate import Estimate
from shoal.identification.evidence import Evidence
from shoal.identification.findings import Verdict
from shoal.identification.forward import ForwardModel
from shoal.identification.methods.outcome import Outcome
from shoal.identification.surroundings import Surroundings
from shoal.identification.uncertainty import intervals
from shoal.identification.uncertainty.bootstrap import bootstrap
from shoal.identification.uncertainty.intervals import Value
from shoal.identification.uncertainty.linearisation import autocorrelation
from shoal.identification.uncertainty.posterior import Posterior, differences, posterior
from shoal.identification.uncertainty.prediction import Prediction, predictions
from shoal.scene import Rod, Scene
from shoal.trajectory import Array

_OF_FIRST = kinds.FIRST_MODE.found("the draws are about the first of them alone")


def assemble(
    searched: ForwardModel,
    model: ForwardModel,
    outcome: Outcome,
    near: Evidence,
    known: Surroundings,
    judgement: Judgement,
    stages: Sequence[AdaptedModel],
    *,
    method: str,
    seed: int,
    wall_s: float,
    resamples: int,
    sample: int,
) -> Estimate:
    """Return the estimate.

    searched: the model that counts the runs of the search, for `wall_s` seconds; stages: models on the way
    resamples, sample: how many draws of the bootstrap and of the posterior are wanted
    """
    point, at, measurement = near.point, near.at, model.measurement
    values = intervals.with_refits(model, known.values, judgement.refits)
    predicted: list[Prediction] = unless_late(
        lambda: predictions(
            model, point, near.seen if near.known else None, near.beside, near.blocks, near.error, near.fields
        ),
        [],
    )
    drawn, undrawn = _drawn(model, near, judgement, sample, seed)
    draws = [*(undrawn if drawn is None else [*drawn.findings(), *differences(drawn, values)])]
    draws += [_OF_FIRST] if drawn is not None and judgement.verdict is Verdict.AMBIGUOUS else []
    correlation = autocorrelation(near.seen.residual, near.blocks) if near.tests.made else np.nan
    carried, left = fitted(model.parameters, point)
    covariance = intervals.covariance(model, point, at)
    selected = {"selection": [vars(stage) for stage in stages]} if stages else {}
    return Estimate(
        problem=model.problem.name,
        method=method,
        engine=model.engine.name,
        seed=seed,
        findings=[
            *_findings(model, outcome, near, known, judgement, values, predicted, meshed=not stages),
            *draws,
            *(one.finding(named=len(measurement.recordings) > 1) for one in predicted),
        ],
        choice=outcome.choice,
        parameters={name: value.reported() for name, value in values.items()},
        quantities={name: value.reported() for name, value in known.quantities(model, near, judgement).items()},
        combinations=known.combinations,
        fitness=outcome.fitness,
        rms=float(np.sqrt(outcome.fitness / model.rows.things)),
        evaluations=searched.counter.evaluations,
        work=searched.work,
        placements=searched.placements,
        wall_s=wall_s,
        history=searched.counter.history,
        iterations=outcome.iterations,
        minima=[
            {**model.parameters.by_name(p), "fitness": f}
            for p, f in sorted(known.outcome.minima, key=lambda end: end[1])
            if np.isfinite(f)
        ],
        residual_autocorrelation=correlation,
        residual_tests=near.tests,
        suspects=judgement.suspects,
        hypotheses=judgement.hypotheses,
        profiles=known.profiled,
        bootstrap=bootstrap(model, point, near.predicted, correlation, resamples, np.random.default_rng(seed))
        if resamples and near.known
        else None,
        posterior=drawn,
        sensitivity_doubt=near.seen.doubt,
        model_error_rms=_by_thing(model, near.error.mesh),
        theory_error_rms=_by_thing(model, near.error.theory),
        truth=dict(measurement.truth),
        data=measurement.origin,
        notes=[note for recording in measurement.recordings.values() for note in recording.notes],
        model={"scene": model.scene.name, **model.problem.values, **_fitted(model.scene), **selected},
        scenes={name: model.scene_at(point, name) for name in measurement.recordings},
        predicted=near.predicted,
        measurement=measurement,
        covariance=covariance,
        values=carried,
        left_out=left,
        prediction=predicted,
        joint=joint(model.parameters, point, covariance, values),
    )


def _findings(
    model: ForwardModel,
    outcome: Outcome,
    near: Evidence,
    known: Surroundings,
    judgement: Judgement,
    values: dict[str, Value],
    predicted: list[Prediction],
    *,
    meshed: bool,
) -> list[Finding]:
    """Return what was found out about an answer, the decisive first. meshed: whether the scene states its mesh."""
    given = [one for one in (*near.given, near.fields) if one is not None]
    return [
        *_refuted(judgement, predicted),
        *(judgement.findings or _ended(outcome)),
        *outcome.findings,
        *(_remarks_of(model, near, known, judgement, values) if judgement.verdict.trusted else []),
        *remarks(
            values,
            known.profiled,
            known.bent(model),
            near.tests,
            # Away from the minimum the mesh is not what limits the fit.
            near.mesh if judgement.verdict is not Verdict.UNFINISHED and meshed else None,
            near.theory,
            bool(model.scene.flexible_rods),
        ),
        *(finding for one in given for finding in one.findings(near.at, model.names)),
    ]


def _refuted(judgement: Judgement, predicted: list[Prediction]) -> list[Finding]:
    """Return whether windows that were held out refute an answer that would be trusted."""
    worst = max((one for one in predicted if one.refutes), key=lambda one: one.ratio, default=None)
    if worst is None or not judgement.verdict.trusted:
        return []
    text = f"held-out data refute the model: predicted {worst.ratio:.2g} times worse than the estimate states"
    return [kinds.HELD_OUT_REFUTES.found(text, ratio=worst.ratio)]


def _ended(outcome: Outcome) -> list[Finding]:
    """Return how the search ended, where it has something to say."""
    return [kinds.SEARCH_ENDED.found(outcome.message)] if outcome.message else []


def _remarks_of(
    model: ForwardModel, near: Evidence, known: Surroundings, judgement: Judgement, values: dict[str, Value]
) -> list[Finding]:
    """Return what other friction laws would change of an answer, and what its intervals hold beyond noise."""
    laws = wider_by_other_laws(
        judgement.laws, values, lambda law: intervals.parameters(model, law.end, near.at, near.correction)[law.sought]
    )
    return [*laws, *beyond_noise(values, known.profiled, near.tests)]


def _drawn(
    model: ForwardModel, near: Evidence, judgement: Judgement, wanted: int, seed: int
) -> tuple[Posterior | None, list[Finding]]:
    """Draw from the posterior about a minimum, where draws are wanted; return also why there are none."""
    if not wanted:
        return None, []
    if judgement.verdict in (Verdict.FAILED, Verdict.UNFINISHED):
        text = f"no posterior was drawn: '{judgement.verdict}' is no minimum to draw about"
        return None, [kinds.NO_POSTERIOR.found(text)]
    square = float(near.residual @ near.residual)
    drawn = unless_late(lambda: posterior(model, near.point, near.at, near.blocks, square, wanted, seed), None)
    return drawn, [kinds.NO_POSTERIOR.found("no posterior was drawn: no time was left")]


def _fitted(scene: Scene) -> dict[str, Any]:
    """Mesh and steps of the scene that was fitted, by their paths."""
    found: dict[str, Any] = {}
    for name, body in scene.bodies.items():
        if isinstance(body, Rod):
            found[f"bodies.{name}.element"] = body.element
            found |= {f"bodies.{name}.{field}": number for field, number in body.mesh.items()}
            found |= {f"bodies.{name}.quadrature": body.quadrature} if body.element == "ancf-cable" else {}
    return found | {f"solver.{name}": getattr(scene.solver, name) for name in ("integrator", "step", "inertia_cap")}


def _by_thing(model: ForwardModel, rows: Array | None) -> float | None:
    """Root mean square per observed thing."""
    return None if rows is None else float(np.sqrt(np.sum(rows**2) / model.rows.samples / model.rows.things))
