"""Radial basis functions: thin-plate splines through quasi-random runs (scipy's RBFInterpolator)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import RBFInterpolator

from shoal.response.inputs import IntArray
from shoal.response.methods.fitted import Plan, star_and_sobol
from shoal.response.study import Study
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


def rbf(study: Study) -> Plan:
    """Plan `count` runs, the centre and a star, and a spline through them."""
    places = star_and_sobol(study, COUNT)
    about = f"a spline of radial basis functions through {len(places)} runs"
    return Plan(places, _spline, about)


def _spline(study: Study) -> Spline:
    return Spline(RBFInterpolator(study.runs.germs, study.runs.values, kernel="thin_plate_spline"))
