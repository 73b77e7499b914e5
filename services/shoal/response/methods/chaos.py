"""Polynomial chaos: polynomials orthonormal under the distributions, fitted to quasi-random runs.

Xiu and Karniadakis, The Wiener-Askey polynomial chaos for stochastic differential equations, SIAM Journal on Scientific
Computing 24, 2002; Sudret, Global sensitivity analysis using polynomial chaos expansions, Reliability Engineering and
System Safety 93, 2008.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from shoal.response.expansion import Expansion, choose_degree, hidden, outwards
from shoal.response.inputs import BoolArray
from shoal.response.polynomials import size
from shoal.response.regularised import likeliest, regularised, trimmed
from shoal.response.statistics import moment_errors
from shoal.response.study import CONVERGED, RUNS, Found, Study, share_of
from shoal.response.transformations import Transformed, compared, transformed, untransformed
from shoal.trajectory import Array

SHARE = 2.0
"""Runs for every term, at least: the oversampling ratio of 2 to 3 that is usual (Sudret 2008)."""
FIRST = 128
"""Runs to begin with; they are doubled."""
COARSE = 3e-2
"""Above this share, more runs are made: so many times."""
MORE = 5
"""Factor on the runs of a coarse expansion, at most."""
DECAYS = 6
"""Columns to which the decay of coefficients is fitted."""


def chaos(study: Study) -> Found:
    """Expand in `degree`, or in the degree of the least leave-one-out error. Raises InputError."""
    study.random_only("chaos")
    return grown(study, study.count or RUNS)


def grown(study: Study, fair: int) -> Found:
    """Make more and more runs, until an expansion predicts those that it was not fitted to, or `fair` are made.

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
        chosen = _expanded(study, more=made >= min(fair, made + runs.left) and not study.degree)
        off = share(study, chosen.left_out)
        most = MORE * fair if off > COARSE and made >= fair else fair
        if off < CONVERGED or made >= most or not runs.left:
            break
        count = 2 * made
    found = chosen.plain
    degree = int(found.terms.sum(axis=1).max(initial=0))
    kind = "regularised " if len(found.terms) > len(runs.xi) / SHARE else ""
    why = f"{kind}polynomial chaos of degree {degree} fitted to {len(runs.xi)} runs{chosen.why}"
    errors = moment_errors(study, chosen, lambda part: chosen.again(part, _fitted, _chosen))
    return Found(why, found, chosen.left_out, errors=errors, transformed=chosen if chosen.links else None)


def _expanded(study: Study, *, more: bool) -> Transformed:
    """The expansion, with links where they are clearly better, and with more terms where it still misses something."""
    found = _chosen(study)
    wanted = shares(study, found.left_out) > CONVERGED
    chosen = untransformed(found) if study.degree else transformed(study, found, wanted, _chosen)
    if more:
        chosen = compared(chosen, _with_more_terms(study, found, shares(study, chosen.left_out) <= CONVERGED))
    return chosen


def _chosen(study: Study) -> Expansion:
    return choose_degree(study, SHARE, lambda one: _reaching(study, one))


def _fitted(study: Study) -> Expansion:
    """Fit an expansion to the runs of a part of a study."""
    found = _chosen(study)
    return found if study.degree else _with_more_terms(study, found, shares(study, found.left_out) <= CONVERGED)


def _reaching(study: Study, found: Expansion) -> Expansion:
    """Return an expansion whose error includes that further out than runs reach."""
    found = outwards(study.runs.xi, study.runs.values, found)
    return _with_hidden(found)


def _with_hidden(found: Expansion) -> Expansion:
    beyond = hidden(found.coefficients.T, found.inputs, found.terms)
    return replace(found, left_out=np.maximum(found.left_out, beyond))


def _with_more_terms(study: Study, found: Expansion, good: BoolArray) -> Expansion:
    """Return in every column that expansion, or a regularised one that predicts better; good: need none, (columns,).

    The decay of coefficients is fitted to the worst column; where it serves other columns it is taken there as well.
    """
    runs, inputs = study.runs, study.inputs
    tried = good.copy()
    for _ in range(DECAYS):
        open_shares = np.where(tried, 0.0, shares(study, found.left_out))
        worst = int(open_shares.argmax())
        if open_shares[worst] <= CONVERGED:
            break
        tried[worst] = True
        decay = likeliest(inputs, runs.xi, runs.values[:, worst])
        other = _with_hidden(regularised(inputs, runs.xi, runs.values, decay))
        better = other.left_out < found.left_out
        if better.any():
            found = trimmed(other.where(better, found))
    return found


def share(study: Study, left_out: Array) -> float:
    """The largest of `shares`."""
    return float(shares(study, left_out).max())


def shares(study: Study, left_out: Array) -> Array:
    """Error at runs that are left out, (columns,), as a share of the standard deviation of the group, (columns,)."""
    values = study.runs.values
    scale = study.largest(values.std(axis=0), values)
    return share_of(left_out, scale)
