"""One identification as one page that needs nothing else: verdict, table, motion, pictures."""

from __future__ import annotations

import json
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from shoal.pictures.answer import Answer
from shoal.pictures.gallery import Drawn, gallery, motions
from shoal.pictures.motion import Motion, plain_motion
from shoal.pictures.overlay import follows
from shoal.versions import versions

_SPEEDS = {"half": 0.5, "a fifth": 0.2, "a tenth": 0.1, "a fiftieth": 0.02, "five times": 5.0}
_ENDS = 5
"""Ends of other searches that are listed."""
_SHOWN = 5.0
"""Seconds that a motion should take on the screen."""


def environment() -> Environment:
    """Jinja's environment with the parts that pages share: macros.html.j2, page.css, animation.js."""
    loader = PackageLoader("shoal.pictures", "page")
    return Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True, loader=loader)


def report(answer: Answer, moving: list[Motion] | None = None, drawn: list[Drawn] | None = None) -> str:
    """The page as HTML without a reference to anything outside. Raises InputError."""
    moving = motions(answer) if moving is None else moving
    drawn = gallery(answer, moving) if drawn is None else drawn
    estimate = answer.estimate
    return (
        environment()
        .get_template("estimate.html.j2")
        .render(
            estimate=estimate,
            verdict=_verdict(answer),
            headings=[
                "parameter",
                "value",
                "standard deviation",
                "95 % interval",
                "known",
                *(["truth"] * bool(estimate.truth)),
            ],
            rows=_rows(answer),
            remarks=_remarks(answer),
            motions=[_moving(answer, one) for one in moving],
            speeds=list(_SPEEDS.items()),
            pictures=[one.embedded() for one in drawn],
            provenance=_provenance(answer),
        )
    )


def _verdict(answer: Answer) -> str:
    estimate = answer.estimate
    reason = f" ({estimate.message})" if estimate.message else ""
    advice = "" if estimate.verdict.trusted else " Do not use these numbers."
    fit = f"Overall, {follows(estimate)}, after {estimate.evaluations} simulations."
    return f"Verdict: {estimate.verdict}{reason}.{advice} {fit}"


def _rows(answer: Answer) -> list[list[str]]:
    estimate, rows = answer.estimate, []
    for name, value in {**estimate.parameters, **estimate.quantities}.items():
        known = "yes" if value.identifiable else "at bound" if value.at_bound else "no"
        interval = f"{value.lower:.6g} to {value.upper:.6g}" if value.identifiable else "–"
        row = [name, f"{value.value:.8g}", f"{value.std:.2g}" if value.identifiable else "–", interval, known]
        truth = [f"{estimate.truth[name]:.8g}" if name in estimate.truth else ""] if estimate.truth else []
        rows.append(row + truth)
    return rows


def _remarks(answer: Answer) -> list[str]:
    estimate = answer.estimate
    tests = (f"Residuals, {sentence}." for sentence in estimate.residual_tests.sentences())
    remarks = [*(f"Next: {step}." for step in estimate.advice), *estimate.combinations, *estimate.notes, *tests]
    if estimate.model_error_rms is not None:
        remarks.append(
            f"The mesh of the model is off by {estimate.model_error_rms:.1e} m (RMS); the intervals include it."
        )
    for other in sorted(estimate.minima, key=lambda minimum: minimum["fitness"])[:_ENDS]:
        values = ", ".join(f"{name} {value:.4g}" for name, value in other.items())
        remarks.append(f"Another search ended at {values}.")
    return remarks


def _moving(answer: Answer, found: Motion) -> dict[str, Any]:
    span = float(found.times[-1] - found.times[0])
    speed = min(_SPEEDS.values(), key=lambda factor: abs(span / factor - _SHOWN))
    if abs(span - _SHOWN) <= abs(span / speed - _SHOWN):
        speed = 1.0
    bodies = ", ".join(found.outlines)
    # "</" would end the script element.
    data = json.dumps(plain_motion(found), allow_nan=False).replace("</", "<\\/")
    return {
        "name": found.recording,
        "speed": speed,
        "alt": f"Animation of {bodies} over the measured places, {span:.3g} s. A picture below shows poses of it.",
        "caption": f"{found.recording}: the identified machine (blue) with its markers (red) over the measured places "
        "(black circles) and directions (orange).",
        "data": Markup(data),
    }


def _provenance(answer: Answer) -> list[tuple[str, str]]:
    estimate = answer.estimate
    found = ", ".join(f"{package} {number}" for package, number in versions(("shoal", "numpy", "numba")).items())
    return [
        ("data", estimate.data),
        ("method", f"{estimate.method}{f' ({estimate.choice})' if estimate.choice else ''}, seed {estimate.seed}"),
        ("engine", estimate.engine),
        ("model", ", ".join(f"{name} = {value}" for name, value in estimate.model.items())),
        ("fitness", f"{estimate.fitness:.6g}"),
        ("effort", f"{estimate.evaluations} simulations in {estimate.wall_s:.2f} s"),
        ("scene", ", ".join(scene.fingerprint for scene in estimate.scenes.values())),
        ("versions", found),
    ]
