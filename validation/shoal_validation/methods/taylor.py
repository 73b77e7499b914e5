"""Taylor's series of first or second order about the centre of the box, or of each of its subintervals.

Interval perturbation (Qiu and Wang, Comparison of dynamic response of structures with uncertain-but-bounded parameters
using non-probabilistic interval analysis method and probabilistic approach, International Journal of Solids and
Structures 40, 2003), of second order and with subintervals (Qiu and Elishakoff, Antioptimization of structures with
large uncertain-but-non-random parameters via interval analysis, Computer Methods in Applied Mechanics and Engineering
152, 1998).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations, product

import numpy as np
from shoal.errors import ComputationError
from shoal.response.expansion import Expansion, fit
from shoal.response.inputs import IntArray
from shoal.response.polynomials import total_degree
from shoal.response.study import Plan, Study
from shoal.trajectory import Array

STEP = 0.05
"""Of the differences, as a share of half the interval, or subinterval."""


@dataclass(frozen=True)
class Pieces:
    """A series for each cell of a box that is cut alike along every axis; cells: in the order of their numbers."""

    cut: int
    cells: list[Expansion]

    def __call__(self, xi: Array) -> Array:
        """The answers at these places."""
        found = np.empty((len(xi), self.cells[0].coefficients.shape[1]))
        cell, local = located(xi, self.cut)
        for k in np.unique(cell):
            found[cell == k] = self.cells[k](local[cell == k])
        return found

    def each(self, xi: Array, columns: IntArray) -> Array:
        """Return one column at each place."""
        found = np.empty(len(xi))
        cell, local = located(xi, self.cut)
        for k in np.unique(cell):
            found[cell == k] = self.cells[k].each(local[cell == k], columns[cell == k])
        return found


def located(xi: Array, cut: int) -> tuple[IntArray, Array]:
    """The cell of every place, (places,), and where in it, from -1 to 1 along each axis."""
    along = np.clip(np.floor(0.5 * cut * (xi + 1)).astype(np.int64), 0, cut - 1)
    middle = (2 * along + 1) / cut - 1
    return np.asarray(along @ cut ** np.arange(xi.shape[1])), np.asarray((xi - middle) * cut)


def taylor(study: Study) -> Plan:
    """Plan a series of order `degree`, 1 or 2, in as many subintervals along each axis as `count` runs allow.

    First order takes 2 p + 1 runs a cell, second order p (p - 1) / 2 more. Its fit raises ComputationError.
    """
    parameters, order = len(study.inputs), min(study.degree or 1, 2)
    unit = STEP * np.eye(parameters)
    around = [np.zeros((1, parameters)), unit, -unit]
    if order == 2 and parameters > 1:
        around.append(np.array([unit[i] + unit[j] for i, j in combinations(range(parameters), 2)]))
    stencil = np.concatenate(around)
    most = min(study.count or len(stencil), study.runs.left)
    cut = max(1, int((most / len(stencil)) ** (1 / parameters) + 1e-9))
    middles = np.array(list(product((2 * np.arange(cut) + 1) / cut - 1, repeat=parameters)))
    places = (middles[:, None] + stencil / cut).reshape(-1, parameters)
    about = "the centre" if cut == 1 else f"the centres of {cut} subintervals along each axis"
    words = f"Taylor's series of order {order} about {about}, whose rest is not known"
    return Plan(places, lambda made: _series(made, order, cut), words)


def _series(study: Study, order: int, cut: int) -> Expansion | Pieces:
    """Fit the series of every cell. Raises ComputationError."""
    runs, parameters = study.runs, len(study.inputs)
    cell, local = located(runs.xi, cut)
    terms = total_degree(parameters, order)
    if len(np.unique(cell)) < cut**parameters:
        raise ComputationError(f"all runs of a subinterval failed: {runs.why}")
    cells = [fit(study.inputs, local[cell == k], runs.values[cell == k], terms) for k in range(cut**parameters)]
    return cells[0] if cut == 1 else Pieces(cut, cells)
