"""Bounds at long times: a surrogate of cycles, grown until it foretells runs that it has not seen.

At long times every instant has extremal points of its own. The surrogate names them; runs there attain the bounds, and
its error, which runs tell that it has not seen, widens the outer ones.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from shoal.errors import InputError
from shoal.response import control
from shoal.response.course import UnsuitableError, Watch, refuse_without_course, watch
from shoal.response.design import box_design
from shoal.response.extremes import Surrogate
from shoal.response.inputs import IntArray
from shoal.response.polynomials import Terms, size, total_degree
from shoal.response.runs import TooManyRunsError
from shoal.response.study import FINE_GAP, SAFETY, Found, Study
from shoal.trajectory import Array

SHARE = 1.25
"""Runs for every term, at least; with one parameter as many as terms will do."""
STRETCHES = 1.05, 1.2, 1.6
"""Runs are so many times as long as asked for: the slowest has to reach the phase of the fastest."""
HIGHEST = 12
OFF = 2e-2
"""Share of the width above which a surrogate is no good."""
HELPS = 0.5
"""A degree that leaves more than this share of the error does not help; two in a row are enough."""


class TooSlowError(Exception):
    """The slowest run does not reach the phase of the fastest in time."""


class LongTime(Protocol):
    """What is told of a run instead of its places at single instants."""

    name: str

    def of(self, course: Array) -> Any:
        """Of one run; course: (samples, signals). Raises UnsuitableError."""
        ...

    def surrogate(self, study: Study, germs: Array, runs: list[Any], terms: Terms) -> Surrogate:
        """Fitted to these runs, which `of` has told. Raises UnsuitableError, TooSlowError."""
        ...


def grown(study: Study, kind: Callable[[Watch], LongTime], seen: Watch | None = None) -> Found:
    """Raises InputError, UnsuitableError."""
    for stretch in STRETCHES:
        try:
            return _grown(study, kind, seen or watch(study, stretch))
        except TooSlowError:
            seen = None
    raise UnsuitableError(f"some runs are slower than others by more than {STRETCHES[-1]:g}")


def _grown(study: Study, make: Callable[[Watch], LongTime], seen: Watch) -> Found:
    parameters, wanted = len(study.inputs), study.gap or FINE_GAP
    kind = make(seen)
    told: list[Any] = []
    degree = study.degree or 2
    found: Found | None = None
    worse = 0
    try:
        while degree <= HIGHEST:
            terms = total_degree(parameters, degree)
            seen.follow(missing(study, seen, terms))
            told += [kind.of(course) for course in seen.courses[len(told) :]]
            germs = np.array(seen.germs)
            surrogate = kind.surrogate(study, germs, told, terms)
            made = len(study.runs.germs)
            # Where a polynomial of higher degree would have to look: there this one is put to the test.
            beyond = total_degree(parameters, degree + 2)
            seen.follow(box_design(study.inputs, germs, beyond, parameters + 1, study.seed + degree))
            missed = np.abs(surrogate(study.runs.germs[made:]) - study.runs.values[made:]).max(axis=0)
            error = study.largest(missed, study.runs.values)
            share = _share(study, error)
            why = f"{kind.name} of degree {degree}, fitted to {made} of {study.runs.evaluations} runs"
            worse = 0 if found is None or share < HELPS * found.share else worse + 1
            if found is None or share < found.share:
                found = Found(why, surrogate, error, foretold=True, share=share)
            dear = study.gap is None and study.runs.own > 2 * study.fair
            if share <= wanted or study.degree or worse == 2 or dear:
                break
            degree += 1
            while _carried(parameters, degree + 1, len(seen.germs)):
                degree += 1
        if found is not None:
            found = _controlled(study, found)
    except TooManyRunsError:
        pass
    if found is None or found.share > max(wanted, OFF):
        off = "too few runs" if found is None else f"its error is {found.share:.1g} of the width"
        raise UnsuitableError(f"{kind.name} does not foretell new runs: {off}")
    return found


def _controlled(study: Study, found: Found) -> Found:
    """With what runs all over the box say of its error. Raises TooManyRunsError."""
    assert found.surrogate is not None
    assert found.error is not None
    missed = control.missed(study, found.surrogate)
    if not control.contradict(study, missed, found.error).any():
        return found
    error = np.maximum(found.error, study.largest(missed, study.runs.values))
    return replace(found, error=error, share=_share(study, error))


def _share(study: Study, error: Array) -> float:
    """What an error leaves between attained and outer bounds, as a share of the width: the largest."""
    width = study.widths(study.runs.values)
    return float(np.divide(SAFETY * error, width, out=np.zeros_like(width), where=width > 0).max())


def _carried(parameters: int, degree: int, runs: int) -> bool:
    """Return whether so many runs carry that degree."""
    return runs >= (1 if parameters == 1 else SHARE) * size(parameters, degree)


def missing(study: Study, seen: Watch, terms: Terms) -> Array:
    """Where to run for these terms, beside what was run."""
    parameters, germs = len(study.inputs), np.array(seen.germs)
    least = len(terms) if parameters == 1 else math.ceil(SHARE * len(terms))
    return box_design(study.inputs, germs, terms, least - len(germs), study.seed)


def at_every_instant(places: int, instants: int, at: Callable[[IntArray], Array]) -> Array:
    """What `at` tells of every place at every instant, (places, columns)."""
    return np.stack([at(np.full(places, k)) for k in range(instants)], axis=1).reshape(places, -1)


def stated(study: Study, kind: Callable[[Watch], LongTime], method: str) -> Found:
    """A method that was asked for by name. Raises InputError where it does not suit."""
    study.intervals_only(method)
    refuse_without_course(study, method)
    try:
        return grown(study, kind)
    except UnsuitableError as error:
        raise InputError(f"method: {method}: {error}; take another method, such as auto") from None
