"""Chebyshev's inclusion function with terms of total degree: a least-squares fit at a choice of the tensor's zeros.

Wu, Luo, Zhang and Zhang, An interval uncertain optimization method for vehicle suspensions using Chebyshev metamodels,
Applied Mathematical Modelling 38, 2014 (collocation at candidates of the tensor product). For comparison.
"""

from __future__ import annotations

import math
from itertools import product

import numpy as np

from shoal.response.design import telling
from shoal.response.expansion import fit
from shoal.response.polynomials import size, total_degree
from shoal.response.study import Found, Study
from shoal.trajectory import Array

DEGREE = 4
SHARE = 1.5
"""Runs for every term."""
CANDIDATES = 20_000
"""Zeros that are chosen from; of more, as many are drawn."""


def chebyshev_total(study: Study) -> Found:
    """So many of the (degree + 1)^p zeros that tell the terms apart best. Raises InputError."""
    study.intervals_only("chebyshev-total")
    parameters, degree = len(study.inputs), study.degree or DEGREE
    while degree > 1 and SHARE * size(parameters, degree) > study.runs.left:
        degree -= 1
    terms = total_degree(parameters, degree)
    candidates = _zeros(parameters, degree, study.seed)
    count = min(math.ceil(SHARE * len(terms)), len(candidates))
    study.runs(telling(study.inputs, np.zeros((1, parameters)), terms, count, candidates))
    runs = study.runs
    surrogate = fit(study.inputs, runs.germs, runs.values, terms)
    return Found(f"polynomials of total degree {degree} fitted at {count} of Chebyshev's zeros", surrogate)


def _zeros(parameters: int, degree: int, seed: int) -> Array:
    zeros = np.cos((np.arange(degree + 1) + 0.5) * np.pi / (degree + 1))
    if len(zeros) ** parameters <= CANDIDATES:
        return np.array(list(product(zeros, repeat=parameters)))
    return np.unique(np.random.default_rng(seed).choice(zeros, (CANDIDATES, parameters)), axis=0)
