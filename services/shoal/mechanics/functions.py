"""Functions of one number as piecewise polynomials: one kernel for formulas, tables and force laws.

A piece is stored as powers of the local coordinate s in [-1, 1]; `fitting` finds the pieces.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.mechanics.numerics.tile import Array, Index

ORDER = 16
"""Stored coefficients of a piece; `fitting` leaves the last one zero, so that the antiderivative has room."""


class Piecewise(NamedTuple):
    """One function: increasing breaks (pieces + 1,) and the powers 1, s, s^2, ... of each piece (pieces, ORDER).

    kinks: those of the breaks at which the function or one of its derivatives jumps.
    """

    breaks: Array
    coefficients: Array
    kinks: Array


class Functions(NamedTuple):
    """Functions back to back: pieces start[k] to start[k+1] with breaks from start[k] + k on belong to function k."""

    size: int
    start: Index
    breaks: Array
    coefficients: Array


def value(piecewise: Piecewise, at: float, derivative: int = 0) -> float:
    """One function at one place, for use outside kernels."""
    return float(evaluate(pack([piecewise]), 0, float(at), derivative))


def pack(fitted: Sequence[Piecewise]) -> Functions:
    """Many functions back to back, numbered in order."""
    start = np.cumsum([0, *(len(one.coefficients) for one in fitted)], dtype=np.int64)
    breaks = np.concatenate([np.zeros(0), *(one.breaks for one in fitted)])
    coefficients = np.concatenate([np.zeros((0, ORDER)), *(one.coefficients for one in fitted)])
    return Functions(len(fitted), start, breaks, coefficients.ravel())


@njit(cache=True, error_model="numpy")
def evaluate(functions: Functions, number: int, t: float, derivative: int) -> float:
    """The derivative 0 to 3 of a function at t; number -1 is the zero function. Pointers (or arrays).

    Beyond the range the value at its end holds. A billionth of the range past an end still counts as that
    end for the derivatives: the last step of a simulation may miss the horizon by rounding.
    """
    if number < 0:
        return 0.0
    piece, last = functions.start[number], functions.start[number + 1] - 1
    shift = number
    begin, end = functions.breaks[piece + shift], functions.breaks[last + 1 + shift]
    beyond = max(begin - t, t - end)
    if beyond > 0.0:
        if derivative > 0 and beyond > 1e-9 * (end - begin):
            return 0.0
        t = min(max(t, begin), end)
    while piece < last:
        middle = (piece + last + 1) // 2
        if t < functions.breaks[middle + shift]:
            last = middle - 1
        else:
            piece = middle
    left, right = functions.breaks[piece + shift], functions.breaks[piece + 1 + shift]
    inverse = 2.0 / (right - left)
    s = ((t - left) - (right - t)) / (right - left)
    total = 0.0
    for k in range(ORDER - 1, derivative - 1, -1):
        factor = 1.0
        for m in range(derivative):
            factor *= (k - m) * inverse
        total = total * s + factor * functions.coefficients[ORDER * piece + k]
    return total


@njit(cache=True, error_model="numpy")
def excess(functions: Functions, number: int, t: float) -> float:
    """Return the signed distance of t from the range of a function; 0 within it. Pointers (or arrays)."""
    if number < 0:
        return 0.0
    begin = functions.breaks[functions.start[number] + number]
    end = functions.breaks[functions.start[number + 1] + number]
    return max(t - end, 0.0) + min(t - begin, 0.0)  # type: ignore[no-any-return]
