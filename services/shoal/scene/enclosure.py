"""Bounds on a smooth expression over an interval: Taylor coefficients in interval arithmetic.

Moore, Kearfott, Cloud, Introduction to Interval Analysis (2009), ch. 9. The coefficients of f in the local coordinate
(t - centre)/half, for every centre in the interval, lie between the two arrays (order + 1, intervals) of a pair. Every
operation is rounded outwards; what has no bound is nan or infinite.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from shoal.scene.formula import Node

Array = npt.NDArray[Any]
Pair = tuple[Array, Array]

_EPS = 2.0**-51
"""Twice the rounding of one operation, relative."""
_LIBRARY = 8.0
"""Functions of the mathematical library are trusted to so many times that."""
_FEW = 256
"""More intervals than this that hold a zero of a denominator are not looked at one by one; they are bisected first."""


class Span(NamedTuple):
    """Intervals and the unit of their local coordinate, (intervals,) each."""

    lower: Array
    upper: Array
    half: Array


def enclose(node: Node, lower: Array, upper: Array, order: int) -> Pair:
    """Bounds on the Taylor coefficients 0 to `order` of a tree over the intervals [lower, upper]."""
    lower, upper = np.asarray(lower, dtype=float), np.asarray(upper, dtype=float)
    with np.errstate(all="ignore"):
        return _enclose(node, Span(lower, upper, (upper - lower) / 2), order)


def at(node: Node, t: Array, order: int = 1) -> Pair:
    """Bounds on the Taylor coefficients f, f', f''/2, ... up to an order of a tree at points t (points,)."""
    t = np.asarray(t, dtype=float)
    with np.errstate(all="ignore"):
        return _enclose(node, Span(t, t, np.ones_like(t)), order)


def common_zero(above: Node, below: Node, t: float) -> bool:
    """Return whether both sides of a fraction vanish at t and the lower one has a slope there, so that there is no
    pole.

    Only what vanishes to the last bit counts, as t and sin(t) do at 0.
    """
    over, under = (at(node, np.array([t])) for node in (above, below))
    vanish = all(low[0, 0] == 0 == high[0, 0] for low, high in (over, under))
    return bool(vanish and (under[0][1, 0] > 0 or under[1][1, 0] < 0))


def _enclose(node: Node, span: Span, order: int) -> Pair:
    if not isinstance(node, tuple):
        low = np.zeros((order + 1, span.lower.size))
        low[0] = span.lower if node == "t" else node
        if node != "t":
            return low, low
        if order > 0:
            low[1] = span.half
        high = low.copy()
        high[0] = span.upper
        return low, high
    operation, *arguments = node
    if operation == "**":
        return _power(arguments[0], arguments[1], span, order)
    parts = [_enclose(argument, span, order) for argument in arguments]
    return _fraction(arguments, parts, span, order) if operation == "/" else _RULES[operation](*parts)


def _out(low: Array, high: Array, ulps: float = 1.0) -> Pair:
    """Rounded outwards; what is exactly zero stays so."""
    return low - ulps * _EPS * np.abs(low), high + ulps * _EPS * np.abs(high)


def _add(a: Pair, b: Pair) -> Pair:
    return _out(a[0] + b[0], a[1] + b[1])


def _neg(a: Pair) -> Pair:
    return -a[1], -a[0]


def _times(a: Pair, b: Pair) -> Pair:
    ll, lh, hl, hh = a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1]
    low, high = np.minimum(np.minimum(ll, lh), np.minimum(hl, hh)), np.maximum(np.maximum(ll, lh), np.maximum(hl, hh))
    return _out(low, high)


def _over(a: Pair, b: Pair) -> Pair:
    """a / b of single rows; nan where b may be 0."""
    sure = (b[0] > 0) | (b[1] < 0)
    return _times(a, _out(np.where(sure, 1.0 / b[1], np.nan), np.where(sure, 1.0 / b[0], np.nan)))


def _row(a: Pair, k: int) -> Pair:
    return a[0][k], a[1][k]


def _set(a: Pair, k: int, row: Pair) -> None:
    a[0][k], a[1][k] = row


def _room(like: Pair) -> Pair:
    return np.empty(like[0].shape), np.empty(like[0].shape)


def _sum(a: Pair, b: Pair, k: int, first: int = 0, last: int | None = None, weight: Array | None = None) -> Pair:
    """Sum of weight[j] a[j] b[k - j] for j from first to last, which is k if not said; weight (k + 1,)."""
    last = k if last is None else last
    j = np.arange(first, last + 1)
    low, high = _times((a[0][j], a[1][j]), (b[0][k - j], b[1][k - j]))
    if weight is not None:
        one, other = weight[j, None] * low, weight[j, None] * high
        low, high = np.minimum(one, other), np.maximum(one, other)
    slack = (len(j) + 1) * _EPS * np.maximum(np.abs(low), np.abs(high)).sum(axis=0)
    return low.sum(axis=0) - slack, high.sum(axis=0) + slack


def _share(k: int) -> Array:
    """Weights j/k of the chain rule."""
    return np.arange(k + 1) / max(k, 1)


def _product(a: Pair, b: Pair) -> Pair:
    out = _room(a)
    for k in range(len(a[0])):
        _set(out, k, _sum(a, b, k))
    return out


def _square(a: Pair) -> Pair:
    out = _product(a, a)
    _set(out, 0, _even(_row(a, 0)))
    return out


def _even(a: Pair) -> Pair:
    near = np.where((a[0] <= 0) & (a[1] >= 0), 0.0, np.minimum(np.abs(a[0]), np.abs(a[1])))
    far = np.maximum(np.abs(a[0]), np.abs(a[1]))
    return _out(near * near, far * far)


def _quotient(a: Pair, b: Pair) -> Pair:
    out = _room(a)
    for k in range(len(a[0])):
        _set(out, k, _over(_add(_row(a, k), _neg(_sum(b, out, k, 1))), _row(b, 0)))
    return out


def _fraction(arguments: list[Node], parts: list[Pair], span: Span, order: int) -> Pair:
    """A quotient. Where both sides vanish at an end of the interval, both are divided by the distance from it.

    Coefficient k of N(t) half/(t - t0), where N(t0) = 0, lies within the bounds of coefficient k + 1 of N.
    """
    out = _quotient(*parts)
    unsure = np.flatnonzero(~((parts[1][0][0] > 0) | (parts[1][1][0] < 0)))
    for k in unsure if unsure.size <= _FEW else ():
        here = Span(*(field[k : k + 1] for field in span))
        for end in (here.lower[0], here.upper[0]):
            if common_zero(arguments[0], arguments[1], end):
                sides = [_enclose(argument, here, order + 1) for argument in arguments]
                part = _quotient(*((low[1:], high[1:]) for low, high in sides))
                out[0][:, k], out[1][:, k] = part[0][:, 0], part[1][:, 0]
                break
    return out


def _power(base: Node, exponent: Node, span: Span, order: int) -> Pair:
    if isinstance(exponent, float) and exponent.is_integer() and abs(exponent) <= 64:
        power = _whole_power(_enclose(base, span, order), abs(int(exponent)))
        return power if exponent >= 0 else _quotient(_enclose(1.0, span, order), power)
    if not isinstance(exponent, float):
        return _exp(_product(_enclose(exponent, span, order), _log(_enclose(base, span, order))))
    u = _enclose(base, span, order)
    out = _room(u)
    low, high = np.maximum(u[0][0], 0.0) ** exponent, np.maximum(u[1][0], 0.0) ** exponent
    _set(out, 0, _out(np.minimum(low, high), np.maximum(low, high), _LIBRARY))
    for k in range(1, order + 1):
        weight = (exponent + 1.0) * _share(k) - 1.0
        _set(out, k, _over(_sum(u, out, k, 1, k, weight), _row(u, 0)))
    return out


def _whole_power(u: Pair, exponent: int) -> Pair:
    if exponent == 0:
        return _constant(1.0, u)
    if exponent == 1:
        return u
    half = _square(_whole_power(u, exponent // 2))
    return half if exponent % 2 == 0 else _product(half, u)


def _monotone(function: Callable[[Array], Array], u: Pair) -> Pair:
    """The range of an increasing function of the library over a row; exact where the argument is exactly 0."""
    low, high = function(u[0]), function(u[1])
    wide = _out(low, high, _LIBRARY)
    return np.where(u[0] == 0, low, wide[0]), np.where(u[1] == 0, high, wide[1])


def _exp(u: Pair) -> Pair:
    out = _room(u)
    _set(out, 0, _monotone(np.exp, _row(u, 0)))
    for k in range(1, len(u[0])):
        _set(out, k, _sum(u, out, k, 1, k, _share(k)))
    return out


def _log(u: Pair) -> Pair:
    out = _room(u)
    low, high = _row(u, 0)
    first = np.where(low > 0, np.log(low), -np.inf), np.log(high)
    _set(out, 0, _out(*first, _LIBRARY))
    for k in range(1, len(u[0])):
        _set(out, k, _over(_add(_row(u, k), _neg(_sum(out, u, k, 1, k - 1, _share(k)))), _row(u, 0)))
    return out


def _sqrt(u: Pair) -> Pair:
    out = _room(u)
    _set(out, 0, _out(np.sqrt(np.maximum(u[0][0], 0.0)), np.sqrt(u[1][0])))
    for k in range(1, len(u[0])):
        rest = _add(_row(u, k), _neg(_sum(out, out, k, 1, k - 1)))
        _set(out, k, _over(rest, (2 * out[0][0], 2 * out[1][0])))
    return out


def _wave(u: Pair, quarter: float) -> Pair:
    """The range of cos(u - quarter pi/2) over a row."""
    turn, shift = 2 * np.pi, quarter * np.pi / 2
    slack = 4 * _EPS * (np.abs(u[0]) + np.abs(u[1]) + 1.0)
    first, last = (u[0] - shift - slack) / turn, (u[1] - shift + slack) / turn
    function = np.sin if quarter == 1.0 else np.cos
    ends = function(u[0]), function(u[1])
    low, high = _out(np.minimum(*ends), np.maximum(*ends), _LIBRARY)
    exact = (u[0] == 0) & (u[1] == 0)
    low, high = np.where(exact, ends[0], low - slack * _EPS), np.where(exact, ends[0], high + slack * _EPS)
    low = np.where(~exact & (np.floor(last + 0.5) > np.floor(first + 0.5)), -1.0, np.maximum(low, -1.0))
    return low, np.where(~exact & (np.floor(last) > np.floor(first)), 1.0, np.minimum(high, 1.0))


def _waves(u: Pair) -> tuple[Pair, Pair]:
    sine, cosine = _room(u), _room(u)
    _set(sine, 0, _wave(_row(u, 0), 1.0))
    _set(cosine, 0, _wave(_row(u, 0), 0.0))
    for k in range(1, len(u[0])):
        _set(sine, k, _sum(u, cosine, k, 1, k, _share(k)))
        _set(cosine, k, _neg(_sum(u, sine, k, 1, k, _share(k))))
    return sine, cosine


def _tan(u: Pair) -> Pair:
    return _quotient(*_waves(u))


def _tanh(u: Pair) -> Pair:
    """With w = 1 - tanh^2, from itself and not by the difference: y' = w u', w' = -2 y w u'."""
    y, w, yw = _room(u), _room(u), _room(u)
    low, high = _row(u, 0)
    _set(y, 0, _monotone(np.tanh, (low, high)))
    near = np.where((low <= 0) & (high >= 0), 0.0, np.minimum(np.abs(low), np.abs(high)))
    decay = [np.exp(-2 * size) for size in (np.maximum(np.abs(low), np.abs(high)), near)]
    least, most = (4 * part / (1 + part) ** 2 for part in decay)
    _set(w, 0, _out(least, most, 4 * _LIBRARY))
    for k in range(1, len(u[0])):
        _set(yw, k - 1, _sum(y, w, k - 1))
        _set(y, k, _sum(u, w, k, 1, k, _share(k)))
        _set(w, k, _neg(_sum(u, yw, k, 1, k, 2 * _share(k))))
    return y


def _rise(u: Pair) -> Pair:
    six, fifteen, ten = (_constant(number, u) for number in (6.0, 15.0, 10.0))
    inner = _add(_product(u, _add(_product(six, u), _neg(fifteen))), ten)
    return _product(_product(_square(u), u), inner)


def _constant(number: float, like: Pair) -> Pair:
    row = np.zeros_like(like[0])
    row[0] = number
    return row, row


_RULES: dict[str, Callable[..., Pair]] = {
    "+": _add,
    "-": lambda a, b: _add(a, _neg(b)),
    "*": _product,
    "neg": _neg,
    "square": _square,
    "sin": lambda u: _waves(u)[0],
    "cos": lambda u: _waves(u)[1],
    "tan": _tan,
    "tanh": _tanh,
    "sqrt": _sqrt,
    "exp": _exp,
    "log": _log,
    "rise": _rise,
}
"""How coefficients follow from those of the arguments; what has kinks or jumps has been replaced by its branches."""
