"""The collocation method Radau IIA of three stages, order 5 (Hairer and Wanner, Solving ODEs II, IV.8), in numbers."""

from __future__ import annotations

import numpy as np

from shoal.mechanics.numerics.tile import Array

STAGES = 3
FILTER = 2
"""The stage whose factored matrix filters the error estimate."""


def _collocation() -> tuple[Array, Array]:
    """A and c: c are the zeros of the right Radau polynomial, A integrates the Lagrange polynomials through them."""
    root = np.sqrt(6.0)
    c = np.array([(4 - root) / 10, (4 + root) / 10, 1.0])
    powers = np.vander(c, STAGES, increasing=True)
    integrals = np.column_stack([c ** (k + 1) / (k + 1) for k in range(STAGES)])
    return np.asarray(np.linalg.solve(powers.T, integrals.T).T, dtype=float), c


def _crout(matrix: Array) -> Array:
    """Lower factor of matrix = lower * upper, where the upper one has ones on its diagonal."""
    lower, rest = np.zeros_like(matrix), matrix.copy()
    for k in range(len(matrix)):
        lower[k:, k] = rest[k:, k]
        rest -= np.outer(rest[:, k], rest[k] / rest[k, k])
    return lower


A, C = _collocation()
T = _crout(A)
# An embedded method of order 3 that also uses the slope at the beginning, with the weight T[FILTER, FILTER], differs
# from the method by sum of DIFFERENCE * (stage - beginning).
DIFFERENCE = np.linalg.solve(
    A.T, np.linalg.solve(np.vander(C, STAGES, increasing=True).T, [-T[FILTER, FILTER], 0.0, 0.0])
)
RATES = np.linalg.inv(np.column_stack([C, C**2, C**3]))
"""Coefficients of x, x^2, x^3 in the rate's collocation polynomial, from what the stages add to the rate at x = 0."""
