"""A measured signal without its noise: as smooth as its samples predict each other best."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]
_ORDER = 5
"""Of the differences: a drive's acceleration counts, to the ends; third ones leave five times as much error in it."""
_REFINEMENTS = 2
_FEWEST = 20
"""Samples, below which nothing tells noise from motion."""
_FEW_PLACES = 4.0
"""Times the median deviation: a root mean square above it is that of jumps (1.5 of normal noise)."""
_PROBES = 8
_LESS = 1e-2
"""Of the strength that predicts best: more noise is left, but it then is larger than what is bent near the ends."""
_STRENGTHS = 10.0 ** np.arange(-6.0, 11.01, 0.5)


def smooth(times: Array, columns: Array, strength: float) -> Array:
    """Columns (samples, k) with sum (z - y)^2 + strength * sum (fifth differences of z)^2 at its least.

    Whittaker (1923) as Eilers (2003) has it, by divided differences in units of the median interval: what is of fourth
    degree passes unchanged.
    """
    from scipy.linalg import cho_solve_banded, cholesky_banded
    from scipy.sparse import diags_array

    x = times / np.median(np.diff(times))
    differences = diags_array(np.ones(len(x))).tocsr()
    for order in range(1, _ORDER + 1):
        count, slope = len(x) - order, order / (x[order:] - x[:-order])
        differences = diags_array([-slope, slope], offsets=[0, 1], shape=(count, count + 1)).tocsr() @ differences
    penalty = differences.T @ differences
    bands = np.zeros((_ORDER + 1, len(x)))
    for k in range(_ORDER + 1):
        bands[k, : len(x) - k] = strength * penalty.diagonal(-k)
    bands[0] += 1.0
    root = cholesky_banded(bands, lower=True), True
    found = cho_solve_banded(root, columns)
    for _ in range(_REFINEMENTS):  # round-off of the product of differences is larger than that of each of them
        found = found + cho_solve_banded(root, columns - found - strength * (differences.T @ (differences @ found)))
    return np.asarray(found)


def strength_of(times: Array, values: Array) -> tuple[float, float]:
    """Strength of smoothing, and the noise of a signal, by generalised cross-validation (Craven and Wahba 1979).

    Both 0 where smoothing is of no use: a signal without noise, of few samples, or one that jumps, where what smoothing
    takes away stands in few places.
    """
    if len(times) < _FEWEST:
        return 0.0, 0.0
    # The trace of the smoothing is that which random signs see of it (Hutchinson 1990).
    signs = np.sign(np.random.default_rng(0).standard_normal((len(times), _PROBES)))
    least, best = np.inf, (0.0, 0.0)
    for strength in _STRENGTHS:
        try:
            seen = smooth(times, np.column_stack([values, signs]), float(strength))
        except np.linalg.LinAlgError:  # intervals of very different lengths
            break
        off = np.abs(values - seen[:, 0])
        left = float(off @ off)
        free = len(times) - float(np.sum(signs * seen[:, 1:])) / _PROBES
        if (score := left / free**2) < least:
            jumps = np.sqrt(left / len(times)) >= _FEW_PLACES * np.median(off)
            useful = strength > _STRENGTHS[0] and not jumps
            least, best = score, (_LESS * float(strength), float(np.sqrt(left / free))) if useful else (0.0, 0.0)
    return best
