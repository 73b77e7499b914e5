"""The verdict: what the evidence allows to say about an answer, why, and what to do next."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.special import chdtri

from shoal.identification.estimate import Value, Verdict
from shoal.identification.forward import ForwardModel
from shoal.identification.methods import Outcome
from shoal.identification.residual_tests import ResidualTests
from shoal.identification.sensitivity import Sensitivity
from shoal.identification.suspects import Suspect, suspects
from shoal.identification.swaps import exchanged
from shoal.identification.uncertainty import LEVEL, Linearisation
from shoal.trajectory import Array

_DECISIVE = 5.0
"""A property of the measurement that lowers even a small misfit by this factor refutes what was stated of it."""
_NEGLIGIBLE = 1e-4
"""Of the signal: a misfit below it is not looked into."""
_FEWEST = 3
"""More numbers than parameters that have to be measured for what the fit leaves to tell the noise."""
_APART = 1e-3
"""Of a parameter's range: points that differ by less are the same."""


@dataclass(frozen=True)
class Judgement:
    """The verdict, why, what to do next, and the properties of the measurement that would explain a misfit."""

    verdict: Verdict
    message: str = ""
    advice: list[str] = field(default_factory=list)
    suspects: list[Suspect] = field(default_factory=list)


def judge(
    model: ForwardModel,
    outcome: Outcome,
    seen: Sensitivity,
    at: Linearisation,
    tests: ResidualTests,
    parameters: Mapping[str, Value],
    unknown: list[str],
) -> Judgement:
    """The verdict on an outcome: failures first, then the model, then rivals, then what is identifiable."""
    if not outcome.ended:
        advice = ["allow more time, or start from a better place"]
        return Judgement(Verdict.FAILED, outcome.message or "the method did not come to its end", advice)
    if few(model):
        reason = f"{tests.rows} measured numbers for {len(parameters)} unknown: too few to tell how uncertain they are"
        return Judgement(Verdict.FAILED, reason, ["measure more, or state the noise of the channels"])
    found: list[Suspect] = []
    if tests.systematic and tests.size > _NEGLIGIBLE * tests.signal:
        found = suspects(model, outcome.point, seen.residual, seen.jacobian, float(np.hypot(tests.noise, tests.mesh))).suspects
    if tests.wrong_model or (found and found[0].before >= _DECISIVE * found[0].after):
        return _rejected(model, tests, found)
    rivals = [rival for rival in rivals_of(model, outcome, at) if not _within(model, rival, parameters)]
    if rivals:
        kinds = {relation(model, outcome.point, rival) for rival in rivals}
        message = f"{1 + len(rivals)} parameter sets fit equally well ({', '.join(sorted(kinds))})"
        advice = ["measure another marker or a longer motion, or narrow the bounds to the set that is meant"]
        return Judgement(Verdict.AMBIGUOUS, message, advice, found)
    return _identifiable(seen, tests, parameters, unknown, found)


def _rejected(model: ForwardModel, tests: ResidualTests, found: list[Suspect]) -> Judgement:
    reason = f"the best fit is off by {tests.sized(tests.size)}, {_against(tests)}"
    advice = []
    if found:
        reason += f"; {found[0]}"
        # A clock and gravity, for instance, have the same effect on a free swing.
        equals = [other.words for other in found[1:] if other.after < 1.5 * found[0].after]
        reason += f" (as would {', '.join(equals)})" if equals else ""
        advice.append(f"check the {' or the '.join(s.words for s in found)}, or seek it as a parameter")
    if (exchange := exchanged(model)) is not None:
        reason += f"; {exchange}"
        advice.append("check which column is which marker")
    advice.append("look for another minimum (--method multi-start)")
    if not found:
        advice.append("check lengths, masses and friction of the model, and which bodies bend")
    return Judgement(Verdict.REJECTED, reason, advice, found)


def _against(tests: ResidualTests) -> str:
    if tests.noise_stated:
        return f"{tests.ratio:.0f} times the noise of {tests.sized(tests.noise)}"
    return f"and not by noise; the data vary by {tests.sized(tests.signal)}"


def few(model: ForwardModel) -> bool:
    """Whether so little was measured that its noise, which is not stated, cannot be told: then no interval can."""
    return model.noise is None and len(model.rows.time) < len(model.names) + _FEWEST


def _identifiable(
    seen: Sensitivity,
    tests: ResidualTests,
    parameters: Mapping[str, Value],
    unknown: list[str],
    found: list[Suspect],
) -> Judgement:
    """Identified, wholly or up to a combination, with what has to be said beside."""
    reasons, notes, advice = [], [], []
    if at_bound := [name for name, value in parameters.items() if value.at_bound]:
        reasons.append(f"{', '.join(at_bound)} ended at a bound and is not identified")
        advice.append("widen the bound, or give the parameter its value there")
    if unknown:
        reasons.append(f"only combinations are known: {len(unknown)} direction(s) leave the motion unchanged")
        advice.append("fix one parameter of each combination, or rely on the quantities that are identifiable")
    elif vague := [name for name, v in parameters.items() if not v.identifiable and not v.at_bound]:
        reasons.append(f"{', '.join(vague)}: less certain than the range between the bounds")
        advice.append("measure longer or with less noise, or add what is known as a prior")
    if not seen.reliable:
        known = f"rest on the first {seen.end:.3g} s" if seen.end is not None else "are in doubt"
        notes.append(f"the motion is chaotic, or its steps coarse: the intervals {known}")
        advice.append("shorten the motion, or tighten the solver's tolerances")
    if tests.systematic and tests.size > _NEGLIGIBLE * tests.signal:
        share = 100 * tests.size / tests.signal
        size = f"{tests.sized(tests.size)} ({share:.2g} % of the signal)"
        notes.append(f"a systematic residual of {size} widens the intervals")
        notes += [str(found[0])] if found else []
    verdict = Verdict.COMBINATION if reasons else Verdict.IDENTIFIED
    return Judgement(verdict, "; ".join([*reasons, *notes]), advice, found)


def rivals_of(model: ForwardModel, outcome: Outcome, at: Linearisation) -> list[Array]:
    """Other minima that fit as well as the noise can tell, without repetitions, (parameters,) each."""
    # Of the sum of squares; correlated noise makes larger differences by chance.
    chance = max(seen.variance / seen.independent(1) for seen in at.noise)
    doubt = float(chdtri(len(outcome.point), 1.0 - LEVEL)) * chance / model.samples
    least = max(outcome.fitness, model.things * (model.noise or 0.0) ** 2)
    limit = outcome.fitness + min(doubt, 0.5 * least) + 1e-18
    found: list[Array] = []
    for point, fitness in outcome.minima:
        if fitness <= limit and all(apart(model, point, other) for other in (outcome.point, *found)):
            found.append(point)
    return found


def apart(model: ForwardModel, one: Array, other: Array) -> bool:
    """Whether two points are different machines; angles that differ by whole turns are not."""
    return bool(np.any(_differing(model, one, other)))


def _within(model: ForwardModel, point: Array, parameters: Mapping[str, Value]) -> bool:
    """Whether intervals that are wide for the mesh's own error, more than for noise, include a point already."""
    if not any(value.correction is not None and abs(value.correction) > value.std for value in parameters.values()):
        return False
    values = zip(model.names, model.parameters.to_values(point), strict=True)
    return all(parameters[name].lower <= value <= parameters[name].upper for name, value in values)


def relation(model: ForwardModel, one: Array, other: Array) -> str:
    """What another solution is to the first: a mirror image, or just different."""
    differing = np.flatnonzero(_differing(model, one, other))
    paths = [entry.parameter.path or "" for entry in model.parameters.entries.values()]
    if all(paths[k].startswith("initial.") for k in differing):
        return "mirror images: the same marker positions with another pose"
    span = model.upper - model.lower
    if np.all(np.abs(np.abs(one) - np.abs(other)) <= _APART * span):
        return "mirror images: parameters with the opposite sign"
    return "different machines"


def _differing(model: ForwardModel, one: Array, other: Array) -> Array:
    paths = [entry.parameter.path or "" for entry in model.parameters.entries.values()]
    turning = np.array([path.startswith("initial.") and path.endswith(".angle") for path in paths])
    difference = np.abs(one - other)
    turned = np.abs(difference - 2 * np.pi * np.round(difference / (2 * np.pi)))
    difference = np.where(turning, turned, difference)
    return np.asarray(difference / (model.upper - model.lower) > _APART)
