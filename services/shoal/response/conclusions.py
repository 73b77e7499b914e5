"""Findings about a response, from which its status follows."""

from __future__ import annotations

import math
from dataclasses import replace

from shoal.findings import Finding
from shoal.response import findings as kinds
from shoal.response.enclosure import WILKS
from shoal.response.findings import in_order
from shoal.response.probability_boxes import BEYOND_HOPE
from shoal.response.problem import UncertainProblem
from shoal.response.respond import ModelResponse
from shoal.response.result import Response
from shoal.response.runs import CachedModel
from shoal.response.verify import ModelErrors

NAMED = 3
"""Of the columns that miss a gap, named in the message."""
REFUSED = kinds.RUNS_FAILED, kinds.MODEL_REJECTED, kinds.BEYOND_HORIZON
"""Runs show only that a limit is exceeded: with these findings nothing shows that it is kept."""


def findings_about(
    response: Response, problem: UncertainProblem, found: ModelResponse, known: ModelErrors
) -> list[Finding]:
    """Return the findings about a response, the decisive first."""
    return in_order(
        [
            *_time(response, problem),
            *_failed(found.runs),
            *known.findings,
            *_horizon(response, found),
            *_gap(response, problem.asked.gap),
            *_deviation(response),
            *(one for limit in response.limits for one in limit.titled),
            *(response.allocation.findings if response.allocation is not None else ()),
            *_outer(response),
            *_starts(response),
            *_words(response),
        ]
    )


def withheld(response: Response) -> Response:
    """Return a response that does not say that limits are kept where its findings refuse it."""
    if not any(one.kind in REFUSED for one in response.findings):
        return response
    return replace(response, limits=tuple(replace(one, kept=None) if one.kept else one for one in response.limits))


def _time(response: Response, problem: UncertainProblem) -> list[Finding]:
    if not problem.keep.over:
        return []
    missing = [one.text for one in problem.limits[len(response.limits) :]]
    text = f"the {problem.asked.time_limit:g} s were over"
    text += f"; nothing is known of {', '.join(missing)}" if missing else ""
    text += "; the same again goes on from here" if problem.asked.checkpoint else ""
    return [kinds.TIME_OVER.found(text, time_limit=problem.asked.time_limit or 0.0)]


def _failed(runs: CachedModel) -> list[Finding]:
    if not runs.failed:
        return []
    text = f"{runs.failed} of {runs.evaluations} runs failed even with smaller steps: {runs.why}"
    numbers = {"failed": runs.failed, "runs": runs.evaluations}
    return [kinds.RUNS_FAILED.found(f"{text}; they have {runs.describe_failed()}", **numbers)]


def _horizon(response: Response, found: ModelResponse) -> list[Finding]:
    horizon, boxes = found.horizon, found.boxes
    if math.isinf(horizon):
        return []
    if boxes is None:
        cause = "small changes of the parameters change everything"
        if response.words is not None:
            cause = "the sequences of events are too many, or their parts of the parameters too small"
        text = (
            f"bounds hold until {horizon:g} s; beyond, {cause}, and what is reported is what runs attained, how far "
            "the machine reaches, and, if every value is as likely as another, "
            f"where with 95 % confidence 95 % of all runs lie ({WILKS} random runs)"
        )
    elif boxes.places:
        text = (
            f"statistics are known until {horizon:g} s; beyond, no polynomial follows them, and what is reported are "
            f"their extremes over {boxes.places} interval values with {boxes.inner} runs each"
        )
    else:
        text = f"statistics are known until {horizon:g} s; beyond, what is reported is not to be believed"
    return [kinds.BEYOND_HORIZON.found(text, horizon=horizon)]


def _gap(response: Response, asked: float | None) -> list[Finding]:
    bounded = response.bounds or response.boxes
    if bounded is None or asked is None or bounded.gap <= asked:
        return []
    gap = "is not known" if math.isnan(bounded.gap) else f"is {bounded.gap:.1e} of the width"
    text = f"the gap between outer and attained bounds {gap}, asked for {asked:g}"
    missed = {} if response.bounds is None else response.missed(asked)
    if missed:
        worst = ", ".join(f"{name} {one:.1e}" for name, one in list(missed.items())[:NAMED])
        text += f": {worst}" + (f" and {len(missed) - NAMED} more" if len(missed) > NAMED else "")
    return [kinds.GAP_NOT_REACHED.found(text, gap=bounded.gap, asked=asked)]


def _deviation(response: Response) -> list[Finding]:
    if response.boxes is None or not response.boxes.std_gap > BEYOND_HOPE:
        return []
    gap = response.boxes.std_gap
    text = f"standard deviations are known to {gap:.1e} of their size only, within the outer values"
    return [kinds.DEVIATION_IN_DOUBT.found(text, gap=gap)]


def _outer(response: Response) -> list[Finding]:
    if response.bounds is None or not math.isnan(response.bounds.gap):
        return []
    return [
        kinds.OUTER_UNKNOWN.found("bounds are what runs attained; this method does not estimate how far others lie")
    ]


def _words(response: Response) -> list[Finding]:
    words = response.words
    if words is None:
        return []
    text = (
        f"runs have {len(words.words)} sequences of events until {response.times[-1]:g} s: {words.text}; others with "
        f"less than {100 * words.rare:.2g} % may be unseen"
    )
    return [kinds.DIFFERENT_EVENTS.found(text, sequences=float(len(words.words)), rare=words.rare)]


def _starts(response: Response) -> list[Finding]:
    if not response.elsewhere:
        return []
    elsewhere = response.elsewhere
    return [kinds.STARTS_ELSEWHERE.found(elsewhere.describe(), elsewhere=elsewhere.elsewhere, runs=elsewhere.runs)]
