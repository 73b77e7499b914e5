"""Narrow parts of functions: how narrow shows in the widths of the pieces that were needed to fit them."""

from __future__ import annotations

import numpy as np

from shoal.mechanics.functions import Piecewise
from shoal.mechanics.numerics.tile import Array

NARROW = 0.25
"""Pieces narrower than this fraction of the longest step are not left to a step that sees its error, ..."""
PARTS = 8
"""... and fixed steps pass pieces narrower than themselves in so many, and in no fewer what is short beside its
neighbours."""
GRADED = 1.9
"""Neighbouring pieces whose widths differ by more than this factor lead to something narrow."""


def narrow(breaks: Array, longest: float, adaptive: bool) -> Array:
    """Places at narrow pieces: for steps that see their error where widths change, for fixed ones PARTS to a piece."""
    widths = np.diff(breaks)
    least, most = np.minimum(widths[1:], widths[:-1]), np.maximum(widths[1:], widths[:-1])
    uneven = most > GRADED * least
    if not adaptive:
        near = np.convolve(np.pad(uneven, 2), np.ones(4), "valid") > 0  # a change of width at most two pieces away
        chosen = np.flatnonzero(widths < longest * np.where(near, PARTS, 1.0))
        inside = breaks[chosen, None] + widths[chosen, None] * np.linspace(0.0, 1.0, PARTS + 1)
        return np.unique(np.concatenate([inside[:, 1:].ravel(), breaks[chosen]]))
    return breaks[1:-1][(least < NARROW * longest) & uneven]


def marks(law: Piecewise) -> Array:
    """Places on the elongation between which a force law is smooth and of one width.

    Pieces that get narrower towards a kink and the force with them, as those of max(t, 0)**1.5, are no places to stop.
    """
    breaks, coefficients, kinks = law
    widths, sizes = np.diff(breaks), np.abs(coefficients).sum(axis=1)
    fading = np.zeros(len(breaks), dtype=bool)
    for kink in np.searchsorted(breaks, kinks):
        for step, first in ((1, kink), (-1, kink - 1)):
            k = first
            while 0 <= k + step < len(widths) and widths[k + step] >= widths[k] and sizes[k + step] >= sizes[k]:
                k += step
                fading[k if step > 0 else k + 1] = True
    chosen = narrow(breaks, np.inf, True)
    return np.union1d(kinks, chosen[~fading[np.searchsorted(breaks, chosen)]])
