"""The cubic curve of an element inside kernels, in plane or space: by D = (r2 - r1)/L and the slopes r1', r2'."""

from __future__ import annotations

from numba import njit

from shoal.compile.tuples import plus, times


@njit(error_model="numpy", forceinline=True)
def _factors(x):  # type: ignore[no-untyped-def]
    """Return the factors of D, r1' and r2' in r' and in L r''."""
    return (
        6.0 * x * (1.0 - x),
        1.0 - 4.0 * x + 3.0 * x * x,
        3.0 * x * x - 2.0 * x,
        6.0 - 12.0 * x,
        6.0 * x - 4.0,
        6.0 * x - 2.0,
    )


@njit(error_model="numpy", forceinline=True)
def curve(x, chord, s1, s2):  # type: ignore[no-untyped-def]
    """r' and L r'' at the fraction x."""
    a, b, c, d, e, f = _factors(x)
    return plus(plus(times(a, chord), b, s1), c, s2), plus(plus(times(d, chord), e, s1), f, s2)


@njit(error_model="numpy", forceinline=True)
def collect(x, p, c, g, g1, g2):  # type: ignore[no-untyped-def]
    """Add to the derivatives g, g1, g2 by D, r1' and r2' those of a point: p by r', c by L r''."""
    i, j, k, m, n, o = _factors(x)
    return plus(plus(g, i, p), m, c), plus(plus(g1, j, p), n, c), plus(plus(g2, k, p), o, c)
