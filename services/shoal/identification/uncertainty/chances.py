"""Tail probabilities of chi-square, F and Student's t, and their inverses, by scipy.special."""

from __future__ import annotations

import math

from scipy import special


def above_chi_square(freedom: float, x: float) -> float:
    """Return the probability that chi-square with given degrees of freedom is above x; 1 from x = 0 down."""
    return float(special.chdtrc(freedom, max(x, 0.0)))


def chi_square_above(freedom: float, chance: float) -> float:
    """Return the value that chi-square with given degrees of freedom is above with a probability."""
    return float(special.chdtri(freedom, chance))


def student_above(freedom: float, chance: float) -> float:
    """Return the value that Student's t with given degrees of freedom is above with a probability."""
    return -float(special.stdtrit(freedom, chance))


def above_f(count: float, freedom: float, ratio: float) -> float:
    """Return the probability that F with (count, freedom) degrees of freedom is above a ratio; 1 where it is not > 0.

    With infinite freedom F is chi-square over its degrees of freedom.
    """
    if not ratio > 0.0:
        return 1.0
    return (
        above_chi_square(count, count * ratio) if math.isinf(freedom) else float(special.fdtrc(count, freedom, ratio))
    )
