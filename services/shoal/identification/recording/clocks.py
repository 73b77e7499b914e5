"""Instants of a motion that the samples of a recording show, by the clock and the delay of each lane."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from shoal.trajectory import Array

_HARDLY = 0.1
"""Of their length: runs that differ by less are simulated at once, at the instants of all."""
_PACES = 16
"""So many of them, at most."""


class LaneGroup(NamedTuple):
    """Lanes that are simulated at once.

    lanes: their numbers; instants: of the simulation [s]; rows: the instant that each sample shows, (lanes, samples)
    """

    lanes: npt.NDArray[np.intp]
    instants: Array
    rows: npt.NDArray[np.intp]


def by_clock(times: Array, clock: Array, delay: Array, possible: npt.NDArray[np.bool_]) -> Iterator[LaneGroup]:
    """The possible lanes, those with nearly the same clock together.

    times: of the samples, by the clock of the recording [s]; clock, delay [s], possible: (lanes,). Until its time zero
    a machine is held at its start.
    """
    paces, own = _distinct(np.column_stack([clock, delay]))
    moments = np.maximum(times / paces[:, :1] + paces[:, 1:], 0.0)
    for together in _alike(moments[:, -1]):
        lanes = np.flatnonzero(np.logical_and(possible, np.isin(own, together)))
        if lanes.size:
            instants, shown = np.unique(moments[together], return_inverse=True)
            rows = shown.reshape(len(together), -1)[np.searchsorted(together, own[lanes])]
            yield LaneGroup(lanes, instants, rows)


def _distinct(rows: Array) -> tuple[Array, npt.NDArray[np.intp]]:
    """The rows that differ, and the number of each row among them; mostly they are all the same."""
    if np.all(rows == rows[:1]):
        return rows[:1], np.zeros(len(rows), dtype=np.intp)
    found, numbers = np.unique(rows, axis=0, return_inverse=True)
    return found, numbers.ravel()


def _alike(ends: Array) -> Iterator[npt.NDArray[np.intp]]:
    """Numbers of runs by their ends [s], nearly equal ones together: by clocks in a difference, for instance."""
    left = np.arange(len(ends))
    while left.size:
        near = np.abs(ends[left] - ends[left[0]]) <= _HARDLY * ends[left[0]]
        yield left[near][:_PACES]
        left = np.sort(np.concatenate([left[near][_PACES:], left[~near]]))
