"""One method on one problem, and random studies by `auto`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from shoal.errors import InputError
from shoal.response import respond
from shoal.response.inputs import Inputs, Parameter
from shoal.response.marginals import Interval
from shoal.response.runs import Answers
from shoal.trajectory import Array

from shoal_validation.uncertain.problems import Problem

MOST = 4000
"""Runs that a method may make."""
ROUNDING = 1e-5
"""Of the width: what the reference itself may miss."""
RUNS = 100_000
"""Random runs that look for a place outside."""


@dataclass(frozen=True)
class Line:
    """What a method found.

    runs: made; short: how far attained bounds stay inside the true ones, as a share of the width; verdict: `holds` (the
    outer bounds enclose, up to the gap told), `silent` (they do not, and nothing tells), `horizon` (some instants are
    refused), `unknown` (no outer bounds are told) or `refused`
    """

    problem: str
    method: str
    runs: int
    short: float
    verdict: str


def measured(problem: Problem, method: str, low: Array, high: Array) -> Line:
    """low, high: the reference, (instants,)."""
    times, count = np.array(problem.times), len(problem.times)
    one = np.zeros(count)
    over_time = problem.at if problem.continuous else None
    try:
        answer = respond(
            problem.at(times),
            problem.inputs,
            count,
            method=method,
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
    return Line(problem.name, method, answer.runs.evaluations, short, verdict)


@dataclass(frozen=True)
class Study:
    """A random study: parameters, runs, gap told, and how far a random run lies beyond the outer bounds, as shares."""

    parameters: int
    runs: int
    gap: float
    beyond: float

    @property
    def kept(self) -> bool:
        """Whether no run lies further out than the gap told."""
        return math.isnan(self.gap) or self.beyond <= self.gap


def random_study(seed: int) -> Study:
    """Two waves in one to four parameters at three instants, by `auto`, against 100 000 random runs and all corners."""
    random = np.random.default_rng(seed)
    count = int(random.integers(1, 5))
    slope, waves = random.normal(size=(count, 3)), random.normal(size=(2, count, 3))
    shift, strength = random.uniform(0, 2 * np.pi, (2, 3)), random.uniform(0, 2, (2, 3))

    def motion(u: Array) -> Array:
        return np.asarray(u @ slope + sum(strength[k] * np.sin(u @ waves[k] + shift[k]) for k in range(2)))

    def model(values: Mapping[str, Array]) -> Answers:
        found = motion(np.stack([values[f"u{k}"] for k in range(count)], axis=1))
        return Answers(found, np.ones(len(found), dtype=bool))

    inputs = Inputs(tuple(Parameter(f"u{k}", Interval(-1.0, 1.0), {f"u{k}": 1.0}) for k in range(count)))
    answer = respond(model, inputs, 3, seed=seed)
    found = answer.bounds
    assert found is not None
    drawn = random.uniform(-1, 1, (RUNS, count))
    drawn[:1000] = np.sign(drawn[:1000])
    seen = motion(drawn)
    width = found.upper - found.lower
    beyond = np.maximum(found.lower_outer - seen.min(axis=0), seen.max(axis=0) - found.upper_outer) / width
    return Study(count, answer.runs.evaluations, found.gap, float(max(beyond.max(), 0.0)))
