"""One identification as one page that needs nothing else: verdict, table, motion, pictures."""

from __future__ import annotations

from typing import Any

from shoal.findings import sentence
from shoal.identification import Estimate
from shoal.identification.uncertainty.intervals import Value
from shoal.pictures import units
from shoal.pictures.answer import Answer
from shoal.pictures.drawn import Drawn
from shoal.pictures.gallery import gallery, motions
from shoal.pictures.motion import DrawnMotion
from shoal.pictures.numbers import length, power, rounded
from shoal.pictures.overlay import follows
from shoal.pictures.pages import animation, render, settings, software

_ENDS = 5
"""Ends of other searches that are listed."""


def report(answer: Answer, moving: list[DrawnMotion] | None = None, drawn: list[Drawn] | None = None) -> str:
    """The page as HTML without a reference to anything outside. Raises InputError."""
    return render(
        "estimate.html.j2",
        title=answer.estimate.problem,
        trusted=answer.estimate.verdict.trusted,
        lead=verdict(answer.estimate),
        provenance=provenance(answer.estimate),
        **findings(answer, moving, drawn),
    )


def findings(
    answer: Answer, moving: list[DrawnMotion] | None = None, drawn: list[Drawn] | None = None
) -> dict[str, Any]:
    """Return the data of findings.html.j2: answer, motion and evidence. Raises InputError."""
    moving = motions(answer) if moving is None else moving
    drawn = gallery(answer, moving) if drawn is None else drawn
    estimate = answer.estimate
    truth = ["truth"] * bool(estimate.truth)
    return {
        "answer_title": "The answer" if estimate.verdict.trusted else "Numbers that are no answer",
        "headings": ["parameter", "value", "standard deviation (noise)", "95 % interval", "known", *truth],
        "rows": _rows(answer),
        "reasons": [sentence(one.text) for one in estimate.findings],
        "remarks": _remarks(estimate),
        "motions": [animation(one, _machine(answer, one)) for one in moving],
        "pictures": [one.embedded() for one in drawn],
    }


def verdict(estimate: Estimate) -> str:
    """The verdict and how closely the model follows the data."""
    advice = "" if estimate.verdict.trusted else " Do not use these numbers."
    fit = f"Overall, {follows(estimate)}, after {estimate.evaluations} simulations."
    return f"Verdict: {estimate.verdict}.{advice} {fit}"


def shown(estimate: Estimate, value: Value) -> tuple[str, str, str, str]:
    """Value, standard deviation, 95 % interval and whether it is known, to two digits of the uncertainty."""
    known = estimate.known(value)
    if known != "yes":
        return f"{value.value:.3g}", "–", "–", known
    unit = value.std if value.std > 0 else 1e-6 * abs(value.value)
    interval = f"{rounded(value.lower, unit)} to {rounded(value.upper, unit)}"
    return rounded(value.value, unit), f"{value.std:.2g}", interval, known


def provenance(estimate: Estimate) -> list[tuple[str, str]]:
    """Return the provenance and the cost of the numbers."""
    model = dict(estimate.model)
    if stages := model.pop("selection", None):
        # What was chosen took the place of what the scene states.
        model = {"scene": model["scene"], "chosen": stages[-1]["model"]}
    return [
        ("data", estimate.data),
        ("method", f"{estimate.method}{f' ({estimate.choice})' if estimate.choice else ''}, seed {estimate.seed}"),
        ("engine", estimate.engine),
        ("model", settings(model)),
        ("fitness", f"{power(estimate.fitness)} {units.fitness_unit(estimate)} (mean square)"),
        ("effort", f"{estimate.evaluations} simulations in {estimate.wall_s:.2f} s"),
        ("scene", ", ".join(scene.fingerprint for scene in estimate.scenes.values())),
        ("versions", software()),
    ]


def _rows(answer: Answer) -> list[list[str]]:
    estimate, rows = answer.estimate, []
    for name, value in {**estimate.parameters, **estimate.quantities}.items():
        label = units.parameter(answer.problem, name) if name in estimate.parameters else name
        truth = [f"{estimate.truth[name]:.6g}" if name in estimate.truth else ""] if estimate.truth else []
        rows.append([label, *shown(estimate, value), *truth])
    return rows


def _remarks(estimate: Estimate) -> list[str]:
    tests = (f"Residuals, {sentence}." for sentence in estimate.residual_tests.sentences())
    sentences = (sentence(text) for text in (*estimate.combinations, *estimate.notes))
    remarks = [*(f"Next: {step}." for step in estimate.advice), *sentences, *tests]
    if estimate.model_error_rms is not None:
        error = length(estimate.model_error_rms)
        remarks.append(f"Mesh and steps of the model are off by {error} (RMS); the intervals include it.")
    remarks += [
        f"Model for {length(stage['tolerance'])}: {stage['model']}, off by about {length(stage['error'])}; "
        f"{stage['evaluations']} simulations."
        for stage in estimate.model.get("selection", ())
    ]
    remarks += [
        f"Held out {one.window[0]:g} s to {one.window[1]:g} s, {c.name}: predicted to "
        f"{power(c.rms, 2)} {c.unit} (RMS)"
        + ("." if c.inside is None else f"; 95 % of such windows stay below {power(c.limit, 2)} {c.unit}.")
        for one in estimate.prediction
        for c in one.channels
    ]
    if estimate.bootstrap is not None:
        for name in estimate.parameters:
            low, high = estimate.bootstrap.interval(name)
            draws = len(estimate.bootstrap.draws)
            remarks.append(f"Bootstrap of {name}, {draws} draws: 95 % between {low:.6g} and {high:.6g}.")
    if estimate.posterior is not None:
        remarks += [
            f"Posterior of {name}: median {rounded(one.median, one.sd)}, 95 % between {rounded(one.lower, one.sd)} and "
            f"{rounded(one.upper, one.sd)}; {one.size:.0f} effective draws, R-hat {one.r_hat:.3f}."
            for name, one in estimate.posterior.marginals.items()
        ]
    for other in estimate.minima[:_ENDS]:
        values = ", ".join(f"{name} {value:.4g}" for name, value in other.items() if name != "fitness")
        fit = f"{power(other['fitness'], 2)} {units.fitness_unit(estimate)}"
        remarks.append(f"Another search ended at {values}; fitness {fit}.")
    return remarks


def _machine(answer: Answer, one: DrawnMotion) -> str:
    machine = "identified machine" if answer.estimate.verdict.trusted else "fitted machine"
    return f"Recording {one.name}: the {machine}" if len(answer.estimate.scenes) > 1 else f"The {machine}"
