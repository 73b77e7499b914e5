"""Functions of one number fitted by piecewise polynomials that interpolate in Chebyshev points.

Trefethen, Approximation Theory and Practice, 2013, ch. 2 to 4. A function is sampled in extended precision where the
machine has it, so that three derivatives of a smooth function are good to nearly all digits. Samples may miss what is
short: of an expression, the places where it jumps or has a kink are known (`branches`), and between them no piece is
accepted before interval arithmetic bounds what its interpolation leaves out (`enclosure`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import lru_cache, partial
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from shoal.errors import InputError
from shoal.mechanics.functions import ORDER, Piecewise, value
from shoal.mechanics.narrow import marks
from shoal.mechanics.numerics.tile import Array
from shoal.scene import Function, formula
from shoal.scene.branches import branches
from shoal.scene.enclosure import at as derivative_at
from shoal.scene.enclosure import enclose
from shoal.scene.function import Composed

_SMALLEST = 1e-9
"""Width, as a fraction of the range, at which bisecting ends where nothing is proven."""

_CERTAIN = 1e-11
"""Proven bound on the error of a piece, relative to the function's size."""

_JUMP = 1e-9
"""Change at once [m or rad] of a prescribed position, also relative to it, that is rounding and no jump."""

_NOTHING = 1e-13
"""Beside a root such as sqrt(t) at 0 no bound holds; there a piece may vary over its width by so much of the function's
size times the range. Pieces this short need not be bisected further, unless the function has no bound."""

_BESIDE = 1e-6
"""How near that is, as a fraction of the range."""

_CANCELLED, _SHORT = 1e-14, 1 / 16
"""What is as good as this, relative to the function's size, is good enough for pieces as short as that."""

_MOST_PIECES = 2**17
"""Pieces looked at in all, of which about half are kept: a bound on time and memory."""

_AT_ONCE = 512
"""Intervals of which bounds are computed at once; they then stay in the cache of the processor."""

_CROWD, _TRIED, _MOST_OF = 2**10, 64, 0.6
"""From so many pieces on, so many of the shortest that the bound allows are tried before all the others; where they
fail on that part of the range, halving the rest would go beyond the bound."""

_BEGINNING = 1e-9
"""No function of time has its first kink so early [s], or else it goes on behind it."""

_LAW = 100.0
"""A force law is fitted as one for elongations up to so many metres or radians, where that leaves its digits."""
_DECADES = 0.7 * 10.0 ** np.arange(-9, 4)
"""Elongations between which it is met to as many digits as its values there have, whatever they are beyond."""
_DIGITS = 1e-6
"""To this part of its value a force law is met at any elongation, where it is fitted as one."""
_STEEPEST = 1.3
"""Between elongations of this ratio it is taken as it is fitted, and ends where it cannot be fitted."""
_ENDLESS = 1e300

Extended = npt.NDArray[Any]


def _angles(number: int) -> Extended:
    """Angles of the Chebyshev points cos(angle) of the first kind: never the ends, where a function may jump."""
    return np.asarray(np.arccos(np.longdouble(-1.0)) * (np.arange(number) + 0.5) / number)


_SIZE = ORDER - 1
_CHECKS = np.cos(_angles(3 * _SIZE))
"""Where a piece is looked at; every third from the second on is a node of the interpolation."""
_TO_SERIES = np.cos(np.outer(np.arange(_SIZE), _angles(_SIZE))) * (2.0 / np.longdouble(_SIZE))
_TO_SERIES[0] /= 2.0
_AT_CHECKS = np.cos(np.outer(_angles(3 * _SIZE), np.arange(_SIZE)))
_TO_POWERS = np.zeros((_SIZE, ORDER), dtype=np.longdouble)
for _k in range(_SIZE):
    _TO_POWERS[_k, : _k + 1] = np.polynomial.chebyshev.cheb2poly(np.eye(_SIZE)[_k])[: _k + 1]


class _SmoothInterval(NamedTuple):
    """Intervals (intervals,) on which a function is the smooth tree `node`, or smooth as its knots promise."""

    function: Callable[[Any], Any]
    node: formula.Node | None
    lower: Array
    upper: Array


def fit(
    function: Callable[[Any], Any],
    horizon: float,
    knots: Sequence[float] = (),
    *,
    begin: float = 0.0,
    steep: bool = True,
) -> Piecewise:
    """A function on [begin, horizon], bisected until it is met to about as many digits as its values have.

    `function` takes and returns arrays; the smooth parts of an expression (a scene's `Function`) are found here, any
    other is to be smooth between its knots. steep: whether it may have a slope without bound, as sqrt(t) at 0. Raises
    InputError where it is not finite, has no bound or varies too fast.
    """
    try:
        return _fit(function, float(horizon), tuple(knots), float(begin), steep)
    except TypeError:  # numbers that differ from lane to lane are not hashable
        return _fit.__wrapped__(function, float(horizon), tuple(knots), float(begin), steep)


@lru_cache(maxsize=128)
def _fit(
    function: Callable[[Any], Any], horizon: float, knots: tuple[float, ...], begin: float, steep: bool
) -> Piecewise:
    if not (np.isfinite([begin, horizon]).all() and begin < horizon):
        raise InputError(f"function: a range from {begin:g} to {horizon:g} is none")
    stretches, kinks = _stretches(function, begin, horizon, knots)
    inside = np.array([0.1, 0.5, 0.9])
    scale = max(
        float(np.abs(_sample(part.function, part.lower[:, None] + (part.upper - part.lower)[:, None] * inside)).max())
        for part in stretches
    )
    done: list[tuple[Array, Array]] = []
    for part in stretches:
        done += _bisected(part, begin, horizon, scale, steep)
    starts = np.concatenate([part for part, _ in done])
    order = np.argsort(starts)
    return Piecewise(np.append(starts[order], horizon), np.concatenate([part for _, part in done])[order], kinks)


def _stretches(
    function: Callable[[Any], Any], begin: float, horizon: float, knots: Sequence[float]
) -> tuple[list[_SmoothInterval], Array]:
    """Return the smooth stretches of a function, and the points between them."""
    if (node := getattr(function, "formula", None)) is not None:
        pieces = branches(node, begin, horizon)
        found = [
            _SmoothInterval(partial(formula.value, part), part, pieces.edges[numbers], pieces.edges[numbers + 1])
            for part, numbers in pieces.groups().items()
        ]
        return found, pieces.edges[1:-1]
    edges = np.unique(np.array([begin, *(knot for knot in knots if begin < knot < horizon), horizon], dtype=float))
    return [_SmoothInterval(function, None, edges[:-1], edges[1:])], edges[1:-1]


def _bisected(
    part: _SmoothInterval, begin: float, horizon: float, scale: float, steep: bool
) -> list[tuple[Array, Array]]:
    """Left ends and powers of the pieces of one stretch; scale: size of the function, as far as it is known."""
    function, node, lower, upper = part
    whole = horizon - begin
    done: list[tuple[Array, Array]] = []
    pieces = 0
    while lower.size:
        pieces += lower.size
        if pieces > _MOST_PIECES:
            raise _too_fast(begin, horizon, lower)
        middle, width = (lower + upper) / 2, upper - lower
        series, error, size, noise, digits = _interpolated(function, lower, upper)
        scale = max(scale, float(size.max()))
        tolerance = 16.0 * digits * scale + 2.0 * noise
        # Terms that cancel leave their own round-off, which shorter pieces cannot lessen.
        cancelled = (error > tolerance) & (error <= _CANCELLED * scale) & (width <= _SHORT * whole)
        tolerance, noise = np.where(cancelled, error, tolerance), np.where(cancelled, error, noise)
        good = error <= tolerance
        rough = np.zeros_like(good)
        if node is not None:
            sampled, proven = good.copy(), np.maximum(_CERTAIN * scale, 4.0 * tolerance)
            good[good] = _bounds(node, lower[good], upper[good])[0] <= proven[good]
            # Beside a root nothing is proven but that what is left is little.
            narrow = ~good & (width <= _BESIDE * whole)
            rough[narrow] = _bounds(node, lower[narrow], upper[narrow])[1] * width[narrow] <= _NOTHING * scale * whole
            good |= rough & sampled
            rough &= ~sampled & steep
        if lower.size >= _CROWD and not good.all():
            # A function that fails at most places in the shortest pieces that the bound allows will not be met.
            few = lower[~good][:: max(1, np.count_nonzero(~good) // _TRIED)]
            _, off, _, about, _ = _interpolated(function, few, few + 2 * whole / _MOST_PIECES)
            failing = np.mean(off > np.maximum(16.0 * digits * scale + 2.0 * about, _CANCELLED * scale))
            if failing * np.sum(width[~good]) > _MOST_OF * whole:
                raise _too_fast(begin, horizon, lower)
        smallest = ~good & ~rough & (width <= (_SMALLEST if node is None else _NOTHING) * whole)
        if node is not None and smallest.any():
            raise _too_fast(begin, horizon, lower[smallest])
        rough |= smallest
        # What is only noise in the last coefficients would grow in the derivatives.
        tail = np.cumsum(np.abs(series[:, ::-1]), axis=1)[:, ::-1]
        series[tail <= (4.0 * digits * size + noise)[:, None]] = 0.0
        powers = series @ _TO_POWERS
        if rough.any():
            ends = _sample(function, np.stack([lower[rough], upper[rough]], axis=1))
            powers[rough] = 0.0
            powers[rough, 0], powers[rough, 1] = ends.mean(axis=1), (ends[:, 1] - ends[:, 0]) / 2
        ready = good | rough
        done.append((lower[ready], powers[ready].astype(float)))
        lower, middle, upper = lower[~ready], middle[~ready], upper[~ready]
        lower, upper = np.concatenate([lower, middle]), np.concatenate([middle, upper])
    return done


def _bounds(node: formula.Node, lower: Array, upper: Array) -> tuple[Array, Array]:
    """Bound the interpolation error of a smooth tree on each interval, and the range of its values.

    Trefethen, theorem 7.1 and exercise 7.1: in n Chebyshev points the error is below |f^(n)|/n! / 2^(n - 1).
    """
    error, apart = np.full(lower.size, np.inf), np.full(lower.size, np.inf)
    for some in (slice(k, k + _AT_ONCE) for k in range(0, lower.size, _AT_ONCE)):
        low, high = enclose(node, lower[some], upper[some], _SIZE)
        error[some] = np.maximum(np.abs(low[-1]), np.abs(high[-1])) / 2.0 ** (_SIZE - 1)
        apart[some] = high[0] - low[0]
    return np.where(np.isnan(error), np.inf, error), np.where(np.isnan(apart), np.inf, apart)


def _too_fast(begin: float, horizon: float, where: Array) -> InputError:
    place = float(np.min(where))
    return InputError(f"function: varies too fast or has no bound near {place:.7g}, between {begin:g} and {horizon:g}")


def _interpolated(
    function: Callable[[Any], Any], lower: Array, upper: Array
) -> tuple[Extended, Extended, Extended, Extended, Any]:
    """Interpolate each piece: Chebyshev series (pieces, ORDER - 1), its error, largest value and noise (pieces,).

    The last is the relative precision of the values.
    """
    half = (upper - lower) / 2
    values = _sample(function, ((lower + upper) / 2)[:, None] + half[:, None] * _CHECKS)
    digits = np.finfo(values.dtype).eps
    series = values[:, 1::3] @ _TO_SERIES.T
    error = np.abs(series @ _AT_CHECKS.T - values).max(axis=1)
    # A function's values cannot be better than its argument, which is rounded too.
    steepest = np.abs(np.diff(values) / np.diff(_CHECKS)).max(axis=1) / half
    noise = digits * np.maximum(np.abs(lower), np.abs(upper)) * steepest
    return series, error, np.abs(values).max(axis=1), noise, digits


def _sample(function: Callable[[Any], Any], points: Extended) -> Extended:
    values = np.broadcast_to(np.asarray(function(points.ravel())), points.size).reshape(points.shape)
    if values.dtype not in (np.dtype(np.float64), np.dtype(np.longdouble)):
        values = values.astype(np.float64)
    finite = np.abs(values) <= np.finfo(np.float64).max
    if not finite.all():
        raise InputError(f"function: has no finite value at {float(points[~finite][0]):g}")
    return values


def fit_law(elastic: Function) -> Piecewise:
    """The force of a spring as a function of its elongation [m or rad], as far as it has finite values; see `fit`.

    A law that is large somewhere leaves but round-off where it is small, and is fitted decade by decade then. Its kinks
    are the places that no step may leap over. Raises InputError.
    """
    places, known = None, None
    with suppress(InputError):
        whole = fit(elastic, _LAW, elastic.knots, begin=-_LAW)
        places = marks(whole)
        everywhere = np.outer([-4.7, -2.2, -1.0, 1.0, 2.2, 4.7], _DECADES[_DECADES < _LAW / 5]).ravel()
        known = whole if _has_digits(whole, elastic, everywhere) else None
    parts = _outwards(elastic, _innermost(elastic) if known is None else known)
    breaks = np.concatenate([parts[0].breaks[:1], *(part.breaks[1:] for part in parts)])
    kinks = np.concatenate([part.kinks for part in parts]) if places is None else places
    return Piecewise(breaks, np.concatenate([part.coefficients for part in parts]), kinks)


def _innermost(elastic: Function) -> Piecewise:
    """Fit a force law at the smallest elongations at which it exceeds round-off."""
    for least in _DECADES[:-1]:
        with suppress(InputError):
            return fit(elastic, least, elastic.knots, begin=-least)
    return fit(elastic, _DECADES[-1], elastic.knots, begin=-_DECADES[-1])


def _outwards(elastic: Function, middle: Piecewise) -> list[Piecewise]:
    """Fit a force law outwards, from its fit about zero to its end, in order."""
    parts, end = [middle], float(middle.breaks[-1])
    edges = [end, *_DECADES[end < _DECADES].tolist()]
    for side in (-1.0, 1.0):
        ahead = [(side * near, side * far) for near, far in pairwise(edges)]
        while ahead:
            near, far = ahead.pop(0)
            part = None
            with suppress(InputError):
                part = fit(elastic, max(near, far), elastic.knots, begin=min(near, far))
            narrow = far / near < _STEEPEST
            if part is None and narrow:
                break
            if part is None or not (narrow or _has_digits(part, elastic, np.linspace(near, far, 4)[:-1])):
                half = np.sqrt(near / far) * far
                ahead = [(near, half), (half, far), *ahead]
                continue
            parts = [part, *parts] if side < 0 else [*parts, part]
    return parts


def _has_digits(law: Piecewise, elastic: Function, at: Array) -> bool:
    """Return whether a fit has the required digits of a law at these elongations."""
    wanted = np.asarray(elastic(at.astype(np.longdouble)), dtype=float)
    found = np.array([value(law, float(x)) for x in at])
    return bool(np.all(np.abs(found - wanted) <= _DIGITS * np.abs(wanted)))


def ended(law: Piecewise) -> Piecewise:
    """A force law or its energy that has no value beyond the range where it is known."""
    none = np.full((1, ORDER), np.nan)
    breaks = np.concatenate([[-_ENDLESS], law.breaks, [_ENDLESS]])
    return Piecewise(breaks, np.concatenate([none, law.coefficients, none]), law.kinks)


def start_value(function: Function | Composed) -> float:
    """A function of time at t = 0, or its limit from the right there. Raises InputError."""
    with np.errstate(divide="ignore", invalid="ignore"):
        found = float(function(np.zeros(1))[0])
    return found if np.isfinite(found) else value(fit(function, _BEGINNING, function.knots), 0.0)  # such as sin(t)/t


def start_slope(function: Function | Composed) -> float:
    """The derivative of a function of time at t = 0, on its right side. Raises InputError."""
    slope = _at_start(function, 1)
    return slope if np.isfinite(slope) else value(fit(function, _BEGINNING, function.knots), 0.0, 1)


def start_bend(function: Function | Composed) -> float:
    """The second derivative of a function of time at t = 0, on its right side; 0 where its formula has none there."""
    bend = 2.0 * _at_start(function, 2)
    return bend if np.isfinite(bend) else 0.0


def _at_start(function: Function | Composed, order: int) -> float:
    """A Taylor coefficient of a function of time at t = 0, on its right side; nan where its formula has none."""
    stated, operations = (function.function, function.operations) if isinstance(function, Composed) else (function, ())
    if stated.number is not None:
        return 0.0
    node = stated.formula
    if node is None:  # a table
        slope = formula.make("*", stated.table_slope(0.0, left=False), "t")
        bend = formula.make("*", 0.5 * stated.table_bend(0.0), formula.make("*", "t", "t"))
        node = formula.make("+", float(stated(np.zeros(1))[0]), formula.make("+", slope, bend))
    for operation in operations:
        node = formula.make(operation, node)
    low, high = derivative_at(branches(node, 0.0, _BEGINNING).nodes[0], np.zeros(1), order)
    return float(low[order, 0] + high[order, 0]) / 2


def require_no_jump(function: Function, horizon: float) -> None:
    """Raises InputError where a position that a function of time prescribes would jump."""
    if (node := function.formula) is None:
        return
    pieces = branches(node, 0.0, horizon)
    for t, left, right in zip(pieces.edges[1:-1].tolist(), pieces.nodes[:-1], pieces.nodes[1:], strict=True):
        before, after = float(formula.value(left, t)), float(formula.value(right, t))
        if abs(after - before) > _JUMP * (1.0 + abs(before)):
            raise InputError(
                f"function: jumps from {before:.7g} to {after:.7g} at t = {t:.7g}, which no body can follow; use ramp()"
            )


def require_positive(function: Function, horizon: float) -> None:
    """Raises InputError where a length that a function of time prescribes vanishes: no direction is left there."""
    breaks, powers, _ = fit(function, horizon, function.knots, steep=False)
    within = np.linspace(-1.0, 1.0, 4 * ORDER + 1)
    values = np.polynomial.polynomial.polyval(within, powers.T)
    times = breaks[:-1, None] + np.diff(breaks)[:, None] * (1.0 + within) / 2.0
    if np.any(gone := values <= 0.0):
        raise InputError(
            f"function: a length must stay above 0 m, but is {values[gone][0]:.4g} at t = {times[gone][0]:.4g}"
        )


def antiderivative(piecewise: Piecewise) -> Piecewise:
    """The integral from 0 (or from the end of the range nearest to 0) of a fitted function."""
    breaks, coefficients, kinks = piecewise
    half = np.diff(breaks)[:, None] / 2
    powers = np.zeros_like(coefficients)
    powers[:, 1:] = half * coefficients[:, :-1] / np.arange(1, ORDER)
    signs = (-1.0) ** np.arange(ORDER)
    powers[:, 0] = -(powers @ signs)
    # From zero outwards: what lies far out may be so large that nothing near zero would be left of its digits.
    each = powers.sum(axis=1)
    middle = int(np.clip(np.searchsorted(breaks, 0.0, side="right") - 1, 0, len(powers) - 1))
    inner = value(Piecewise(breaks[middle : middle + 2], powers[middle : middle + 1], kinks), 0.0)
    powers[middle:, 0] += np.concatenate([np.zeros(1), np.cumsum(each[middle:-1])]) - inner
    powers[:middle, 0] -= np.cumsum(each[:middle][::-1])[::-1] + inner
    return Piecewise(breaks, powers, kinks)
