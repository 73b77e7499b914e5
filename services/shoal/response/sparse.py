"""Sparse expansions: of many terms the few that each column needs, by orthogonal matching pursuit.

Blatman and Sudret, Adaptive sparse polynomial chaos expansion based on least angle regression, Journal of Computational
Physics 230, 2011 (hyperbolic truncation); Pati, Rezaiifar and Krishnaprasad, Orthogonal matching pursuit, Asilomar
Conference on Signals, Systems and Computers, 1993.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_triangular

from shoal.response.expansion import Expansion, fit
from shoal.response.extremes import IntArray
from shoal.response.inputs import Inputs
from shoal.response.polynomials import Terms, total_degree
from shoal.trajectory import Array

NORM = 0.75
"""Of hyperbolic truncation: terms of several parameters at once are taken up to lower degrees."""
SHARE = 0.5
"""Terms for every run, at most."""
MOST = 160
"""Terms at most."""
PATIENCE = 12
"""Terms in a row that foretell held-out runs no better, after which no more are taken."""
HELD_OUT = 5
"""Of so many runs one has no part in choosing terms."""


def hyperbolic(parameters: int, degree: int) -> Terms:
    """Terms whose degrees k have (sum of k^q)^(1/q) of at most `degree`."""
    terms = total_degree(parameters, degree)
    kept: Terms = terms[(terms.astype(float) ** NORM).sum(axis=1) <= degree**NORM + 1e-9]
    return kept


def sparse(inputs: Inputs, germs: Array, values: Array, terms: Terms, columns: IntArray) -> Expansion:
    """For each of these columns the terms that foretell runs best which had no part in choosing them.

    `left_out` is the error at these runs or, if that is larger, at runs left out of a fit of the terms chosen; other
    columns are 0, with an infinite one.
    """
    basis = inputs.basis(germs, terms)
    kept = np.arange(len(germs)) % HELD_OUT == HELD_OUT - 1
    coefficients, left_out = np.zeros((len(terms), values.shape[1])), np.full(values.shape[1], np.inf)
    for column in columns:
        chosen, left_out[column] = _pursued(basis[~kept], values[~kept, column], basis[kept], values[kept, column])
        again = fit(inputs, germs, values[:, [column]], terms[chosen])
        coefficients[chosen, column] = again.coefficients[:, 0]
        left_out[column] = max(left_out[column], again.left_out[0])
    return Expansion(inputs, terms, coefficients, left_out)


def _pursued(basis: Array, y: Array, unseen: Array, unseen_y: Array) -> tuple[list[int], float]:
    """Terms, and the root mean square error at the runs that are held out."""
    size = np.maximum(np.linalg.norm(basis, axis=0), 1e-300)
    most = max(1, min(int(SHARE * len(y)), MOST, basis.shape[1]))
    q, r = np.zeros((len(y), most)), np.zeros((most, most))
    chosen: list[int] = []
    rest, best, error, stale = y.copy(), 1, np.inf, 0
    scale = float(np.abs(y).max())
    while len(chosen) < most and stale < PATIENCE and np.abs(rest).max() > 1e-13 * scale:
        pull = np.abs(rest @ basis) / size
        pull[chosen] = 0.0
        term, k = int(np.argmax(pull)) if chosen else 0, len(chosen)
        part = q[:, :k].T @ basis[:, term]
        new = basis[:, term] - q[:, :k] @ part
        again = q[:, :k].T @ new
        new -= q[:, :k] @ again
        length = float(np.linalg.norm(new))
        if length < 1e-10 * size[term]:
            break
        q[:, k], r[:k, k], r[k, k] = new / length, part + again, length
        chosen.append(term)
        rest = rest - q[:, k] * (q[:, k] @ y)
        found = solve_triangular(r[: k + 1, : k + 1], q[:, : k + 1].T @ y)
        now = float(np.sqrt(np.mean((unseen_y - unseen[:, chosen] @ found) ** 2)))
        stale = stale + 1 if now >= error else 0
        if now < error:
            best, error = len(chosen), now
    return chosen[:best] or [0], float(error) if chosen else 0.0
