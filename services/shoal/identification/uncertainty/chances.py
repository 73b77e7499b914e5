"""Chances by chi-square and Student's t. scipy.special has them too, and takes a fifth of a second to import.

Abramowitz and Stegun, Handbook of Mathematical Functions, 1964, 6.5 and 26.4 to 26.7; the continued fractions by the
modified method of Lentz (Thompson and Barnett, J. Comput. Phys. 64, 1986, 490-509).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache
from itertools import count

_SAME = 1e-16
_TINY = 1e-300
_LARGE = 16.0
"""From here on the logarithm of the gamma function is taken from its series: differences of it lose digits."""
_MANY = 1e3
"""Degrees of freedom from which on four terms beyond the normal distribution are Student's to all digits."""
_ITERATIONS = 100


def above_chi_square(freedom: float, x: float) -> float:
    """Chance that chi-square with so many degrees of freedom is above x."""
    a, x = 0.5 * freedom, 0.5 * x
    if not x > 0.0:
        return 1.0 if x <= 0.0 else math.nan
    if x == math.inf:
        return 0.0
    if x < a + 1.0:
        term, total = 1.0, 1.0
        for n in count(1):
            term *= x / (a + n)
            total += term
            if term < _SAME * total:
                return 1.0 - _power(a, x) * total
    parts = ((-n * (n - a), x + 2 * n + 1 - a) for n in count(1))
    return _power(a, x) * a / _fraction(x + 1.0 - a, parts)


def chi_square_above(freedom: float, chance: float) -> float:
    """What chi-square with so many degrees of freedom is above with a chance, at most that for its mean."""
    x = freedom
    for _ in range(_ITERATIONS):  # of Newton, upwards to where the convex tail ends
        step = (above_chi_square(freedom, x) - chance) / (0.5 * freedom * _power(0.5 * freedom, 0.5 * x) / x)
        x += step
        if abs(step) <= 4.0 * _SAME * x:
            break
    return x


@lru_cache(maxsize=1024)
def student_above(freedom: float, chance: float) -> float:
    """What Student's t with so many degrees of freedom is above with a chance, below 0.15."""
    z = math.sqrt(chi_square_above(1.0, 2.0 * chance))
    if freedom >= _MANY:
        s = z * z
        terms = (
            (s + 1) / 4,
            (3 + s * (16 + 5 * s)) / 96,
            (-15 + s * (17 + s * (19 + 3 * s))) / 384,
            (-945 + s * (-1920 + s * (1482 + s * (776 + 79 * s)))) / 92160,
        )
        return z * (1.0 + sum(term / freedom**n for n, term in enumerate(terms, 1)))
    t = z
    for _ in range(_ITERATIONS):
        tail, density = _student(freedom, t)
        step = (tail - chance) / density
        t += step
        if abs(step) <= 4.0 * _SAME * t:
            break
    return t


def above_f(count: float, freedom: float, ratio: float) -> float:
    """Return the chance that F with (count, freedom) degrees of freedom is above a ratio; freedom may be infinite."""
    if not ratio > 0.0:
        return 1.0
    if math.isinf(freedom):
        return above_chi_square(count, count * ratio)
    total = freedom + count * ratio
    a, b, x, y = 0.5 * freedom, 0.5 * count, freedom / total, count * ratio / total  # x + y = 1, either may vanish
    log_beta = math.lgamma(a) + math.lgamma(b) - math.lgamma(a + b)
    power = math.exp(a * math.log(x) + b * math.log(y) - log_beta) if x * y > 0.0 else 0.0
    # Of the incomplete beta function, that side whose fraction converges.
    if x < (a + 1.0) / (a + b + 2.0):
        return power / a / _fraction(1.0, _beta(a, b, x))
    return 1.0 - power / b / _fraction(1.0, _beta(b, a, y))


def _student(freedom: float, t: float) -> tuple[float, float]:
    """Chance that Student's t is above t > 0, and its density there."""
    a, x = 0.5 * freedom, freedom / (freedom + t * t)
    power = math.exp(_half_step(a) - a * math.log1p(t * t / freedom)) / math.sqrt(math.pi)
    density = power * math.sqrt(x / freedom)
    # Of the incomplete beta function, that side whose fraction converges.
    if x < (a + 1.0) / (a + 2.5):
        return 0.5 * power * math.sqrt(1.0 - x) / a / _fraction(1.0, _beta(a, 0.5, x)), density
    return 0.5 - power * math.sqrt(1.0 - x) / _fraction(1.0, _beta(0.5, a, 1.0 - x)), density


def _beta(a: float, b: float, x: float) -> Iterator[tuple[float, float]]:
    """The partial numerators and denominators of the incomplete beta function's fraction."""
    for n in count():
        if n:
            yield n * (b - n) * x / ((a + 2 * n - 1) * (a + 2 * n)), 1.0
        yield -(a + n) * (a + b + n) * x / ((a + 2 * n) * (a + 2 * n + 1)), 1.0


def _fraction(first: float, parts: Iterator[tuple[float, float]]) -> float:
    """first + a1/(b1 + a2/(b2 + ...)) for parts (a, b)."""
    value = c = first or _TINY
    d = 0.0
    for above, below in parts:
        d = 1.0 / (below + above * d or _TINY)
        c = below + above / c or _TINY
        value *= c * d
        if abs(c * d - 1.0) < 2.0 * _SAME:
            break
    return value


def _power(a: float, x: float) -> float:
    """x^a e^-x / Gamma(a + 1)."""
    if a < _LARGE:
        return math.exp(a * math.log(x) - x - math.lgamma(a + 1.0))
    t = (x - a) / a
    s = 1.0 / (a * a)
    away = math.log1p(t) - t if t > -0.5 else math.log(x) - math.log(a) - t
    rest = (1 / 12 - s * (1 / 360 - s * (1 / 1260 - s * (1 / 1680 - s * (1 / 1188 - s * 691 / 360360))))) / a
    return math.exp(a * away - rest) / math.sqrt(2.0 * math.pi * a)


def _half_step(a: float) -> float:
    """log(Gamma(a + 1/2) / Gamma(a))."""
    if a < _LARGE:
        return math.lgamma(a + 0.5) - math.lgamma(a)
    s = 1.0 / (a * a)
    rest = (1 / 8 - s * (1 / 192 - s * (1 / 640 - s * (17 / 14336 - s * 31 / 18432)))) / a
    return 0.5 * math.log(a) - rest
