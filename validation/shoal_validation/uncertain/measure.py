"""One method on one problem."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from shoal.errors import InputError
from shoal.response import respond
from shoal.trajectory import Array

from shoal_validation.uncertain.problems import Problem

MOST = 4000
"""Runs that a method may make."""
ROUNDING = 1e-5
"""Of the width: what the reference itself may miss."""


@dataclass(frozen=True)
class Line:
    """Result of a method.

    runs: made; short: how far attained bounds stay inside the true ones, as a share of the width; verdict: `holds` (the
    outer bounds enclose, up to the gap told), `silent` (they do not, and nothing tells), `horizon` (some instants are
    refused), `unknown` (no outer bounds are told) or `refused`
    """

    problem: str
    method: str
    runs: int
    short: float
    verdict: str


def measured(
    problem: Problem, method: str, low: Array, high: Array, *, degree: int | None = None, count: int | None = None
) -> Line:
    """low, high: the reference, (instants,); degree, count: options of the method."""
    times, instants = np.array(problem.times), len(problem.times)
    one = np.zeros(instants)
    over_time = problem.at if problem.continuous else None
    try:
        answer = respond(
            problem.at(times),
            problem.inputs,
            instants,
            method=method,
            degree=degree,
            count=count,
            groups=one,
            instants=times,
            most=MOST,
            over_time=over_time,
        )
    except InputError:
        return Line(problem.name, method, 0, math.nan, "refused")
    found = answer.bounds
    assert found is not None
    width = float((high - low).max())
    within = times <= found.horizon
    short = float(np.maximum(found.lower - low, high - found.upper).max()) / width
    if math.isnan(found.gap):
        verdict = "unknown" if within.all() else "horizon"
    else:
        beyond = np.maximum(found.lower_outer - low, high - found.upper_outer)[within].max(initial=0.0) / width
        held = beyond <= found.gap + ROUNDING
        verdict = ("holds" if within.all() else "horizon") if held else "silent"
    return Line(problem.name, method, answer.runs.own, short, verdict)
