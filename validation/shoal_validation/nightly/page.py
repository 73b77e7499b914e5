"""One HTML page of a night, in words first; nothing on it comes from elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.resources import files
from typing import Any

from jinja2 import Environment, StrictUndefined
from markupsafe import Markup

from shoal_validation.nightly.chart import trend
from shoal_validation.nightly.history import NIGHTS, track
from shoal_validation.nightly.own import OWN
from shoal_validation.nightly.result import Night, Result, Verdict, apart
from shoal_validation.problems import PROBLEMS

SHOWN = 60
"""Nights in a chart."""


def render(night: Night, before: Sequence[Night]) -> str:
    """The page as HTML; `before` are earlier nights of the same machine, oldest first."""
    nights = [*before, night][-SHOWN:]
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    text = (files("shoal_validation.nightly") / "page.html.j2").read_text(encoding="utf-8")
    bad = sorted(
        (line for line in night.lines if not line.verdict.fine), key=lambda line: list(Verdict).index(line.verdict)
    )
    return environment.from_string(text).render(
        night=night,
        headline=headline(night),
        kind=f"{'quick' if night.quick else 'full'} run" + (f" of {night.only} only" if night.only else ""),
        bad=[_line(line, nights) for line in reversed(bad)],
        groups=[_group(name, night, nights) for name in dict.fromkeys(line.problem for line in night.lines)],
        nights=[_past(one) for one in reversed(nights)],
        usual=NIGHTS,
    )


def headline(night: Night) -> str:
    """The night in one sentence."""
    counts = night.counts
    total = len(night.lines) - counts[Verdict.NOT_POSSIBLE]
    text = f"{counts[Verdict.PASSED]} of {total} lines passed"
    wrong = [f"{counts[verdict]} {verdict}" for verdict in reversed(Verdict) if counts[verdict] and not verdict.fine]
    text += f"; {', '.join(wrong)}" if wrong else ""
    refused = counts[Verdict.NOT_POSSIBLE]
    return text + (f"; {refused} more give no answer, as expected." if refused else ".")


def _group(name: str, night: Night, nights: Sequence[Night]) -> dict[str, Any]:
    lines = [_line(line, nights) for line in night.lines if line.problem == name]
    known = PROBLEMS.get(name)
    return {
        "name": name,
        "about": known.about if known else _about(name),
        "reference": known.reference.source if known else _reference(name),
        "lines": lines,
        "without": [line for line in lines if line["result"].verdict is Verdict.NOT_POSSIBLE],
        "trends": [line for line in lines if line["charts"]],
    }


def _about(name: str) -> str:
    return "a scene of the library" if name.startswith(OWN) else "both initial angles from the motion of the tip"


def _reference(name: str) -> str:
    return "what the scene expects" if name.startswith(OWN) else "the angles of the data"


def _line(line: Result, nights: Sequence[Night]) -> dict[str, Any]:
    digits = apart(line.error, line.limit)
    return {
        "result": line,
        "error": _number(line.error, line.unit, digits),
        "limit": _number(line.limit, line.unit, digits),
        "usual_error": _number(line.usual_error, line.unit),
        "time": time_text(line.seconds) if line.verdict is not Verdict.NOT_POSSIBLE else "",
        "usual_time": time_text(line.usual_seconds) if line.verdict is not Verdict.NOT_POSSIBLE else "",
        "charts": _charts(line, nights),
    }


def _charts(line: Result, nights: Sequence[Night]) -> list[Markup]:
    """Error and time over the nights, once there are two."""
    present = [night for night in nights if track(line.key, [night])]
    past = track(line.key, present)
    if len(past) < 2 or line.verdict is Verdict.NOT_POSSIBLE:
        return []
    days = [night.started[:10] for night in present]
    errors = [one.error for one in past]
    times = [None if one.seconds is None else one.seconds * 1e3 for one in past]
    usual = None if line.usual_seconds is None else line.usual_seconds * 1e3
    charts = [
        trend("error", line.unit, errors, days, line.limit, "limit"),
        trend("time", "ms", times, days, usual, "usual"),
    ]
    # The numbers are ours and the words are escaped where they enter.
    return [Markup(chart) for chart in charts]


def _past(night: Night) -> dict[str, Any]:
    return {"night": night, "file": f"night-{night.started.replace(':', '')}.json"}


def _number(value: float | None, unit: str, digits: int = 1) -> str:
    return "" if value is None else f"{value:.{digits}e} {unit}"


def time_text(seconds: float | None) -> str:
    """A time in the unit that suits it."""
    return "" if seconds is None else f"{seconds * 1e3:.3g} ms" if seconds < 1 else f"{seconds:.3g} s"
