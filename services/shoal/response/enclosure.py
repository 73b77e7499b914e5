"""How far beyond the runs the answers can lie: what a surrogate foretells, widened by how wrong it may be.

The error of a surrogate is known at runs; far from them it is as large as it was at runs that it had not seen. So it is
taken to grow with the distance from the nearest run, as fast as an error of the surrogate's degree can: a polynomial of
total degree n that is at most e on the box changes by at most n e for every radian between the places arccos(u) of two
germs (Bernstein's inequality). Where a bound is attained by a run, and the answer falls off from there faster than
that, the attained bound is the bound.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from scipy.spatial import cKDTree

from shoal.response.expansion import Expansion
from shoal.response.extremes import Extremes, Surrogate, extremes, in_parts, places
from shoal.response.inputs import IntArray
from shoal.response.study import SAFETY, Enclosure, Looked, Study
from shoal.trajectory import Array

Look = Literal["there", "scanned", "everywhere"]
ARMS = 1.0, 0.3, 0.1
"""Of the search for widened extremes, in lengths over which the margin grows to its full size."""
ROUGH = 50
"""Change of the error of a surrogate that is no polynomial, in margins for every radian."""


def enclosure(
    study: Study, surrogate: Surrogate, found: Extremes, error: Array, *, look: Look = "everywhere"
) -> Enclosure:
    """error: of the surrogate at runs that it had not seen, (columns,); found: its extremes; look: where the margin is
    looked at: there only, where the surrogate is scanned as well, or in between too: each may reach farther
    """
    values = study.runs.values
    lower, upper = values.min(axis=0), values.max(axis=0)
    slope = 1 + int(surrogate.terms.sum(axis=1).max()) if isinstance(surrogate, Expansion) else ROUGH
    low, high = _widened(study, surrogate, found, SAFETY * error, slope, look)
    low, high = np.minimum(lower, low), np.maximum(upper, high)
    width = study.widths(values)
    beyond = np.maximum(lower - low, high - upper)
    gap = np.divide(beyond, width, out=np.zeros_like(beyond), where=width > 0)
    return Enclosure(lower, upper, low, high, gap)


def looked_at(study: Study, surrogate: Surrogate, error: Array) -> Looked:
    """Bounds by all runs there are; error: see `enclosure`."""
    named = extremes(surrogate, len(study.inputs), len(error), study.seed, known=study.runs.attaining)
    return Looked(study.runs.evaluations, enclosure(study, surrogate, named, error))


def foretold(study: Study, _: Surrogate, found: Extremes, error: Array) -> Enclosure:
    """Bounds that runs attain, and outer ones by what a surrogate foretells at its extremes.

    error: of the surrogate at runs that it had not seen, (columns,)
    """
    values, margin = study.runs.values, SAFETY * (error + found.doubt)
    lower, upper = values.min(axis=0), values.max(axis=0)
    low, high = np.minimum(lower, found.lower - margin), np.maximum(upper, found.upper + margin)
    width = study.widths(values)
    beyond = np.maximum(lower - low, high - upper)
    return Enclosure(lower, upper, low, high, np.divide(beyond, width, out=np.zeros_like(beyond), where=width > 0))


def _widened(
    study: Study, surrogate: Surrogate, found: Extremes, margin: Array, slope: int, look: Look
) -> tuple[Array, Array]:
    """Where the surrogate is least and largest if it is off by its margin at the most, (columns,) each.

    The margin grows away from runs, so that an extreme may move off the surrogate's own: sought along the axes.
    """
    germs, columns = study.runs.germs, len(margin)
    every, runs = np.arange(columns), cKDTree(np.arccos(germs))
    misfit = np.abs(surrogate(germs) - study.runs.values)
    which, signs = np.tile(every, 2), np.repeat([1.0, -1.0], columns)

    def away(at: Array) -> tuple[Array, IntArray]:
        """Share of the margin at each place, and the nearest run."""
        distance, nearest = runs.query(np.arccos(at), p=np.inf)
        return np.minimum(slope * distance, 1.0), np.asarray(nearest, dtype=np.int64)

    def objective(at: Array) -> Array:
        """Of the lower side of all columns, then of the upper one."""
        share, run = away(at)
        return signs * surrogate.each(at, which) - margin[which] * share - misfit[run, which]

    own = np.concatenate([found.at_lower, found.at_upper])
    best, place = objective(own), own.copy()
    if look == "there":
        return best[:columns], -best[columns:]
    rough = look == "scanned"
    scanned = places(germs.shape[1], study.seed, rough=rough)
    share, run = away(scanned)
    for some, told in in_parts(surrogate, scanned, columns):
        wide = share[some, None] * margin
        wide += misfit[run[some]]
        for side, of in enumerate((told - wide, told + wide)):
            every_place = np.ascontiguousarray(of.T)
            extreme = every_place.argmax(axis=1) if side else every_place.argmin(axis=1)
            value = (-1 if side else 1) * every_place[every, extreme]
            mine = slice(side * columns, (side + 1) * columns)
            better = value < best[mine]
            best[mine][better], place[mine][better] = value[better], scanned[some][extreme][better]
    starts = [place] if rough else [place, own]
    for at in starts:
        value = best.copy() if at is place else objective(at)
        for step in () if rough else (arm / slope for arm in ARMS):
            for axis in range(germs.shape[1]):
                for way in (-step, step):
                    beside = at.copy()
                    beside[:, axis] = np.cos(np.clip(np.arccos(beside[:, axis]) + way, 0, np.pi))
                    now = objective(beside)
                    better = now < value
                    value[better], at[better] = now[better], beside[better]
        best = np.minimum(best, value)
    return best[:columns], -best[columns:]
