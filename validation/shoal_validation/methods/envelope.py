"""Slow part, amplitude and phase of a course, each a polynomial of the parameters at every instant.

RS-HT splits by the Hilbert transform (Huang et al., The empirical mode decomposition and the Hilbert spectrum for
nonlinear and non-stationary time series analysis, Proceedings of the Royal Society A 454, 1998); it errs at both ends
of the time, where the transform does. RS-LMD splits by local mean decomposition (Smith, The local mean decomposition
and its application to EEG perception data, Journal of the Royal Society Interface 2, 2005; Jiang and Bai, Interval
uncertainty quantification for the dynamics of multibody systems combing bivariate Chebyshev polynomials with local mean
decomposition, Mathematics 10, 2022); it smooths between turning points and is exact for none.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.signal import hilbert
from shoal.errors import InputError
from shoal.response.expansion import Expansion, fit
from shoal.response.inputs import IntArray
from shoal.response.methods.long_time import (
    UnsuitableError,
    missing,
    refuse_without_course,
    spline,
    turning_points,
    watch,
)
from shoal.response.polynomials import total_degree
from shoal.response.study import Found, Study
from shoal.trajectory import Array

DEGREE = 4
PARTS = 2
"""Products that a local mean decomposition ends with."""
Parts = Callable[[Array, Array], Array]
"""Times and a signal, (samples,), to (parts, 3, samples): slow part, amplitude and unwrapped phase."""


@dataclass(frozen=True)
class Parted:
    """Slow part + amplitude cos(phase), summed over parts; expansions have (parts, 3, columns) flat."""

    expansion: Expansion
    parts: int

    def __call__(self, xi: Array) -> Array:
        """Return all columns, (places, columns)."""
        return _joined(self.expansion(xi).reshape(len(xi), self.parts, 3, -1))

    def each(self, xi: Array, columns: IntArray) -> Array:
        """Return one column at each place, (places,)."""
        count = self.expansion.coefficients.shape[1] // (3 * self.parts)
        told = [self.expansion.each(xi, columns + count * k) for k in range(3 * self.parts)]
        return _joined(np.stack(told, axis=1).reshape(len(xi), self.parts, 3, 1))[:, 0]


def _joined(told: Array) -> Array:
    return np.asarray((told[:, :, 0] + told[:, :, 1] * np.cos(told[:, :, 2])).sum(axis=1))


def rs_ht(study: Study) -> Found:
    """Split courses by the Hilbert transform. Raises InputError."""
    return _by_parts(study, "rs-ht", hilbert_parts)


def rs_lmd(study: Study) -> Found:
    """Split courses by local mean decomposition. Raises InputError."""
    return _by_parts(study, "rs-lmd", local_mean_parts)


def _by_parts(study: Study, method: str, parts: Parts) -> Found:
    """Fit amplitude and phase of all runs. Raises InputError."""
    study.intervals_only(method)
    refuse_without_course(study, method)
    parameters, degree = len(study.inputs), study.degree or DEGREE
    try:
        seen = watch(study, 1.0)
        terms = total_degree(parameters, degree)
        seen.follow(missing(study, seen, terms))
    except UnsuitableError as error:
        raise InputError(f"method: {method}: {error}") from None
    told = np.stack([_at_instants(seen.times, course, study.when, parts) for course in seen.courses])
    made = len(told)
    found = fit(study.inputs, np.array(seen.xi), told.reshape(made, -1), terms)
    return Found(f"amplitude and phase as polynomials of degree {degree}, of {made} runs", Parted(found, told.shape[1]))


def _at_instants(times: Array, course: Array, when: Array, parts: Parts) -> Array:
    """Return the parts of a course at the instants, (parts, 3, columns)."""
    of = [parts(times, signal) for signal in course.T]
    at = [make_interp_spline(times, one, 3, axis=-1)(when) for one in of]
    return np.stack(at, axis=-1).reshape(*at[0].shape[:2], -1)


def hilbert_parts(times: Array, signal: Array) -> Array:
    """Mean, and the analytic signal of the rest."""
    mean = np.full(len(times), signal.mean())
    analytic = hilbert(signal - mean)
    return np.stack([mean, np.abs(analytic), np.unwrap(np.angle(analytic))])[None]


def local_mean_parts(times: Array, signal: Array) -> Array:
    """Products of an envelope and a frequency-modulated signal, and the remainder as the slow part of the last."""
    found, rest = [], signal - signal.mean()
    for _ in range(PARTS):
        envelope, modulated = np.ones(len(times)), rest.copy()
        for _ in range(8):
            turns = turning_points(times, spline(times, modulated))
            if len(turns) < 4:
                break
            knots = np.concatenate([[times[0]], turns, [times[-1]]])
            at = np.interp(knots, times, modulated)
            which = np.clip(np.searchsorted(knots, times, side="right") - 1, 0, len(knots) - 2)
            width = max(3, int(len(times) / len(turns)) | 1)
            mean = _smooth(0.5 * (at[which] + at[which + 1]), width)
            size_there = np.maximum(_smooth(0.5 * np.abs(at[which] - at[which + 1]), width), 1e-12)
            modulated = (modulated - mean) / size_there
            envelope = envelope * size_there
            if np.abs(size_there - 1).max() < 1e-3:
                break
        cosine = np.clip(modulated, -1, 1)
        rising = np.gradient(modulated, times) > 0
        phase = np.unwrap(np.where(rising, -np.arccos(cosine), np.arccos(cosine)))
        found.append(np.stack([np.zeros(len(times)), envelope, phase]))
        rest = rest - envelope * modulated
    found[-1][0] = rest + signal.mean()
    return np.stack(found)


def _smooth(values: Array, width: int) -> Array:
    padded = np.pad(values, width // 2, mode="reflect")
    return np.asarray(np.convolve(padded, np.full(width, 1 / width), mode="valid")[: len(values)])
