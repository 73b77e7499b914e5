"""Radial basis functions: thin-plate splines through quasi-random runs (scipy's RBFInterpolator)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import RBFInterpolator

from shoal.response.inputs import IntArray
from shoal.response.study import Found, Study
from shoal.trajectory import Array

COUNT = 20
"""Runs for every parameter."""


@dataclass(frozen=True)
class Spline:
    """A spline as a surrogate."""

    spline: RBFInterpolator

    def __call__(self, germs: Array) -> Array:
        """The answers at these germs."""
        return np.asarray(self.spline(germs))

    def each(self, germs: Array, columns: IntArray) -> Array:
        """One column at each germ."""
        found = np.empty(len(germs))
        for k in range(0, len(germs), 256):
            some = slice(k, k + 256)
            found[some] = self.spline(germs[some])[np.arange(len(germs[some])), columns[some]]
        return found


def rbf(study: Study) -> Found:
    """A spline through `count` runs and the corners of a star. Raises InputError."""
    study.intervals_only("rbf")
    parameters = len(study.inputs)
    count = min(study.count or COUNT * parameters, study.runs.left - 2 * parameters - 1)
    unit = np.eye(parameters)
    study.runs(np.vstack([np.zeros((1, parameters)), unit, -unit, study.inputs.sobol(count, study.seed)]))
    runs = study.runs
    return Found(
        f"a spline of radial basis functions through {len(runs.germs)} runs",
        Spline(RBFInterpolator(runs.germs, runs.values, kernel="thin_plate_spline")),
    )
