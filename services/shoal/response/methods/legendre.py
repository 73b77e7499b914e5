"""Legendre polynomials of total degree, fitted to quasi-random runs by least squares."""

from __future__ import annotations

import math

import numpy as np

from shoal.response.expansion import fit
from shoal.response.polynomials import size, total_degree
from shoal.response.study import Found, Study

DEGREE = 4
SHARE = 1.5
"""Runs for every term."""


def legendre(study: Study) -> Found:
    """Runs denser towards the faces of the box, where polynomials need them. Raises InputError."""
    study.intervals_only("legendre")
    parameters, degree = len(study.inputs), study.degree or DEGREE
    while degree > 1 and SHARE * size(parameters, degree) > study.runs.left:
        degree -= 1
    count = math.ceil(SHARE * size(parameters, degree))
    study.runs(np.sin(0.5 * np.pi * study.inputs.sobol(count, study.seed)))
    runs = study.runs
    surrogate = fit(study.inputs, runs.germs, runs.values, total_degree(parameters, degree))
    return Found(f"polynomials of total degree {degree} fitted to {count} runs", surrogate)
