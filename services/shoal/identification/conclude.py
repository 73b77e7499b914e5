"""From where a method ended to an estimate: intervals, what is identifiable, residuals, and the verdict."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from shoal.findings import Finding
from shoal.identification import findings as kinds
from shoal.identification.adapt import AdaptedModel
from shoal.identification.carried import fitted, joint
from shoal.identification.deadline import unless_late
from shoal.identification.estimate import Estimate
from shoal.identification.evidence import Evidence, evidence
from shoal.identification.findings import Verdict
from shoal.identification.forward import ForwardModel
from shoal.identification.judge.judgement import Judgement, judge
from shoal.identification.judge.minima.rivals import valley
from shoal.identification.judge.minima.turns import with_nearest_turns
from shoal.identification.judge.other_laws import OtherLaw, other_laws, wider_by_other_laws
from shoal.identification.judge.remarks import beyond_noise, remarks
from shoal.identification.lengthening import lengthened
from shoal.identification.methods.growth import FRACTAL, LARGE, growth
from shoal.identification.methods.lanes import Descent, descend_many, descend_on
from shoal.identification.methods.outcome import Outcome
from shoal.identification.spread import intervals
from shoal.identification.spread.bootstrap import bootstrap
from shoal.identification.spread.curvature import bent, by_profile
from shoal.identification.spread.posterior import Posterior, differences, posterior
from shoal.identification.spread.prediction import Prediction, predictions
from shoal.identification.spread.profiles import Profile, profiles
from shoal.identification.spread.rank import combinations
from shoal.identification.spread.uncertainty import autocorrelation
from shoal.identification.spread.value import Value
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

_OF_FIRST = kinds.FIRST_MODE.found("the draws are about the first of them alone")


def conclude(
    model: ForwardModel,
    outcome: Outcome,
    method: str,
    seed: int,
    wall: float,
    stages: list[AdaptedModel],
    wishes: Wishes,
    rounds: int = _ROUNDS,
) -> Estimate:
    """The estimate of an outcome. The runs it takes are not counted: no method is charged for them.

    Where what looks for the cause of a misfit meets a better minimum, that one is concluded from, so many times.
    """
    searched, model = model, model.aside()
    if model.deadline is not None:
        model.deadline.extend()
    found = outcome
    outcome = unless_late(lambda: with_nearest_turns(model, found), found)
    near = evidence(model, outcome.point)
    if not near.looked:
        outcome = replace(outcome, ended=False, message=outcome.message or "no time was left for the intervals")
    outcome, near = _settled(model, outcome, near)
    known = _known(model, outcome, near, wishes.profiles)
    judgement = _judged(model, near, known)
    values = intervals.with_refits(model, known.values, judgement.refits)
    ended = outcome.ended and judgement.verdict is not Verdict.UNFINISHED
    better = judgement.better or (unless_late(lambda: _lower(model, outcome, known.profiled), None) if ended else None)
    if better is not None and rounds > 0:
        met = better  # as far as a search for something else went
        better = unless_late(lambda: descend_on(model, met), met)
        return conclude(searched, _followed(outcome, better), method, seed, wall, stages, wishes, rounds - 1)
    point, at, measurement = near.point, near.at, model.measurement
    foretold: list[Prediction] = unless_late(
        lambda: predictions(
            model, point, near.seen if near.known else None, near.beside, near.blocks, near.error, near.fields
        ),
        [],
    )
    drawn, undrawn = _drawn(model, near, judgement, wishes.sample, seed)
    findings = [
        *_refuted(judgement, foretold),
        *(judgement.findings or _ended(outcome)),
        *outcome.findings,
        *(_beside(model, near, known, values) if judgement.verdict.trusted else []),
        *remarks(
            values,
            known.profiled,
            known.bent(model),
            near.tests,
            # Away from the minimum the mesh is not what limits the fit.
            near.mesh if judgement.verdict is not Verdict.UNFINISHED and not stages else None,
            near.theory,
            bool(model.scene.flexible_rods),
        ),
        *(one for given in (*near.given, near.fields) if given is not None for one in given.findings(at, model.names)),
        *(undrawn if drawn is None else [*drawn.findings(), *differences(drawn, values)]),
        *([_OF_FIRST] if drawn is not None and judgement.verdict is Verdict.AMBIGUOUS else []),
        *(one.finding(named=len(measurement.recordings) > 1) for one in foretold),
    ]
    correlation = autocorrelation(near.seen.residual, near.blocks) if near.tests.made else np.nan
    draws = wishes.bootstrap if near.known else 0
    rng = np.random.default_rng(seed)
    carried, left = fitted(model.parameters, point)
    covariance = intervals.covariance(model, point, at)
    selected = {"selection": [vars(stage) for stage in stages]} if stages else {}
    return Estimate(
        problem=model.problem.name,
        method=method,
        engine=model.engine.name,
        seed=seed,
        findings=findings,
        choice=outcome.choice,
        parameters={name: value.told() for name, value in values.items()},
        quantities={name: value.told() for name, value in known.quantities(model, near, judgement).items()},
        combinations=known.combinations,
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
            for p, f in sorted(known.outcome.minima, key=lambda end: end[1])
            if np.isfinite(f)
        ],
        residual_autocorrelation=correlation,
        residual_tests=near.tests,
        suspects=judgement.suspects,
        hypotheses=judgement.hypotheses,
        profiles=known.profiled,
        bootstrap=bootstrap(model, point, near.predicted, correlation, draws, rng) if draws else None,
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
        prediction=foretold,
        joint=joint(model.parameters, point, covariance, values),
    )


@dataclass(frozen=True)
class _Known:
    """What an answer tells of its parameters, before the verdict.

    outcome: without the minima in the valley of the answer; ends: the answer, those minima, and where other laws of
    friction would move it that a misfit may be due to: the intervals hold them all
    curved: parameters whose intervals are those of their profiles
    """

    outcome: Outcome
    ends: list[Array]
    laws: list[OtherLaw]
    values: dict[str, Value]
    curved: list[int]
    profiled: dict[str, Profile]
    combinations: list[str]

    def bent(self, model: ForwardModel) -> list[str]:
        """The names of those that are curved."""
        return [model.names[k] for k in self.curved]

    def quantities(self, model: ForwardModel, near: Evidence, judgement: Judgement) -> dict[str, Value]:
        """Quantities with intervals that hold all ends, and the refits of a judgement."""
        ends = (intervals.quantities(model, end, near.at, near.correction, self.curved) for end in self.ends)
        return intervals.spanning([*ends, *(refit.quantities() for refit in judgement.refits)])


def _known(model: ForwardModel, outcome: Outcome, near: Evidence, profiles_too: bool) -> _Known:
    """What the surroundings of an outcome tell of its parameters."""
    point, at, found, beside, laws = near.point, near.at, outcome, list[Array](), list[OtherLaw]()
    if near.known:
        found, beside = unless_late(lambda: valley(model, outcome, at), (found, beside))
        laws = unless_late(lambda: other_laws(model, point, near.seen), laws)
    # Where there is a misfit, what it may be due to is in the intervals; else it is said.
    ends = [point, *beside, *(law.end for law in laws if law.fits and near.tests.limited)]
    values = intervals.possible(
        model, intervals.spanning([intervals.parameters(model, end, at, near.correction) for end in ends])
    )
    if not near.looked:
        values = {n: replace(p, std=np.nan, lower=np.nan, upper=np.nan) for n, p in values.items()}
    curved = _curved(model, outcome, near) if near.known else []
    values, profiled = by_profile(model, ends, at, values, curved)
    if profiles_too and near.known:
        profiled = profiles(model, point, at, profiled)
    values |= {n: replace(values[n], identifiable=False) for n, p in profiled.items() if p.open}
    return _Known(found, ends, laws, values, curved, profiled, combinations(model, point, at) if near.known else [])


def _judged(model: ForwardModel, near: Evidence, known: _Known) -> Judgement:
    """Return what the diagnostics find; a failure where the answer cannot be simulated."""
    if near.possible:
        late = Judgement([kinds.NO_TIME.found("no time was left to judge the answer")])
        at_answer = near.seen, near.at, near.tests, near.score_test(model)
        return unless_late(lambda: judge(model, known.outcome, *at_answer, known.values, known.combinations), late)
    why = f" ({model.failure})" if model.failure else ""
    text = f"no parameter set could be simulated{why}; look at starts, bounds and the scene"
    return Judgement([kinds.NOT_SIMULATED.found(text)])


def _refuted(judgement: Judgement, foretold: list[Prediction]) -> list[Finding]:
    """Return whether windows that were held out refute an answer that would be trusted."""
    worst = max((one for one in foretold if one.refutes), key=lambda one: one.ratio, default=None)
    if worst is None or not judgement.verdict.trusted:
        return []
    text = f"held-out data refute the model: predicted {worst.ratio:.2g} times worse than the estimate states"
    return [kinds.HELD_OUT_REFUTES.found(text, ratio=worst.ratio)]


def _ended(outcome: Outcome) -> list[Finding]:
    """Return how the search ended, where it has something to say."""
    return [kinds.SEARCH_ENDED.found(outcome.message)] if outcome.message else []


def _beside(model: ForwardModel, near: Evidence, known: _Known, values: dict[str, Value]) -> list[Finding]:
    """Return what other friction laws would change of an answer, and what its intervals hold beyond noise."""
    laws = wider_by_other_laws(
        known.laws, values, lambda law: intervals.parameters(model, law.end, near.at, near.correction)[law.sought]
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


def _followed(outcome: Outcome, better: Descent) -> Outcome:
    """Return the outcome at a better minimum that a refit met, with a finding that says so."""
    text = f"a refit met a better minimum, of fitness {better.fitness:.3g} instead of {outcome.fitness:.3g}"
    said = kinds.BETTER_FOLLOWED.found(text, fitness=outcome.fitness, better=better.fitness)
    return replace(outcome.moved(better, "least squares from a refit"), findings=[*outcome.findings, said])


def _settled(model: ForwardModel, outcome: Outcome, near: Evidence) -> tuple[Outcome, Evidence]:
    """An outcome and what is around it; of a chaotic motion at the end of the valley in which the search stopped."""
    if not (outcome.ended and near.known):
        return outcome, near
    if growth(model, near.seen.jacobian) < (FRACTAL if near.seen.reliable else LARGE):
        return outcome, near
    better = unless_late(lambda: lengthened(model, outcome.point), None)
    if better is None:
        return outcome, near
    moved = outcome.moved(better, "over a lengthening record")
    return replace(moved, minima=outcome.minima), evidence(model, moved.point)


def _lower(model: ForwardModel, outcome: Outcome, profiled: dict[str, Profile]) -> Descent | None:
    """Where a descent ends from what profiles found below the answer; None if nothing was."""
    places = [found.place for found in profiled.values() if found.better]
    ends = descend_many(model, np.array(places)) if places else []
    best = min(ends, key=lambda end: end.fitness, default=None)
    return best if best is not None and best.fitness < outcome.fitness * (1.0 - _LOWER) else None


def _by_thing(model: ForwardModel, rows: Array | None) -> float | None:
    """Root mean square per observed thing."""
    return None if rows is None else float(np.sqrt(np.sum(rows**2) / model.rows.samples / model.rows.things))


def _curved(model: ForwardModel, outcome: Outcome, near: Evidence) -> list[int]:
    """Parameters whose intervals linear theory does not tell; where the model limits them they are wider anyway.

    Refits of a profile end on their way along the narrow valley of a chaotic motion, which would make it too narrow.
    """
    if not outcome.ended or not outcome.converged or near.tests.limited or not near.seen.reliable:
        return []
    if growth(model, near.seen.jacobian) > FRACTAL:
        return []
    return unless_late(lambda: bent(model, near.point, near.at, near.seen), [])
