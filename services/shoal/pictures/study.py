"""Several identifications of one problem as one page: what each found and paid, then the best of them in full."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from shoal.engines.compare import Comparison, compare
from shoal.errors import InputError
from shoal.identification import Estimate
from shoal.pictures import titles, units
from shoal.pictures.answer import Answer
from shoal.pictures.convergence import convergence
from shoal.pictures.drawn import Drawn
from shoal.pictures.engines import engines
from shoal.pictures.gallery import gallery, motions
from shoal.pictures.numbers import length, power
from shoal.pictures.pages import render
from shoal.pictures.remainders import remainders
from shoal.pictures.report import findings, provenance, report, shown, verdict


def study(answers: Mapping[str, Answer], title: str = "") -> str:
    """The page of a study, or of its only identification; by the name of each. Raises InputError."""
    if len(answers) == 1:
        return report(next(iter(answers.values())))
    problems = {answer.problem.name for answer in answers.values()}
    if len(problems) > 1:
        raise InputError(f"run: one report is of one problem, found {', '.join(sorted(problems))}")
    estimates = {name: answer.estimate for name, answer in answers.items()}
    best = best_of(estimates)
    chosen = answers[best]
    moving = motions(chosen)
    # Its convergence is among those of all.
    drawn = [one for one in gallery(chosen, moving) if one.name != "convergence"]
    return render(
        "study.html.j2",
        title=title or f"{chosen.problem.name}, {len(answers)} identifications",
        trusted=chosen.estimate.verdict.trusted,
        lead=f"Best: {best}. {verdict(chosen.estimate)}",
        summary=_summary(estimates, best),
        study_headings=_headings(chosen),
        study_rows=[_row(name, estimate) for name, estimate in estimates.items()],
        study_pictures=[one.embedded() for one in _pictures(estimates, chosen)],
        provenance=provenance(chosen.estimate),
        **{**findings(chosen, moving, drawn), "answer_title": f"The best: {best}"},
    )


def best_of(estimates: Mapping[str, Estimate]) -> str:
    """The name of the first that is as good as the best, a trusted one if there is any."""
    trusted = {name: estimate for name, estimate in estimates.items() if estimate.verdict.trusted} or estimates
    found = titles.best(trusted)
    return next(name for name, estimate in trusted.items() if estimate is found)


def _headings(chosen: Answer) -> list[str]:
    parameters = (units.parameter(chosen.problem, name) for name in chosen.estimate.parameters)
    fit = (f"fitness [{units.fitness_unit(chosen.estimate)}]", f"RMS [{units.rms_unit(chosen.estimate)}]")
    return ["run", *parameters, *fit, "evaluations", "time [s]", "verdict"]


def _row(name: str, estimate: Estimate) -> list[str]:
    values = [shown(estimate, value)[0] for value in estimate.parameters.values()]
    numbers = [power(estimate.fitness), f"{estimate.rms:.3g}", str(estimate.evaluations), f"{estimate.wall_s:.1f}"]
    return [name, *values, *numbers, str(estimate.verdict)]


def _summary(estimates: Mapping[str, Estimate], best: str) -> list[str]:
    trusted = [name for name, estimate in estimates.items() if estimate.verdict.trusted]
    sentences = [f"{len(trusted)} of {len(estimates)} identifications ended in an answer that can be used."]
    name = estimates[best].problem
    sentences += [f"{text.removeprefix(f'{name}: ').capitalize()}." for text in (titles.leaves(name, estimates),)]
    for parameter, value in estimates[best].parameters.items():
        number, _, interval, known = shown(estimates[best], value)
        if known != "yes":
            sentences.append(f"{parameter} is not known from these data ({known}).")
            continue
        others = [estimates[one].parameters[parameter].value for one in trusted]
        spread = f"; the usable answers spread over {np.ptp(others):.1g}" if len(others) > 1 else ""
        sentences.append(f"{parameter} = {number}, 95 % interval {interval}{spread}.")
    return sentences


def _pictures(estimates: Mapping[str, Estimate], best: Answer) -> list[Drawn]:
    name = best.problem.name
    drawn = [
        Drawn(
            "convergence",
            convergence(estimates, titles.pays(name, estimates)),
            f"Best fitness against counted evaluations of {', '.join(estimates)}, both axes logarithmic.",
            "A marker stands where a method ended.",
        ),
        Drawn(
            "remainders",
            remainders(estimates, titles.leaves(name, estimates)),
            f"Distance of model and data against time for {', '.join(estimates)}; equal fits lie on one line.",
            "What remains of the motion that each fitted model does not explain.",
        ),
    ]
    names = list(dict.fromkeys(estimate.engine for estimate in estimates.values()))
    if len(names) > 1:
        drawn.append(_engines(compare(best.estimate.scene, names)))
    return drawn


def _engines(comparison: Comparison) -> Drawn:
    marker = list(comparison.scene.markers)[-1]
    largest = max((row["largest"] or np.nan for row in comparison.differences()), default=np.nan)
    alt = f"Position of {marker} by {', '.join(comparison.trajectories)}; they are at most {length(largest)} apart."
    title = titles.agrees(comparison, marker)
    return Drawn("engines", engines(comparison, marker, title), alt, "The identified machine on every engine used.")
