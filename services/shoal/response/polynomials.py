"""Polynomials that are orthonormal under a measure, and which products of them an expansion has."""

from __future__ import annotations

from dataclasses import dataclass
from math import comb

import numpy as np

from shoal.trajectory import Array

Terms = np.ndarray[tuple[int, int], np.dtype[np.int64]]
"""Degree of every term in every parameter, (terms, parameters)."""


@dataclass(frozen=True)
class Recurrence:
    """Orthonormal polynomials by their three-term recurrence.

    sqrt(b_{k+1}) p_{k+1} = (s - a_k) p_k - sqrt(b_k) p_{k-1} with p_0 = 1 (Gautschi, Orthogonal Polynomials, 2004,
    section 1.3). a, b: coefficients, (degrees,); b_0 is not used.
    """

    a: Array
    b: Array

    def __call__(self, s: Array, degree: int) -> Array:
        """Return all polynomials up to a degree at the places s, (places, degree + 1)."""
        return np.ascontiguousarray(np.moveaxis(self.rows(s, degree), 0, -1))

    def rows(self, s: Array, degree: int) -> Array:
        """The same at places of any shape, (degree + 1, ...)."""
        found = np.ones((degree + 1, *np.shape(s)))
        a, roots = self.a.tolist(), np.sqrt(self.b).tolist()
        for k in range(degree):
            now = np.multiply(s - a[k] if a[k] else s, found[k], out=found[k + 1])
            if k:
                now -= roots[k] * found[k - 1]
            now /= roots[k + 1]
        return found


HIGHEST = 40
"""Degree to which recurrences of measures are computed, and of polynomials that are fitted."""
CLASSICAL = 1024
"""Degree to which those in closed form are known."""
_k = np.arange(CLASSICAL + 1, dtype=float)
LEGENDRE = Recurrence(np.zeros(CLASSICAL + 1), np.divide(_k**2, 4 * _k**2 - 1))
"""For the uniform measure on [-1, 1]."""
HERMITE = Recurrence(np.zeros(CLASSICAL + 1), _k.copy())
"""For the standard normal measure (probabilists' Hermite polynomials)."""


def of_measure(nodes: Array, weights: Array) -> Recurrence:
    """The recurrence of a measure given at nodes, by Stieltjes' procedure (Gautschi, 2004, section 2.2).

    It ends where the nodes carry no more: n different nodes carry polynomials up to degree n - 1.
    """
    a, b = [], [1.0]
    now, before = np.ones(len(nodes)), np.zeros(len(nodes))
    for k in range(min(HIGHEST, len(np.unique(nodes)) - 1)):
        a.append(float(weights @ (nodes * now**2)))
        after = (nodes - a[k]) * now - (np.sqrt(b[k]) * before if k else 0.0)
        b.append(float(weights @ after**2))
        if b[-1] < 1e-14:
            b.pop()
            break
        before, now = now, after / np.sqrt(b[-1])
    return Recurrence(np.array(a), np.array(b))


def total_degree(parameters: int, degree: int) -> Terms:
    """Return all products whose degrees sum up to at most `degree`, the lower ones first."""
    terms = [np.zeros((1, parameters), dtype=np.int64)]
    for _ in range(degree):
        more = (terms[-1][:, None] + np.eye(parameters, dtype=np.int64)[None]).reshape(-1, parameters)
        terms.append(np.unique(more, axis=0))
    return np.concatenate(terms)


def tensor(parameters: int, degree: int) -> Terms:
    """Return all products of degree up to `degree` in each parameter."""
    axes = np.meshgrid(*[np.arange(degree + 1)] * parameters, indexing="ij")
    return np.stack([axis.ravel() for axis in axes], axis=1)


def size(parameters: int, degree: int) -> int:
    """Number of terms of total degree."""
    return comb(parameters + degree, degree)
