"""Bounds at long times: a surrogate of cycles, grown until it predicts runs that it has not seen.

At long times every instant has extremal points of its own. The surrogate names them; runs there attain the bounds, and
its error, known from runs that it has not seen, widens the outer ones.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from shoal.errors import InputError
from shoal.response.design import box_design
from shoal.response.enclosure import contradicts, control_misses
from shoal.response.extremes import Surrogate
from shoal.response.inputs import IntArray
from shoal.response.polynomials import Terms, size, total_degree
from shoal.response.runs import TooManyRunsError
from shoal.response.study import CLEARLY, FINE_GAP, PER_TERM, SAFETY, Found, Study, share_of
from shoal.trajectory import Array

SAMPLES = 2**15
"""Of the first run, while nothing is known of its cycles."""
PER_TURN = 24, 48
"""Samples between two turning points: as few and as many as are kept."""
SPLINE_DEGREE = 7
"""Of the splines between samples."""
CYCLES = 3
"""Turning points that are too few for cycles; six have to be seen."""
EARLY = 0.25
"""Turning points before this share of the usual distance of two are not counted: a run from rest begins with one."""


class UnsuitableError(Exception):
    """The motion is not what a method is made for, and why."""


@dataclass(frozen=True)
class Watch:
    """Runs that are followed closely over time.

    times: evenly from 0 to beyond the last instant [s], (samples,); first: the run in the middle, (samples, signals);
    signal: the one with the most even cycles; uneven: how much a cycle differs from the next, as a share; turns: its
    turning points; xi: of all runs that were watched, (runs, parameters); courses: of these runs
    """

    study: Study
    times: Array
    first: Array
    signal: int
    uneven: float
    turns: int
    xi: list[Array]
    courses: list[Array]

    def follow(self, xi: Array) -> None:
        """Watch runs at more places. Raises as `watched` does."""
        if not len(xi):
            return
        for one, course in zip(xi, watched(self.study, xi, self.times), strict=True):
            self.xi.append(one)
            self.courses.append(course)

    def spread(self) -> float:
        """Return by how much the phase at the last instant may differ from the middle one's [rad], by the runs of a
        star.
        """
        end, parameters = self.study.when[-1], len(self.study.inputs)
        self.follow(np.vstack([np.eye(parameters), -np.eye(parameters)]))
        phases = []
        for course in self.courses[1:]:
            turns = turning_points(self.times, spline(self.times, course[:, self.signal]))
            if not len(turns):
                raise UnsuitableError("some runs have no cycles")
            phases.append(float(np.pi * np.interp(end, turns, np.arange(len(turns)))))
        return float(np.abs(np.array(phases[:parameters]) - phases[parameters:]).sum() / 2)


def watched(study: Study, xi: Array, times: Array) -> Array:
    """Make these runs, keep what they say at the study's instants, give what they say at `times`.

    (runs, samples, signals). Raises InputError, TooManyRunsError, ComputationError, UnsuitableError.
    """
    if study.over_time is None:
        raise UnsuitableError("nothing is known of this model between its instants")
    instants = study.when
    every = np.union1d(times, instants)
    answers = study.over_time(every)(study.inputs.values(xi))
    whole = answers.values.reshape(len(xi), len(every), -1)
    asked = np.searchsorted(every, instants)
    columns = whole[:, asked].reshape(len(xi), -1)
    words = None if answers.words is None else answers.words[:, asked]
    study.runs.keep(xi, replace(answers, values=columns, words=words))
    if not answers.good.all():
        raise UnsuitableError(f"{len(xi) - int(answers.good.sum())} of the longer runs failed: {answers.why}")
    return np.asarray(whole[:, np.searchsorted(every, times)])


def watch(study: Study, stretch: float) -> Watch:
    """Run the middle of the box `stretch` times as long as asked for, and find the signal with the most even cycles."""
    times = np.linspace(0.0, stretch * study.when[-1], SAMPLES + 1)
    first = watched(study, np.zeros((1, len(study.inputs))), times)[0]
    signal, uneven, turns = _most_even(times, first)
    least, most = PER_TURN
    apart = len(times) / turns
    if apart < least:
        times = np.linspace(0.0, times[-1], least * turns + 1)
        first = watched(study, np.zeros((1, len(study.inputs))), times)[0]
        signal, uneven, turns = _most_even(times, first)
        if len(times) / turns < 0.5 * least:
            raise UnsuitableError("there are ever more cycles the closer one looks")
    elif apart > 2 * most:
        times, first = times[:: int(apart / most)], first[:: int(apart / most)]
    return Watch(study, times, first, signal, uneven, turns, [np.zeros(len(study.inputs))], [first])


def _most_even(times: Array, course: Array) -> tuple[int, float, int]:
    """Signal, how uneven its cycles are, and its turning points."""
    found: list[tuple[float, int, int]] = []
    steps = np.diff(course, axis=0)
    # Signals that hardly ever turn between their samples need no splines.
    seen = (steps[:-1] * steps[1:] < 0).sum(axis=0)
    turning = np.flatnonzero(seen > CYCLES)
    if not len(turning):
        raise UnsuitableError("the motion has too few cycles")
    # As many samples as are kept of the one that turns most often resolve the cycles of all.
    apart = max(1, len(times) // (PER_TURN[1] * int(seen.max())))
    times = times[::apart]
    every = spline(times, course[::apart, turning])
    for k, signal in enumerate(turning.tolist()):
        turns = turning_points(times, BSpline(every.t, every.c[:, k], every.k))
        if len(turns) >= 6:
            cycle = np.diff(turns[::2])
            found.append((float(np.median(np.abs(np.diff(cycle))) / cycle.mean()), signal, len(turns)))
    if not found:
        raise UnsuitableError("the motion has too few cycles")
    uneven, signal, turns_there = min(found)
    return signal, uneven, turns_there


def spline(times: Array, values: Array) -> BSpline:
    """Interpolate all samples, (samples,) or (samples, signals)."""
    return make_interp_spline(times, values, SPLINE_DEGREE)


def turning_points(times: Array, signal: BSpline) -> Array:
    """Return the turning points of a signal [s], without the one that a run from rest begins with."""
    speed, change = signal.derivative(), signal.derivative(2)
    v = speed(times)
    size = np.abs(v).max()
    turns = np.flatnonzero((v[:-1] * v[1:] < 0) & (np.maximum(np.abs(v[:-1]), np.abs(v[1:])) > 1e-9 * size))
    low, high = times[turns], times[turns + 1]
    at = low + (high - low) * v[turns] / (v[turns] - v[turns + 1])
    for _ in range(3):
        slope = change(at)
        step = np.divide(speed(at), slope, out=np.zeros_like(at), where=slope != 0)
        at = np.clip(at - step, low, high)
    if len(at) > 1:
        at = at[at > EARLY * np.median(np.diff(at))]
    return np.asarray(at)


def refuse_without_course(study: Study, method: str) -> None:
    """Check that a model is known between its instants. Raises InputError."""
    if study.over_time is None:
        raise InputError(f"method: {method} follows runs over time; this model is known at its instants only")


STRETCHES = 1.05, 1.2, 1.6
"""Runs are so many times as long as asked for: the slowest has to reach the phase of the fastest."""
HIGHEST = 12
"""Degree up to which surrogates are grown."""
OFF = 2e-2
"""Share of the width above which a surrogate is no good."""


class TooSlowError(Exception):
    """The slowest run does not reach the phase of the fastest in time."""


class LongTime(Protocol):
    """Representation of a run by cycles instead of values at single instants."""

    name: str

    def of(self, course: Array) -> Any:
        """Represent one run; course: (samples, signals). Raises UnsuitableError."""
        ...

    def surrogate(self, study: Study, xi: Array, runs: list[Any], terms: Terms) -> Surrogate:
        """Fit a surrogate to these runs as represented by `of`. Raises UnsuitableError, TooSlowError."""
        ...


def grown(study: Study, kind: Callable[[Watch], LongTime], seen: Watch | None = None) -> Found:
    """Grow a surrogate of cycles. Raises InputError, UnsuitableError."""
    for stretch in STRETCHES:
        try:
            return _grown(study, kind, seen or watch(study, stretch))
        except TooSlowError:
            seen = None
    raise UnsuitableError(f"some runs are slower than others by more than {STRETCHES[-1]:g}")


def _grown(study: Study, make: Callable[[Watch], LongTime], seen: Watch) -> Found:
    parameters, wanted = len(study.inputs), study.gap or FINE_GAP
    kind = make(seen)
    reduced: list[Any] = []
    degree = study.degree or 2
    found: Found | None = None
    worse = 0
    try:
        while degree <= HIGHEST:
            terms = total_degree(parameters, degree)
            seen.follow(missing(study, seen, terms))
            reduced += [kind.of(course) for course in seen.courses[len(reduced) :]]
            xi = np.array(seen.xi)
            surrogate = kind.surrogate(study, xi, reduced, terms)
            made = len(study.runs.xi)
            # Where a polynomial of higher degree would have to look: there this one is put to the test.
            beyond = total_degree(parameters, degree + 2)
            seen.follow(box_design(study.inputs, xi, beyond, parameters + 1, study.seed + degree))
            missed = np.abs(surrogate(study.runs.xi[made:]) - study.runs.values[made:]).max(axis=0)
            error = study.largest(missed, study.runs.values)
            share = _share(study, error)
            why = f"{kind.name} of degree {degree}, fitted to {made} of {study.runs.evaluations} runs"
            worse = 0 if found is None or share < CLEARLY * found.share else worse + 1
            if found is None or share < found.share:
                found = Found(why, surrogate, error, of_cycles=True, share=share)
            dear = study.gap is None and study.runs.own > 2 * study.fair
            if share <= wanted or study.degree or worse == 2 or dear:
                break
            degree += 1
            while _carried(parameters, degree + 1, len(seen.xi)):
                degree += 1
        if found is not None:
            found = _controlled(study, found)
    except TooManyRunsError:
        pass
    if found is None or found.share > max(wanted, OFF):
        off = "too few runs" if found is None else f"its error is {found.share:.1g} of the width"
        raise UnsuitableError(f"{kind.name} does not predict new runs: {off}")
    return found


def _controlled(study: Study, found: Found) -> Found:
    """Enlarge the error by what control runs show. Raises TooManyRunsError."""
    assert found.surrogate is not None
    assert found.error is not None
    missed = control_misses(study, found.surrogate)
    if not contradicts(study, missed, found.error).any():
        return found
    error = np.maximum(found.error, study.largest(missed, study.runs.values))
    return replace(found, error=error, share=_share(study, error))


def _share(study: Study, error: Array) -> float:
    """Return the largest gap that an error leaves between attained and outer bounds, as a share of the width."""
    width = study.widths(study.runs.values)
    return float(share_of(SAFETY * error, width).max())


def _carried(parameters: int, degree: int, runs: int) -> bool:
    """Return whether a number of runs carries a degree."""
    return runs >= (1 if parameters == 1 else PER_TERM) * size(parameters, degree)


def missing(study: Study, seen: Watch, terms: Terms) -> Array:
    """Return further places for these terms."""
    parameters, xi = len(study.inputs), np.array(seen.xi)
    least = len(terms) if parameters == 1 else math.ceil(PER_TERM * len(terms))
    return box_design(study.inputs, xi, terms, least - len(xi), study.seed)


def at_every_instant(places: int, instants: int, at: Callable[[IntArray], Array]) -> Array:
    """Return the values of `at` at every place and instant, (places, columns)."""
    return np.stack([at(np.full(places, k)) for k in range(instants)], axis=1).reshape(places, -1)


def stated(study: Study, kind: Callable[[Watch], LongTime], method: str) -> Found:
    """A method that was asked for by name. Raises InputError where it does not suit."""
    study.intervals_only(method)
    refuse_without_course(study, method)
    try:
        return grown(study, kind)
    except UnsuitableError as error:
        raise InputError(f"method: {method}: {error}; take another method, such as auto") from None
