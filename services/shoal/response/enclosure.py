"""How far beyond the runs the answers can lie: what a surrogate foretells, widened by how wrong it may be.

The error of a surrogate is known at runs; far from them it is as large as it was at runs that it had not seen. So it is
taken to grow with the distance from the nearest run, as fast as an error of the surrogate's degree can: a polynomial of
degree n that is at most e on [-1, 1] has a slope of at most n^2 e (Markov's inequality). Where a bound is attained at a
corner, and the answer falls off from there faster than that, the attained bound is the bound.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shoal.response.expansion import Expansion
from shoal.response.extremes import Extremes, Surrogate, places
from shoal.response.study import SAFETY, Study
from shoal.trajectory import Array

DEGREE = 6
"""Of surrogates that are no polynomials."""


@dataclass(frozen=True)
class Enclosure:
    """Attained and outer bounds, (columns,); gap: their distance as a share of the width of the group, (columns,)."""

    lower: Array
    upper: Array
    lower_outer: Array
    upper_outer: Array
    gap: Array


def enclosure(study: Study, surrogate: Surrogate, found: Extremes, error: Array) -> Enclosure:
    """error: of the surrogate at runs that it had not seen, (columns,); found: its extremes."""
    values, germs = study.runs.values, study.runs.germs
    lower, upper = values.min(axis=0), values.max(axis=0)
    low, high = np.array(found.lower), np.array(found.upper)
    scanned = places(germs.shape[1], study.seed)
    degree = int(surrogate.terms.sum(axis=1).max()) if isinstance(surrogate, Expansion) else DEGREE
    slope = (degree + 1.0) ** 2
    away = _away(scanned, germs, slope)
    block = max(1, 4_000_000 // values.shape[1])
    for k in range(0, len(scanned), block):
        foretold = surrogate(scanned[k : k + block])
        margin = SAFETY * error * away[k : k + block, None]
        low = np.minimum(low, (foretold - margin).min(axis=0))
        high = np.maximum(high, (foretold + margin).max(axis=0))
    low = np.minimum(low, found.lower - SAFETY * error * _away(found.at_lower, germs, slope))
    high = np.maximum(high, found.upper + SAFETY * error * _away(found.at_upper, germs, slope))
    every = np.arange(values.shape[1])
    misfit = [
        np.abs(surrogate.each(germs[at], every) - attained)
        for at, attained in ((values.argmin(axis=0), lower), (values.argmax(axis=0), upper))
    ]
    low, high = np.minimum(lower, low - misfit[0]), np.maximum(upper, high + misfit[1])
    width = study.widths(values)
    beyond = np.maximum(lower - low, high - upper)
    gap = np.divide(beyond, width, out=np.zeros_like(beyond), where=width > 0)
    return Enclosure(lower, upper, low, high, gap)


def foretold(study: Study, _: Surrogate, found: Extremes, error: Array) -> Enclosure:
    """Bounds on both sides of what a surrogate foretells: what the runs at its extremes attain at least, and at most.

    error: of the surrogate at runs that it had not seen, (columns,). Inner bounds take the place of attained ones.
    """
    values, margin = study.runs.values, SAFETY * error
    lower = np.minimum(values.min(axis=0), found.lower + margin)
    upper = np.maximum(values.max(axis=0), found.upper - margin)
    low, high = np.minimum(lower, found.lower - margin), np.maximum(upper, found.upper + margin)
    width = study.largest(np.maximum(upper - lower, 0.0), values)
    beyond = np.maximum(lower - low, high - upper)
    return Enclosure(lower, upper, low, high, np.divide(beyond, width, out=np.zeros_like(beyond), where=width > 0))


def _away(wanted: Array, germs: Array, slope: float) -> Array:
    """Share of the full error at each place: the distance to the nearest run times a slope, at most one."""
    nearest = np.full(len(wanted), np.inf)
    for germ in germs:
        nearest = np.minimum(nearest, np.abs(wanted - germ).max(axis=1))
    return np.minimum(slope * nearest, 1.0)
