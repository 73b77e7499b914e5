"""Chebyshev's inclusion function: interpolation at tensor products of Chebyshev's zeros.

Wu, Zhang, Chen and Luo, A Chebyshev interval method for nonlinear dynamic systems under uncertainty, Applied
Mathematical Modelling 37, 2013.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from shoal.response.expansion import fit
from shoal.response.polynomials import tensor
from shoal.response.study import Found, Study

DEGREE = 4


def chebyshev(study: Study) -> Found:
    """(degree + 1)^p runs. Raises InputError."""
    study.intervals_only("chebyshev")
    parameters = len(study.inputs)
    most = int(study.runs.left ** (1 / parameters) + 1e-9) - 1
    degree = study.degree or max(1, min(DEGREE, most))
    zeros = np.cos((np.arange(degree + 1) + 0.5) * np.pi / (degree + 1))
    study.runs(np.array(list(product(zeros, repeat=parameters))))
    runs = study.runs
    surrogate = fit(study.inputs, runs.germs, runs.values, tensor(parameters, degree))
    return Found(f"interpolation of degree {degree} at {(degree + 1) ** parameters} zeros of Chebyshev", surrogate)
