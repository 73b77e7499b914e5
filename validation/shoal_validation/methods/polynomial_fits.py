"""Polynomials at a fixed number of runs: Chebyshev's inclusion function and its variants, Legendre.

- `chebyshev`: interpolation at tensor products of Chebyshev's zeros (Wu, Zhang, Chen and Luo, A Chebyshev interval
  method for nonlinear dynamic systems under uncertainty, Applied Mathematical Modelling 37, 2013).
- `chebyshev-total`: terms of total degree, by least squares at a choice of these zeros (Wu, Luo, Zhang and Zhang, An
  interval uncertain optimization method for vehicle suspensions using Chebyshev metamodels, Applied Mathematical
  Modelling 38, 2014).
- `chebyshev-sparse`: interpolation on a sparse grid of Chebyshev's extrema, nested as Clenshaw and Curtis (Barthelmann,
  Novak and Ritter, High dimensional polynomial interpolation on sparse grids, Advances in Computational Mathematics
  12, 2000).
- `legendre`: terms of total degree, by least squares at quasi-random runs that are denser towards the faces.
"""

from __future__ import annotations

import math
from itertools import product

import numpy as np
from shoal.response.design import informative_places
from shoal.response.expansion import fit
from shoal.response.polynomials import Terms, size, tensor, total_degree
from shoal.response.study import Plan, Study
from shoal.trajectory import Array

DEGREE = 4
"""Unless another one is asked for, or the runs allow less."""
SHARE = 1.5
"""Runs for every term of a least-squares fit."""
CANDIDATES = 20_000
"""Zeros that are chosen from; of more, as many are drawn."""
LEVEL = 3
HIGHEST = 5
"""Level of an axis with 33 places: the degree of polynomials ends not far above."""


def _plan(places: Array, terms: Terms, about: str) -> Plan:
    return Plan(places, lambda study: fit(study.inputs, study.runs.xi, study.runs.values, terms), about)


def chebyshev(study: Study) -> Plan:
    """Plan (degree + 1)^p runs."""
    parameters = len(study.inputs)
    most = int(study.runs.left ** (1 / parameters) + 1e-9) - 1
    degree = study.degree or max(1, min(DEGREE, most))
    zeros = np.array(list(product(_zeros(degree), repeat=parameters)))
    about = f"interpolation of degree {degree} at {(degree + 1) ** parameters} zeros of Chebyshev"
    return _plan(zeros, tensor(parameters, degree), about)


def chebyshev_total(study: Study) -> Plan:
    """Plan runs at those of the (degree + 1)^p zeros that determine the terms best."""
    parameters, degree = len(study.inputs), _degree(study)
    terms, zeros = total_degree(parameters, degree), _zeros(degree)
    if len(zeros) ** parameters <= CANDIDATES:
        candidates = np.array(list(product(zeros, repeat=parameters)))
    else:
        candidates = np.unique(np.random.default_rng(study.seed).choice(zeros, (CANDIDATES, parameters)), axis=0)
    count = min(math.ceil(SHARE * len(terms)), len(candidates))
    places = informative_places(study.inputs, np.zeros((1, parameters)), terms, count, candidates)
    return _plan(places, terms, f"polynomials of total degree {degree} fitted at {count} of Chebyshev's zeros")


def chebyshev_sparse(study: Study) -> Plan:
    """Plan a sparse grid of the level `degree`, or the highest up to three that the runs allow."""
    parameters, level = len(study.inputs), min(study.degree or LEVEL, HIGHEST)
    grid, terms = sparse_grid(parameters, level)
    while not study.degree and level > 1 and len(grid) > study.runs.left:
        level -= 1
        grid, terms = sparse_grid(parameters, level)
    return _plan(grid, terms, f"interpolation on a sparse grid of level {level} with {len(grid)} places")


def legendre(study: Study) -> Plan:
    """Plan runs denser towards the faces of the box, where polynomials need them."""
    degree = _degree(study)
    terms = total_degree(len(study.inputs), degree)
    count = math.ceil(SHARE * len(terms))
    places = np.sin(0.5 * np.pi * study.inputs.sobol(count, study.seed))
    return _plan(places, terms, f"polynomials of total degree {degree} fitted to {count} runs")


def _degree(study: Study) -> int:
    """Return the total degree that is asked for, or the highest up to four that the runs allow."""
    degree = study.degree or DEGREE
    while degree > 1 and SHARE * size(len(study.inputs), degree) > study.runs.left:
        degree -= 1
    return degree


def _zeros(degree: int) -> Array:
    return np.asarray(np.cos((np.arange(degree + 1) + 0.5) * np.pi / (degree + 1)))


def sparse_grid(parameters: int, level: int) -> tuple[Array, Terms]:
    """Return places, (places, parameters), and the terms that they determine, as many.

    With each level of an axis come 1, 2, 2, 4, 8, ... places, and as many degrees. Products are taken whose levels
    sum up to no more than that of the grid.
    """
    fresh = [_added(k) for k in range(level + 1)]
    degrees = [np.arange(_count(k - 1), _count(k)) for k in range(level + 1)]
    places, terms = [], []
    for levels in total_degree(parameters, level).tolist():
        places += list(product(*(fresh[k] for k in levels)))
        terms += list(product(*(degrees[k] for k in levels)))
    order = np.argsort(np.sum(terms, axis=1), kind="stable")
    return np.array(places), np.array(terms, dtype=np.int64)[order]


def _count(level: int) -> int:
    """Return the number of places of an axis up to a level."""
    return min(level + 1, 1) if level < 1 else 2**level + 1


def _added(level: int) -> Array:
    """Return the places of an axis that a level adds."""
    if level == 0:
        return np.zeros(1)
    every = np.arange(2**level + 1)
    added = every[[0, -1]] if level == 1 else every[1::2]
    return np.asarray(np.cos(np.pi * added / 2**level))
