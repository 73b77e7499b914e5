"""Kriging: a Gaussian process through quasi-random runs, with the length that predicts left-out runs best.

Sacks, Welch, Mitchell and Wynn, Design and analysis of computer experiments, Statistical Science 4, 1989; errors at
left-out runs by Dubrule, Cross validation of kriging in a unique neighborhood, Mathematical Geology 15, 1983. For
comparison.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shoal.response.inputs import IntArray
from shoal.response.methods.fitted import Plan, star_and_sobol
from shoal.response.study import Study
from shoal.trajectory import Array

COUNT = 20
"""Runs for every parameter."""
LENGTHS = 0.2, 0.4, 0.7, 1.0, 1.5, 2.5, 4.0
"""Of the correlation, in half intervals."""
NUGGET = 1e-10
"""Share of the variance that is taken for rounding."""


@dataclass(frozen=True)
class Process:
    """The mean of a process: middle + correlation with every run times its weight.

    left_out: error at each run of the process through all others, root of the mean square, (columns,)
    """

    germs: Array
    middle: Array
    weights: Array
    length: float
    left_out: Array

    def __call__(self, germs: Array) -> Array:
        """The answers at these germs."""
        return np.asarray(self.middle + _correlation(germs, self.germs, self.length) @ self.weights)

    def each(self, germs: Array, columns: IntArray) -> Array:
        """One column at each germ."""
        correlation = _correlation(germs, self.germs, self.length)
        return np.asarray(self.middle[columns] + np.einsum("ij,ji->i", correlation, self.weights[:, columns]))


def _correlation(one: Array, other: Array, length: float) -> Array:
    square = (one**2).sum(axis=1)[:, None] + (other**2).sum(axis=1) - 2 * one @ other.T
    return np.asarray(np.exp(-0.5 * np.maximum(square, 0.0) / length**2))


def kriging(study: Study) -> Plan:
    """Plan `count` runs, the centre and a star, and a process through them."""
    places = star_and_sobol(study, COUNT)
    return Plan(places, lambda made: _best(made.runs.germs, made.runs.values), f"kriging through {len(places)} runs")


def _best(germs: Array, values: Array) -> Process:
    """Return the process whose correlation length predicts left-out runs best."""
    middle = values.mean(axis=0)
    best, error = None, np.inf
    for length in LENGTHS:
        inverse = np.linalg.inv(_correlation(germs, germs, length) + NUGGET * np.eye(len(germs)))
        weights = inverse @ (values - middle)
        missed = (weights / np.diag(inverse)[:, None]) ** 2
        if best is None or missed.mean() < error:
            best, error = Process(germs, middle, weights, length, np.sqrt(missed.mean(axis=0))), missed.mean()
    assert best is not None
    return best
