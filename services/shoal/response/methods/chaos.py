"""Polynomial chaos: polynomials orthonormal under the distributions, fitted to quasi-random runs.

Xiu and Karniadakis, The Wiener-Askey polynomial chaos for stochastic differential equations, SIAM Journal on Scientific
Computing 24, 2002; Sudret, Global sensitivity analysis using polynomial chaos expansions, Reliability Engineering and
System Safety 93, 2008.
"""

from __future__ import annotations

import math

import numpy as np

from shoal.response.expansion import Expansion, fit
from shoal.response.polynomials import size, total_degree
from shoal.response.study import Found, Study

SHARE = 2.0
"""Runs for every term."""
RUNS = 300
"""That are made unless the expansion has not converged by then."""
CONVERGED = 1e-4
"""Error at runs that are left out of a fit, as a share of the standard deviation, that is good enough."""
COARSE = 1e-2
"""Above this share, more runs are made: so many times."""
MORE = 5
HIGHEST = 20


def chaos(study: Study) -> Found:
    """Of `degree`, or of the degree that 300 runs carry or fewer suffice for. Raises InputError."""
    study.random_only("chaos")
    return grown(study, study.count or RUNS)


def grown(study: Study, fair: int) -> Found:
    """Degree after degree, until the expansion tells runs that it was not fitted to, or so many runs are made.

    One that is still coarse then may take more.
    """
    runs, inputs = study.runs, study.inputs
    parameters, made, most = len(inputs), 0, fair
    found: Expansion | None = None
    for degree in [study.degree] if study.degree else range(1, HIGHEST + 1):
        count = max(math.ceil(SHARE * size(parameters, degree)), degree + 3)
        if found is not None and share(study, found) > COARSE:
            most = MORE * fair
        if found is not None and count > min(most, made + runs.left):
            break
        runs(inputs.sobol(count - made, study.seed, made))
        made = count
        found = fit(inputs, runs.germs, runs.values, total_degree(parameters, degree))
        if share(study, found) < CONVERGED:
            break
    assert found is not None
    degree = int(found.terms.sum(axis=1).max())
    return Found(f"polynomial chaos of degree {degree} fitted to {runs.evaluations} runs", found, found.left_out)


def share(study: Study, found: Expansion) -> float:
    """The largest error at runs that are left out, as a share of the standard deviation of its group."""
    scale = study.largest(np.sqrt(found.variance), study.runs.values)
    return float(np.max(np.divide(found.left_out, scale, out=np.zeros_like(scale), where=scale > 0)))
