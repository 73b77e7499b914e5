"""Interpolation on a sparse grid of Chebyshev's extrema (Smolyak's construction, nested as Clenshaw and Curtis).

Barthelmann, Novak and Ritter, High dimensional polynomial interpolation on sparse grids, Advances in Computational
Mathematics 12, 2000. For comparison.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from shoal.response.expansion import fit
from shoal.response.polynomials import Terms, total_degree
from shoal.response.study import Found, Study
from shoal.trajectory import Array

LEVEL = 3
HIGHEST = 5
"""Level of an axis with 33 places: the degree of polynomials ends not far above."""


def chebyshev_sparse(study: Study) -> Found:
    """Of the level `degree`, or the highest up to three that the runs allow. Raises InputError."""
    study.intervals_only("chebyshev-sparse")
    parameters, level = len(study.inputs), min(study.degree or LEVEL, HIGHEST)
    grid, terms = sparse_grid(parameters, level)
    while not study.degree and level > 1 and len(grid) > study.runs.left:
        level -= 1
        grid, terms = sparse_grid(parameters, level)
    study.runs(grid)
    runs = study.runs
    surrogate = fit(study.inputs, runs.germs, runs.values, terms)
    return Found(f"interpolation on a sparse grid of level {level} with {len(grid)} places", surrogate)


def sparse_grid(parameters: int, level: int) -> tuple[Array, Terms]:
    """Places, (places, parameters), and the terms that they carry, as many.

    With each level of an axis come 1, 2, 2, 4, 8, ... places, and as many degrees. Products are taken whose levels
    sum up to no more than that of the grid.
    """
    fresh = [_fresh(k) for k in range(level + 1)]
    degrees = [np.arange(_count(k - 1), _count(k)) for k in range(level + 1)]
    places, terms = [], []
    for levels in total_degree(parameters, level).tolist():
        places += list(product(*(fresh[k] for k in levels)))
        terms += list(product(*(degrees[k] for k in levels)))
    order = np.argsort(np.sum(terms, axis=1), kind="stable")
    return np.array(places), np.array(terms, dtype=np.int64)[order]


def _count(level: int) -> int:
    """Places of an axis up to a level."""
    return min(level + 1, 1) if level < 1 else 2**level + 1


def _fresh(level: int) -> Array:
    """Places of an axis that come with a level."""
    if level == 0:
        return np.zeros(1)
    every = np.arange(2**level + 1)
    new = every[[0, -1]] if level == 1 else every[1::2]
    return np.asarray(np.cos(np.pi * new / 2**level))
