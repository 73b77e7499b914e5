"""Judge an answer: the findings of all diagnostics, from which its verdict follows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from shoal.findings import Finding
from shoal.identification import findings as kinds
from shoal.identification.conventions import OUTLIER
from shoal.identification.deadline import TimeIsUp
from shoal.identification.diagnostics.hypotheses import SAMPLES, Hypothesis, ScoreTest
from shoal.identification.diagnostics.minima.rivals import ALIAS, relation, rivals_of, rows_of, within
from shoal.identification.diagnostics.other_laws import OtherLaw, other_laws
from shoal.identification.diagnostics.residual_tests import ResidualTests, residual_tests
from shoal.identification.diagnostics.stationarity import downhill, sentence
from shoal.identification.diagnostics.suspects import FaultSearch, Suspect, suspects
from shoal.identification.findings import Verdict, verdict_of
from shoal.identification.forward import ForwardModel
from shoal.identification.methods.growth import LARGE, growth
from shoal.identification.methods.lanes import Descent
from shoal.identification.methods.outcome import Outcome
from shoal.identification.uncertainty.covariance import blocks_of
from shoal.identification.uncertainty.intervals import Refit, Value, few, with_refits
from shoal.identification.uncertainty.linearisation import Linearisation, linearise
from shoal.identification.uncertainty.sensitivity import Sensitivity
from shoal.trajectory import Array

_DECISIVE = 5.0
"""What lowers even a small misfit by this factor refutes what was stated, though intervals that hold it were wide."""
_NEGLIGIBLE = 1e-4
"""Of the signal: a misfit below it is not looked into."""
_OTHERS = 3
"""Suspects that explain less than the best, and are named beside it."""


@dataclass(frozen=True)
class Judgement:
    """Findings, suspects and refits of the diagnostics of an answer.

    suspects: what was taken as known and would lower a misfit if it were freed, the best first
    refits: fits with what would explain a misfit that is not held against the model; the intervals hold them too
    better: a minimum that fits better, if the search for suspects met one: go on from there
    hypotheses: the tests of what was taken as known, the most significant first, then the other minima
    laws: other laws beside each friction that is sought
    """

    findings: list[Finding] = field(default_factory=list)
    suspects: list[Suspect] = field(default_factory=list)
    refits: list[Refit] = field(default_factory=list)
    better: Descent | None = None
    hypotheses: list[Hypothesis] = field(default_factory=list)
    laws: list[OtherLaw] = field(default_factory=list)

    @property
    def verdict(self) -> Verdict:
        """The worst verdict that the findings imply."""
        return verdict_of(self.findings)


def judge(
    model: ForwardModel,
    outcome: Outcome,
    seen: Sensitivity,
    at: Linearisation,
    tests: ResidualTests,
    test: ScoreTest,
    parameters: dict[str, Value],
    unknown: list[str],
) -> Judgement:
    """The verdict on an outcome: failures first, then the minimum, the model, rivals, and what is identifiable.

    seen, at, tests: derivatives, linearisation and residual tests there; test: of what was taken as known
    """
    if not outcome.ended:
        return Judgement([kinds.STOPPED.found(outcome.message or "the method did not come to its end")])
    if few(model):
        reason = f"{tests.rows} measured numbers for {len(parameters)} unknown: too few to tell how uncertain they are"
        return Judgement([kinds.TOO_FEW.found(reason, rows=tests.rows, parameters=len(parameters))])
    if unfinished := _unfinished(model, outcome.point, seen):
        return Judgement([unfinished])
    if tests.wrong_model and seen.end is not None and _fits_until(model, outcome.point, seen):
        cause, remedy = _rough(model, seen)
        reason = f"{cause}: the model fits the first {seen.end:.3g} s; beyond, where "
        reason += f"the misfit is that makes {tests.sized(tests.size)} of all, nothing tells whether this is a minimum"
        return Judgement([kinds.BEGINNING_ONLY.found(reason, remedy, end=seen.end, residual=tests.size)])
    looked, seen_well = FaultSearch(), tests.size > _NEGLIGIBLE * tests.signal
    misfitting = (tests.limited or tests.wrong_model) and seen_well
    if seen_well:
        at_answer = outcome.point, seen.residual, seen.jacobian, tests.explained
        looked = suspects(model, *at_answer, test=test, misfit=misfitting)
    laws = other_laws(model, outcome.point, seen, looked.effects)
    judged = _by_findings(model, outcome, seen, at, tests, parameters, unknown, looked, laws, misfitting)
    hypotheses = [*looked.hypotheses, *rows_of(model, outcome, at)]
    return replace(judged, suspects=looked.suspects, hypotheses=hypotheses, laws=laws)


def _by_findings(
    model: ForwardModel,
    outcome: Outcome,
    seen: Sensitivity,
    at: Linearisation,
    tests: ResidualTests,
    parameters: dict[str, Value],
    unknown: list[str],
    looked: FaultSearch,
    laws: list[OtherLaw],
    misfitting: bool,
) -> Judgement:
    """Judge a minimum by what was found of the things taken as known."""
    if (better := looked.better) is not None:
        reason = f"a better minimum was met, of fitness {better.fitness:.3g} instead of {outcome.fitness:.3g}"
        met = kinds.BETTER_MINIMUM.found(reason, fitness=outcome.fitness, better=better.fitness)
        return Judgement([met], better=better)
    found = looked.suspects
    moved = _moved(parameters, looked, {law.name for law in laws}, tests.rows)
    # Samples that contradict the others refute nothing that was stated.
    decisive = bool(found) and found[0].kind not in SAMPLES and found[0].before >= _DECISIVE * found[0].after
    if tests.wrong_model or decisive or (misfitting and moved):
        return Judgement(_rejected(model, seen, tests, found))
    if moved:
        return Judgement([_contradicted(tests, looked, moved)])
    if looked.cut and misfitting:
        reason = f"no time was left to see what a misfit of {tests.sized(tests.size)} is due to"
        return Judgement([kinds.NO_TIME.found(reason, residual=tests.size)])
    if not outcome.converged:
        return Judgement([kinds.NO_CONVERGENCE.found(outcome.message or "the search did not converge")])
    rivals = [rival for rival in rivals_of(model, outcome, at) if not within(model, rival, parameters)]
    if rivals:
        return Judgement([_ambiguous({relation(model, outcome.point, rival) for rival in rivals}, 1 + len(rivals))])
    refits = [*looked.refits.values()]
    values = with_refits(model, parameters, refits)
    limits = _limits(values, unknown)
    return Judgement([*limits, *_cautions(model, seen, tests, found)], refits=refits)


def _ambiguous(relations: set[str], count: int) -> Finding:
    """Return the finding that several parameter sets fit equally well, by their relations to the answer."""
    more = ["sample more often"] * (ALIAS in relations)
    more += ["measure another marker or a longer motion"] * (relations != {ALIAS})
    advice = f"{', or '.join(more)}, or narrow the bounds to the set that is meant"
    text = f"{count} parameter sets fit equally well ({', '.join(sorted(relations))})"
    return kinds.SEVERAL_MINIMA.found(text, advice, minima=count)


def _moved(parameters: Mapping[str, Value], looked: FaultSearch, laws: set[str], rows: int) -> list[str]:
    """Return the parameters that the best significant suspects, by `rows` rows, take out of their intervals.

    Another reading of the data has no interval in common with the stated one: it moves all parameters.
    laws: names of those beside a sought friction, which widen its interval
    """
    stated = [s for s in looked.suspects if s.kind not in SAMPLES and s.name not in laws]
    best = {(s.name, s.kind) for s in stated if s.significant and s.equals(looked.suspects[0], rows)}
    ends = [looked.refits[key].values() if key in looked.refits else {} for key in best]
    return [
        name
        for name, known in parameters.items()
        if any(name not in end or not known.lower <= end[name].value <= known.upper for end in ends)
    ]


def _contradicted(tests: ResidualTests, looked: FaultSearch, moved: list[str]) -> Finding:
    """The rejection of a model that fits no worse than noise, but significantly worse than with something freed."""
    cause, advice = _named(looked.suspects, tests.rows)
    best = looked.hypotheses[0]
    reason = f"the data contradict what is taken as known: {cause}"
    reason += f" (score tests of {len(looked.hypotheses)} hypotheses: p = {best.corrected:.1g}) and move"
    numbers = {"p_value": best.corrected, "hypotheses": len(looked.hypotheses)}
    return kinds.CONTRADICTED.found(f"{reason} {', '.join(moved)}", *advice, **numbers)


def _unfinished(model: ForwardModel, point: Array, seen: Sensitivity) -> Finding | None:
    """Return why a point is no end of a search; None if it may be one."""
    outside = (point < model.lower) | (point > model.upper)
    if np.any(outside):
        names = ", ".join(name for name, out in zip(model.names, outside, strict=True) if out)
        return kinds.OUT_OF_BOUNDS.found(f"{names} ended outside the bounds of the search")
    try:
        better = downhill(model, point, seen)
    except TimeIsUp:
        return kinds.NOT_STATIONARY.found("no time was left to see whether the answer is a minimum")
    if better is None:
        return None
    numbers = {"fitness": better.before, "better": better.fitness, "distance": better.distance}
    return kinds.NOT_STATIONARY.found(sentence(model, point, better), **numbers)


def _fits_until(model: ForwardModel, point: Array, seen: Sensitivity) -> bool:
    """Return whether the residuals do not refute the model up to where its derivatives can be believed."""
    assert seen.end is not None
    part = model.until(seen.end)
    kept = model.rows.time <= seen.end + 1e-12
    kept = np.append(kept, np.ones(len(seen.residual) - len(kept), dtype=bool))
    blocks = blocks_of(part, int(np.sum(kept)))
    near = linearise(seen.jacobian[kept], seen.residual[kept], model.sizes(point), blocks, seen.error[kept])
    return not residual_tests(part, seen.residual[kept], blocks, near.noise).wrong_model


def _rejected(model: ForwardModel, seen: Sensitivity, tests: ResidualTests, found: list[Suspect]) -> list[Finding]:
    """Return the misfit and its likely causes, the likeliest first."""
    numbers = {"residual": tests.size, "noise": tests.noise, "signal": tests.signal}
    text = f"the best fit is off by {tests.sized(tests.size)}, {_against(tests)}"
    causes = _causes(found, tests.rows)
    for name, off in _against_priors(model, seen.residual):
        said = f"{name} is {off:.2g} standard deviations off its prior"
        causes.insert(0, kinds.PRIOR.found(said, f"check the prior of {name}", standard_deviations=off))
    more = () if causes else ("check lengths, masses and friction of the model, and which bodies bend",)
    return [kinds.MISFIT.found(text, *more, **numbers), *causes]


_CAUSES = {"recording": kinds.ODD_RECORDING, "stretch": kinds.ODD_STRETCH}
"""Kinds of findings by those of suspects; the others are likely causes."""


def _causes(found: list[Suspect], rows: int) -> list[Finding]:
    """Return the likely cause of a misfit, the best suspect with its equals; then the best samples that contradict it.

    A recording that contradicts the others is where a cause is that frees fewer numbers.
    """
    odd = next((s for s in found if s.kind in SAMPLES), None)
    best = [found[0], *([odd] if odd is not None and odd is not found[0] else [])] if found else []
    return [_cause([one, *(s for s in found if s is not one)], rows) for one in best]


def _cause(found: list[Suspect], rows: int) -> Finding:
    """Return the finding about the first suspect, with its equals."""
    text, advice = _named(found, rows)
    best = found[0]
    numbers = {"stated": best.stated, "fitted": best.value, "before": best.before, "after": best.after}
    return _CAUSES.get(best.kind, kinds.CAUSE).found(text, *advice, **numbers)


_SEEK = {
    "data": "",
    "bounds": ": widen its bounds",
    "recording": "",
    "stretch": ": cells of a lost marker are left empty",
}
"""What else to do than to check a suspect, by its kind."""


def _named(found: list[Suspect], rows: int) -> tuple[str, list[str]]:
    """The best suspect with its equals, and what to do about them, in words."""
    # A clock and gravity, for instance, have the same effect on a free swing.
    best, *equals = (suspect.words for suspect in found if suspect.equals(found[0], rows))
    cause = f"{found[0]} (as would {', '.join(equals)})" if equals else str(found[0])
    others = [suspect.words for suspect in found if suspect.words not in (best, *equals)][:_OTHERS]
    seek = _SEEK.get(found[0].kind, ", or seek it as a parameter")
    advice = [f"check the {' or the '.join([best, *equals])}{seek}"]
    return cause, advice + ([f"less likely: the {' or the '.join(others)}"] if others else [])


def _against_priors(model: ForwardModel, residual: Array) -> list[tuple[str, float]]:
    """Parameters whose priors the data contradict, and by how many standard deviations, the farthest last."""
    off = np.abs(residual[len(model.rows.time) :]) / (model.rows.noise or 1.0)
    named = [(model.names[k], float(far)) for (k, _), far in zip(model.parameters.priors, off, strict=True)]
    return sorted((one for one in named if one[1] > OUTLIER), key=lambda one: one[1])


def _against(tests: ResidualTests) -> str:
    if tests.explains_nothing:
        less = "no less" if tests.size >= tests.signal else "hardly less"
        advice = "" if tests.noise_stated else " (state the noise if it is so large)"
        return f"{less} than a constant: the data vary by {tests.sized(tests.signal)}{advice}"
    if tests.noise_stated:
        kind = "which is like white noise" if tests.white else "which is not white noise"
        return f"{tests.ratio:.2g} times the noise of {tests.sized(tests.noise)}, {kind}"
    return f"and not by noise; the data vary by {tests.sized(tests.signal)}"


def _rough(model: ForwardModel, seen: Sensitivity) -> tuple[str, str]:
    """Reason why derivatives by two steps differ, and remedy: a chaotic motion, or a rough solver."""
    if growth(model, seen.jacobian) > LARGE:
        return "the motion is chaotic", "shorten the record, or tighten the solver's tolerances"
    cause = "the solver's steps are too coarse for derivatives, or the motion jumps"
    return cause, "shorten solver.step, or tighten the solver's tolerances"


def _limits(parameters: Mapping[str, Value], unknown: list[str]) -> list[Finding]:
    """Return why only a part of the parameters is identified. unknown: combinations that the data leave open."""
    found = list[Finding]()
    if at_bound := [name for name, value in parameters.items() if value.at_bound]:
        found.append(kinds.AT_BOUND.found(f"{', '.join(at_bound)} ended at a bound and is not identified"))
    if unknown:
        text = "only combinations are known: some changes of the parameters leave the motion unchanged"
        found.append(kinds.CONFOUNDED.found(text))
    elif vague := [name for name, v in parameters.items() if not v.identifiable and not v.at_bound]:
        found.append(kinds.VAGUE.found(f"{', '.join(vague)}: known no better than by the bounds"))
    return found


def _cautions(model: ForwardModel, seen: Sensitivity, tests: ResidualTests, found: list[Suspect]) -> list[Finding]:
    """Return what limits the intervals of an answer that is not rejected."""
    noted = list[Finding]()
    if not seen.reliable:
        known = f"rest on the first {seen.end:.3g} s" if seen.end is not None else "are in doubt"
        cause, remedy = _rough(model, seen)
        noted.append(kinds.ROUGH.found(f"{cause}: the intervals {known}", remedy))
    systematic = tests.limited and tests.size > _NEGLIGIBLE * tests.signal > 0.0
    if systematic:
        share = 100 * tests.excess / tests.signal
        size = f"{tests.sized(tests.excess)} ({share:.2g} % of the signal)"
        text = f"a systematic residual of {size} widens the intervals: the model, not the noise, limits them"
        noted.append(kinds.SYSTEMATIC.found(text, excess=tests.excess, signal=tests.signal))
    if found and found[0].kind in SAMPLES:
        noted.append(_cause(found, tests.rows))
    elif found:
        noted.append(kinds.CAUSE.found(f"{found[0]}; the intervals hold the answer with it too"))
    if not systematic and not found and tests.too_large:
        text = f"the noise is {tests.ratio:.3g} times what was stated; the intervals go by what was found"
        noted.append(kinds.NOISE_UNDERSTATED.found(text, ratio=tests.ratio))
    if tests.unresolved:
        text = "the samples do not resolve the motion: what the model leaves out of it between them is not seen"
        noted.append(kinds.UNRESOLVED.found(text))
    return noted
