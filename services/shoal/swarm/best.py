"""The bulletin board of every optimiser: failures cost infinitely much, the best never gets worse."""

from __future__ import annotations

import numpy as np

from shoal.swarm.protocol import Array


def without_failures(values: Array, count: int) -> Array:
    """Values of `count` candidates with every nan or inf replaced by +inf, (count,). Raises ValueError."""
    found = np.asarray(values, dtype=float)
    if found.shape != (count,):
        raise ValueError(f"expected one value for each of {count} candidates, found shape {found.shape}")
    return np.where(np.isfinite(found), found, np.inf)


def better_of(best: Array, best_value: float, points: Array, values: Array) -> tuple[Array, float]:
    """The better of the best so far (d,) and the best of some points (n, d); point and value stay in step."""
    first = int(np.argmin(values))
    if values[first] < best_value:
        return points[first].copy(), float(values[first])
    return best, best_value
