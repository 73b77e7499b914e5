"""The course of a search by whole populations: rows of (iteration, best, mean fitness)."""

from __future__ import annotations

import numpy as np

from shoal.identification.forward import Progress
from shoal.trajectory import Array

CONTRACTED = 1e-3
"""A search is over when the population fills no more than this fraction of each range."""


class Course(list[tuple[int, float, float]]):
    """A row for each population, of which `progress` is told."""

    def __init__(self, progress: Progress) -> None:
        super().__init__()
        self._progress = progress

    def note(self, values: Array) -> Array:
        """Add the row of a population; returns its values."""
        finite = values[np.isfinite(values)]
        best = min([*finite.tolist(), self[-1][1] if self else np.inf])
        self.append((len(self), best, mean_of(values)))
        self._progress(*self[-1])
        return values


def mean_of(values: Array) -> float:
    """Mean of those that are finite; inf if none is."""
    finite = values[np.isfinite(values)]
    return float(finite.mean()) if finite.size else float("inf")
