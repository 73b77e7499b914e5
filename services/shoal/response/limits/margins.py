"""Runs at places of the standard normal space: how far each stays from a limit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from shoal.response.inputs import Inputs
from shoal.response.runs import Model, TooManyRunsError
from shoal.trajectory import Array

FAR = 8.0
"""Distance from the origin up to which places are evaluated: beyond lies a probability of 6e-16, the rounding unit."""


@dataclass
class Margins:
    """Call it with places, (runs, parameters): the margins over time, (runs, instants), nan where a run failed.

    All parameters are random; each place is that of independent standard normal variables (Nataf's or, for parameters
    that do not correlate, Rosenblatt's transformation).
    """

    model: Model
    inputs: Inputs
    most: int
    progress: Callable[[int], None] | None = None
    evaluations: int = 0
    failed: int = 0
    repeated: int = 0
    why: str = ""
    _places: list[Array] = field(default_factory=list)
    _rows: list[Array] = field(default_factory=list)

    def __call__(self, places: Array) -> Array:
        """Return the margins at these places. Raises InputError, and TooManyRunsError before more than `most` runs."""
        if self.evaluations + len(places) > self.most:
            raise TooManyRunsError
        answers = self.model(self.inputs.values(self.inputs.standard(places)))
        self.evaluations += len(places)
        self.failed += int(np.sum(~answers.good))
        self.repeated += answers.repeated
        self.why = self.why or answers.why
        if self.progress is not None:
            self.progress(self.evaluations)
        rows = np.where(answers.good[:, None], answers.values, np.nan)
        self._places.append(places)
        self._rows.append(rows)
        return rows

    @property
    def known(self) -> tuple[Array, Array]:
        """Places and margins of all runs so far, (runs, parameters) and (runs, instants)."""
        return np.concatenate(self._places), np.concatenate(self._rows)

    @property
    def left(self) -> int:
        """Runs that may still be made."""
        return self.most - self.evaluations


def least(margins: Array) -> Array:
    """The least margin of every run, (runs,), infinite where it failed."""
    found = margins.min(axis=1)
    return np.where(np.isnan(found), np.inf, found)
