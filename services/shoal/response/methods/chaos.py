"""Polynomial chaos: polynomials orthonormal under the distributions, fitted to quasi-random runs.

Xiu and Karniadakis, The Wiener-Askey polynomial chaos for stochastic differential equations, SIAM Journal on Scientific
Computing 24, 2002; Sudret, Global sensitivity analysis using polynomial chaos expansions, Reliability Engineering and
System Safety 93, 2008.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from shoal.response.expansion import Expansion, fit
from shoal.response.outermost import hidden, outwards
from shoal.response.polynomials import size, total_degree
from shoal.response.sparse import hyperbolic, sparse
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
COARSE = 3e-2
"""Above this share, more runs are made: so many times."""
MORE = 5
HIGHEST = 20
CANDIDATES = 4
"""Terms for every run that a sparse expansion chooses from."""
MOST_CANDIDATES = 1200
MANY = 3
"""Parameters from which on an expansion with all terms is dear."""
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
        if made >= min(fair, made + runs.left) and not study.degree and len(inputs) >= MANY:
            found = _sparser(study, found)
        found = outwards(study.runs.germs, study.runs.values, found)
        beyond = hidden(found.coefficients.T, inputs, found.terms)
        found = replace(found, left_out=np.maximum(found.left_out, beyond))
        off = share(study, found)
        most = MORE * fair if off > COARSE and made >= fair else fair
        if off < CONVERGED or made >= most or not runs.left:
            break
        count = 2 * made
    used = found.terms[np.any(found.coefficients != 0, axis=1)]
    degree, kind = int(used.sum(axis=1).max(initial=0)), "sparse " if len(found.terms) > len(runs.germs) else ""
    return Found(f"{kind}polynomial chaos of degree {degree} fitted to {runs.evaluations} runs", found, found.left_out)


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


def _sparser(study: Study, full: Expansion) -> Expansion:
    """In every column the full expansion, or a sparse one of more terms where that foretells left-out runs better."""
    runs, inputs, parameters = study.runs, study.inputs, len(study.inputs)
    degree = int(full.terms.sum(axis=1).max())
    most = min(CANDIDATES * len(runs.germs), MOST_CANDIDATES)
    while degree < HIGHEST and len(hyperbolic(parameters, degree + 1)) <= most:
        degree += 1
    terms = np.unique(np.vstack([full.terms, hyperbolic(parameters, degree)]), axis=0)
    terms = terms[np.argsort(terms.sum(axis=1), kind="stable")]
    if len(terms) == len(full.terms):
        return full
    found = sparse(inputs, runs.germs, runs.values, terms, np.flatnonzero(shares(study, full) > CONVERGED))
    kept = np.array([np.flatnonzero((terms == term).all(axis=1))[0] for term in full.terms])
    same = np.zeros_like(found.coefficients)
    same[kept] = full.coefficients
    better = found.left_out < full.left_out
    return Expansion(
        inputs,
        terms,
        np.where(better, found.coefficients, same),
        np.where(better, found.left_out, full.left_out),
    )


def share(study: Study, found: Expansion) -> float:
    """The largest of `shares`."""
    return float(shares(study, found).max())


def shares(study: Study, found: Expansion) -> Array:
    """Error at runs that are left out, as a share of the standard deviation of the group, (columns,)."""
    values = study.runs.values
    scale = study.largest(values.std(axis=0), values)
    return np.divide(found.left_out, scale, out=np.zeros_like(scale), where=scale > 0)
