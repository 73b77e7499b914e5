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
from shoal.trajectory import Array

SHARE = 2.0
"""Runs for every term, at least."""
FIRST = 16
"""Runs to begin with; they are doubled."""
RUNS = 300
"""That are made unless the expansion is coarse by then."""
CONVERGED = 1e-4
"""Error at runs that are left out of a fit, as a share of the standard deviation, that is good enough."""
COARSE = 1e-2
"""Above this share, more runs are made: so many times."""
MORE = 5
HIGHEST = 20
WORSE = 2
"""Degrees in a row that made it worse, after which no higher one is tried."""


def chaos(study: Study) -> Found:
    """Of `degree`, or of the degree that foretells best what is left out of its fit. Raises InputError."""
    study.random_only("chaos")
    return grown(study, study.count or RUNS)


def grown(study: Study, fair: int) -> Found:
    """More and more runs, until an expansion tells those that it was not fitted to, or so many are made.

    One that is still coarse then may take more.
    """
    runs, inputs = study.runs, study.inputs
    least = math.ceil(SHARE * size(len(inputs), study.degree or 1))
    most, made = fair, 0
    count = max(FIRST, 2 ** math.ceil(math.log2(least)))
    while True:
        count = max(min(count, most, made + runs.left), min(least, made + runs.left))
        runs(inputs.sobol(count - made, study.seed, made))
        made = count
        found = _best(study)
        off = share(study, found)
        most = MORE * fair if off > COARSE else fair
        if off < CONVERGED or made >= most or not runs.left:
            break
        count = 2 * made
    degree = int(found.terms.sum(axis=1).max())
    return Found(f"polynomial chaos of degree {degree} fitted to {runs.evaluations} runs", found, found.left_out)


def _best(study: Study) -> Expansion:
    """The expansion with the least error at runs that are left out, among those that the runs there are carry."""
    runs, inputs, worse = study.runs, study.inputs, 0
    best: Expansion | None = None
    for degree in [study.degree] if study.degree else range(1, HIGHEST + 1):
        if best is not None and SHARE * size(len(inputs), degree) > len(runs.germs):
            break
        found = fit(inputs, runs.germs, runs.values, total_degree(len(inputs), degree))
        better = best is None or share(study, found) < share(study, best)
        best, worse = (found, 0) if better or best is None else (best, worse + 1)
        if worse == WORSE:
            break
    assert best is not None
    return best


def share(study: Study, found: Expansion) -> float:
    """The largest of `shares`."""
    return float(shares(study, found).max())


def shares(study: Study, found: Expansion) -> Array:
    """Error at runs that are left out, as a share of the standard deviation of the group, (columns,)."""
    values = study.runs.values
    scale = study.largest(values.std(axis=0), values)
    return np.divide(found.left_out, scale, out=np.zeros_like(scale), where=scale > 0)
