"""Gauss quadrature of smooth answers of few random parameters: spectral convergence, where sampling needs thousands.

The rule of n points in each parameter integrates polynomials of degree 2 n - 1 exactly; the expansion through its
points is the pseudo-spectral projection (Xiu, Efficient collocational approach for parametric uncertainty analysis,
Communications in Computational Physics 2, 2007). The number of points is doubled until two rules agree.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh_tridiagonal

from shoal.errors import InputError
from shoal.response.enclosure import CONTROLS
from shoal.response.expansion import Expansion
from shoal.response.inputs import ENDS, Inputs
from shoal.response.polynomials import Recurrence, tensor
from shoal.response.runs import TimeIsUpError
from shoal.response.statistics import CONFIDENCE
from shoal.response.study import CONVERGED, Found, Study
from shoal.trajectory import Array

FIRST = {1: 8, 2: 6}
"""Points in each parameter of the first rule, by the number of parameters."""
MOST = {1: 256, 2: 576}
"""Runs of one rule. A uniform parameter has as many points. Of 1024 points of a normal one 143 are not negligible; they
resolve a phase that spreads by 20 rad."""
NEGLIGIBLE = ENDS[0]
"""Weight below which a point needs no run: about seven standard deviations out, where values may be impossible."""
ROUGH = 10.0
"""So many times that share runs that are drawn may be off, as those of other methods that are good enough are."""


def gauss(recurrence: Recurrence, count: int) -> tuple[Array, Array]:
    """Nodes and weights of the measure of some orthonormal polynomials, (count,) each (Golub and Welsch, 1969)."""
    nodes, vectors = eigh_tridiagonal(recurrence.a[:count], np.sqrt(recurrence.b[1:count]))
    return np.asarray(nodes, dtype=float), np.asarray(vectors[0] ** 2, dtype=float)


def quadrature(study: Study) -> Found | None:
    """An expansion, or None where the rules do not agree or do not predict drawn runs; then all are set aside."""
    if study.degree or study.count or not study.inputs.random.all() or len(study.inputs) not in FIRST:
        return None
    try:
        found = _agreeing(study)
    except InputError:
        # What far points state may be impossible; drawn runs seldom lie there.
        found = None
    if found is None:
        study.runs.set_aside()
    return found


def _agreeing(study: Study) -> Found | None:
    """Double the points until two rules agree. Raises InputError."""
    inputs, runs = study.inputs, study.runs
    before: Expansion | None = None
    count = FIRST[len(inputs)]
    while min(inputs.highest(count)) == count:
        made = runs.evaluations
        xi, weights = rule(inputs, count)
        if len(xi) > min(MOST[len(inputs)], runs.left - CONTROLS):
            return None
        try:
            runs.all(xi)
        except TimeIsUpError:
            return _broken_off(before)
        if runs.failed:
            return None
        values = runs.values[made:] if made else runs.values
        found = _projected(inputs, xi, weights, values, count)
        if before is not None:
            std, apart = np.sqrt(found.variance), np.abs(found.mean - before.mean)
            apart = np.maximum(apart, np.abs(std - np.sqrt(before.variance)))
            if np.all(apart <= CONVERGED * study.largest(std, values)):
                try:
                    return _controlled(study, found, apart, count)
                except TimeIsUpError:
                    return _broken_off(found)
        before, count = found, 2 * count
    return None


def _broken_off(found: Expansion | None) -> Found:
    """Return the result of the last rule that was finished. Raises TimeIsUpError if there is none."""
    if found is None:
        raise TimeIsUpError
    std = np.sqrt(found.variance)
    return Found("broken off when the time was up", found, std, errors=(std, std), drawn=0)


def _controlled(study: Study, found: Expansion, apart: Array, count: int) -> Found | None:
    """Check the expansion by runs that the rule has not seen. Raises InputError."""
    inputs, runs, made = study.inputs, study.runs, study.runs.evaluations
    runs.all(inputs.sobol(CONTROLS, study.seed))
    if runs.failed:
        return None
    values = runs.values[made:]
    missed = np.sqrt(np.mean((found(runs.xi[made:]) - values) ** 2, axis=0))
    if np.any(missed > ROUGH * CONVERGED * study.largest(np.sqrt(found.variance), values)):
        return None
    error = apart + CONFIDENCE * missed / np.sqrt(CONTROLS)
    why = f"Gauss quadrature with {count} points in each parameter; {CONTROLS} drawn runs control it"
    return Found(why, found, missed, errors=(error, error), drawn=CONTROLS)


def rule(inputs: Inputs, count: int) -> tuple[Array, Array]:
    """Germs, (runs, parameters), and weights, (runs,), of the tensor product."""
    rules = [gauss(inputs.recurrence(k), count) for k in range(len(inputs))]
    axes = np.meshgrid(*(nodes for nodes, _ in rules), indexing="ij")
    shares = np.meshgrid(*(weights for _, weights in rules), indexing="ij")
    weight = np.prod([share.ravel() for share in shares], axis=0)
    some = weight > NEGLIGIBLE
    return np.stack([axis.ravel() for axis in axes], axis=1)[some], weight[some]


def _projected(inputs: Inputs, xi: Array, weights: Array, values: Array, count: int) -> Expansion:
    terms = tensor(len(inputs), count - 1)
    basis = inputs.basis(xi, terms)
    return Expansion(inputs, terms, basis.T @ (weights[:, None] * values), np.zeros(values.shape[1]))
