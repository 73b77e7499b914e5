"""Interpolation of scattered runs by kriging (a Gaussian process) or radial basis functions (thin-plate splines).

Kriging: Sacks, Welch, Mitchell and Wynn, Design and analysis of computer experiments, Statistical Science 4, 1989;
errors at left-out runs by Dubrule, Cross validation of kriging in a unique neighborhood, Mathematical Geology 15, 1983.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import RBFInterpolator
from shoal.response.inputs import IntArray
from shoal.response.study import Plan, Study
from shoal.trajectory import Array

COUNT = 20
"""Runs for every parameter: Loeppky, Sacks and Welch (Technometrics 51, 2009) recommend ten, here doubled."""
LENGTHS = 0.2, 0.4, 0.7, 1.0, 1.5, 2.5, 4.0
"""Of the correlation, in half intervals."""
NUGGET = 1e-10
"""Share of the variance that is taken for rounding."""


@dataclass(frozen=True)
class Process:
    """The mean of a process: middle + correlation with every run times its weight.

    left_out: error at each run of the process through all others, root of the mean square, (columns,)
    """

    xi: Array
    middle: Array
    weights: Array
    length: float
    left_out: Array

    def __call__(self, xi: Array) -> Array:
        """Return all columns at these places."""
        return np.asarray(self.middle + _correlation(xi, self.xi, self.length) @ self.weights)

    def each(self, xi: Array, columns: IntArray) -> Array:
        """Return one column at each place."""
        correlation = _correlation(xi, self.xi, self.length)
        return np.asarray(self.middle[columns] + np.einsum("ij,ji->i", correlation, self.weights[:, columns]))


def _correlation(one: Array, other: Array, length: float) -> Array:
    square = (one**2).sum(axis=1)[:, None] + (other**2).sum(axis=1) - 2 * one @ other.T
    return np.asarray(np.exp(-0.5 * np.maximum(square, 0.0) / length**2))


def kriging(study: Study) -> Plan:
    """Plan `count` runs, the centre and a star, and a process through them."""
    places = _places(study)
    return Plan(places, lambda made: _best(made.runs.xi, made.runs.values), f"kriging through {len(places)} runs")


def _best(xi: Array, values: Array) -> Process:
    """Return the process whose correlation length predicts left-out runs best."""
    middle = values.mean(axis=0)
    best, error = None, np.inf
    for length in LENGTHS:
        inverse = np.linalg.inv(_correlation(xi, xi, length) + NUGGET * np.eye(len(xi)))
        weights = inverse @ (values - middle)
        missed = (weights / np.diag(inverse)[:, None]) ** 2
        if best is None or missed.mean() < error:
            best, error = Process(xi, middle, weights, length, np.sqrt(missed.mean(axis=0))), missed.mean()
    assert best is not None
    return best


@dataclass(frozen=True)
class Spline:
    """A spline as a surrogate."""

    spline: RBFInterpolator

    def __call__(self, xi: Array) -> Array:
        """Return all columns at these places."""
        return np.asarray(self.spline(xi))

    def each(self, xi: Array, columns: IntArray) -> Array:
        """Return one column at each place."""
        found = np.empty(len(xi))
        for k in range(0, len(xi), 256):
            some = slice(k, k + 256)
            found[some] = self.spline(xi[some])[np.arange(len(xi[some])), columns[some]]
        return found


def rbf(study: Study) -> Plan:
    """Plan `count` runs, the centre and a star, and a spline through them."""
    places = _places(study)
    about = f"a spline of radial basis functions through {len(places)} runs"
    return Plan(places, _spline, about)


def _spline(study: Study) -> Spline:
    return Spline(RBFInterpolator(study.runs.xi, study.runs.values, kernel="thin_plate_spline"))


def _places(study: Study) -> Array:
    """Return the centre, the ends of all axes, and `count` quasi-random places, by default `COUNT` a parameter."""
    parameters = len(study.inputs)
    count = min(study.count or COUNT * parameters, study.runs.left - 2 * parameters - 1)
    unit = np.eye(parameters)
    return np.vstack([np.zeros((1, parameters)), unit, -unit, study.inputs.sobol(count, study.seed)])
