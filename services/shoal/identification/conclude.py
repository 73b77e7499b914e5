"""From where a search ended to the estimate: go to the minimum, look around it, judge, report.

Where a diagnostic meets a better minimum the search goes on from it, and a finding says so.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from shoal.identification import findings as kinds
from shoal.identification.adapt import AdaptedModel
from shoal.identification.assemble import assemble
from shoal.identification.deadline import unless_late
from shoal.identification.diagnostics.judgement import Judgement, judge
from shoal.identification.diagnostics.minima.turns import with_nearest_turns
from shoal.identification.estimate import Estimate
from shoal.identification.evidence import Evidence, evidence
from shoal.identification.findings import Verdict
from shoal.identification.forward import ForwardModel
from shoal.identification.lengthening import lengthened
from shoal.identification.methods.growth import FRACTAL, LARGE, growth
from shoal.identification.methods.lanes import Descent, descend_many, descend_on
from shoal.identification.methods.outcome import Outcome, lowers
from shoal.identification.surroundings import Surroundings, surroundings
from shoal.identification.uncertainty.profiles import Profile

_ROUNDS = 2
"""How often an answer moves on to a better minimum that was met."""


@dataclass(frozen=True)
class Options:
    """Results that are computed in addition to the answer.

    profiles: whether every parameter gets its profile likelihood; bootstrap: number of draws; sample: number of
    effective draws from the posterior
    """

    profiles: bool = False
    bootstrap: int = 0
    sample: int = 0


DEFAULTS = Options()


def conclude(
    model: ForwardModel,
    outcome: Outcome,
    method: str,
    seed: int = 0,
    wall: float = 0.0,
    stages: Sequence[AdaptedModel] = (),
    options: Options = DEFAULTS,
    rounds: int = _ROUNDS,
) -> Estimate:
    """Return the estimate of an outcome. The runs it takes are not counted: no method is charged for them.

    rounds: how often the search may still go on from a better minimum
    """
    searched, model = model, model.aside()
    if model.deadline is not None:
        model.deadline.extend()
    outcome, near = _at_minimum(model, outcome)
    known = surroundings(model, outcome, near, options.profiles)
    judgement = _judged(model, near, known)
    better = _better(model, outcome, known, judgement) if rounds > 0 else None
    if better is not None:
        return conclude(searched, _followed(outcome, better), method, seed, wall, stages, options, rounds - 1)
    return assemble(
        searched, model, outcome, near, known, judgement, stages,
        method=method, seed=seed, wall_s=wall, resamples=options.bootstrap, sample=options.sample,
    )  # fmt: skip


def _at_minimum(model: ForwardModel, outcome: Outcome) -> tuple[Outcome, Evidence]:
    """Return the outcome by the turns nearest to its starts, at the end of its valley, and the evidence there."""
    outcome = unless_late(lambda: with_nearest_turns(model, outcome), outcome)
    near = evidence(model, outcome.point)
    if not near.looked:
        outcome = replace(outcome, ended=False, message=outcome.message or "no time was left for the intervals")
    return _settled(model, outcome, near)


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


def _judged(model: ForwardModel, near: Evidence, known: Surroundings) -> Judgement:
    """Return what the diagnostics find; a failure where the answer cannot be simulated."""
    if near.possible:
        late = Judgement([kinds.NO_TIME.found("no time was left to judge the answer")])
        at_answer = near.seen, near.at, near.tests, near.score_test(model)
        return unless_late(lambda: judge(model, known.outcome, *at_answer, known.values, known.combinations), late)
    why = f" ({model.failure})" if model.failure else ""
    text = f"no parameter set could be simulated{why}; look at starts, bounds and the scene"
    return Judgement([kinds.NOT_SIMULATED.found(text)])


def _better(model: ForwardModel, outcome: Outcome, known: Surroundings, judgement: Judgement) -> Descent | None:
    """Return a better minimum that a refit or a profile met, followed to its end; None if none was."""
    ended = outcome.ended and judgement.verdict is not Verdict.UNFINISHED
    met = judgement.better or (unless_late(lambda: _lower(model, outcome, known.profiled), None) if ended else None)
    return None if met is None else unless_late(lambda: descend_on(model, met), met)


def _lower(model: ForwardModel, outcome: Outcome, profiled: dict[str, Profile]) -> Descent | None:
    """Return the end of a descent from a place that a profile found below the answer; None if none was."""
    places = [found.place for found in profiled.values() if found.better]
    ends = descend_many(model, np.array(places)) if places else []
    best = min(ends, key=lambda end: end.fitness, default=None)
    return best if best is not None and lowers(model, best.fitness, outcome.fitness) else None


def _followed(outcome: Outcome, better: Descent) -> Outcome:
    """Return the outcome at a better minimum that a refit met, with a finding that says so."""
    text = f"a refit met a better minimum, of fitness {better.fitness:.3g} instead of {outcome.fitness:.3g}"
    said = kinds.BETTER_FOLLOWED.found(text, fitness=outcome.fitness, better=better.fitness)
    return replace(outcome.moved(better, "least squares from a refit"), findings=[*outcome.findings, said])
