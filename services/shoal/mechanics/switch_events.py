"""Switches of signals as events: steps end where an argument of abs, step, min or max changes its sign.

Within a step every switch is held, so that all stages see one smooth law. Where one could have turned, the signs are
compared with what is held at two places inside the step and at its end; the first root is bracketed on the dense
output, and the step is repeated up to there (Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I,
section II.6, driving a switch).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from shoal.mechanics import signals
from shoal.mechanics.derived import derive
from shoal.mechanics.dynamics import Work, instant
from shoal.mechanics.integrators.scheme import Scheme, interpolate
from shoal.mechanics.marched import LoopRoom
from shoal.mechanics.model import Arrays
from shoal.mechanics.numerics.tile import Tile
from shoal.mechanics.signals import Signals

NEVER = 2.0
PLACES = (0.5 - 0.5 / np.sqrt(5.0), 0.5 + 0.5 / np.sqrt(5.0), 1.0)
"""Where a step is looked at: the nodes of the Lobatto rule by which its power is counted, and the end."""
ITERATIONS = 60
FRACTION = 1e-14
"""Width of a bracket, as a part of the step, that is a root."""


@njit(cache=True, error_model="numpy")
def first(tile: Tile, s: Signals, scheme: Scheme, m: Arrays, w: Work, k: LoopRoom, t: float, taken: float) -> float:
    """Return the fraction of the last step at which the first switch turns, and mark it; NEVER if none does.

    t: beginning of the step [s]; taken: its length. Of one lane.
    """
    left, found = 0.0, NEVER
    _at(tile, s, scheme, m, w, k, t, 1.0, taken)
    if signals.is_far(tile, s, w):
        signals.learn(tile, s, w)
        return found
    for right in PLACES:
        _at(tile, s, scheme, m, w, k, t, right, taken)
        for number in range(s.switches):
            if not _over(tile, s, w, number) < -signals.SMALL * signals.largest(tile, s, w, number):
                continue
            root = _root(tile, s, scheme, m, w, k, t, left, right, taken, number)
            _at(tile, s, scheme, m, w, k, t, right, taken)
            if root < found:
                found = root
        if found <= 1.0:
            break
        left = right
    if found <= 1.0:
        # Those that turn together, such as both sides of a limit, are marked together.
        _at(tile, s, scheme, m, w, k, t, found, taken)
        for number in range(s.switches):
            near = _over(tile, s, w, number) <= signals.SMALL * signals.largest(tile, s, w, number)
            signals.mark(tile, s, w, number, near)
    else:
        signals.learn(tile, s, w)
    return found


@njit(cache=True, error_model="numpy", forceinline=True)
def _over(tile: Tile, s: Signals, w: Work, number: int) -> float:
    """Return by how much a switch is over the margin at which it turns."""
    return signals.margin(tile, s, w, number) - signals.floor(tile, s, w, number)  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy")
def _at(
    tile: Tile, s: Signals, scheme: Scheme, m: Arrays, w: Work, k: LoopRoom, t: float, x: float, taken: float
) -> None:
    """Evaluate the signals at a fraction of the last step."""
    if x < 1.0:
        interpolate(tile, scheme, m, w, k.past, x, taken, k.q, k.v)
    else:
        for i in range(m.unknowns):
            k.q[i], k.v[i] = w.z[i], w.zdot[i]
    derive(tile, m.derived, k.q, m.unknowns, m.force_rows, False)
    derive(tile, m.derived, k.v, m.unknowns, m.force_rows, True)
    signals.evaluate(tile, s, m, w, instant(w, t + x * taken), k.q, k.v)


@njit(cache=True, error_model="numpy")
def _root(
    tile: Tile, s: Signals, scheme: Scheme, m: Arrays, w: Work, k: LoopRoom, t: float, left: float, right: float,
    taken: float, number: int,
) -> float:  # fmt: skip
    """Return the fraction at which a switch turns, by bisection and the secant in turn."""
    below = _over(tile, s, w, number)
    _at(tile, s, scheme, m, w, k, t, left, taken)
    above = max(_over(tile, s, w, number), 0.0)
    for iteration in range(ITERATIONS):
        if right - left <= FRACTION:
            break
        part = 0.5 if iteration % 3 == 2 else above / (above - below)
        x = left + min(max(part, 1e-3), 1.0 - 1e-3) * (right - left)
        _at(tile, s, scheme, m, w, k, t, x, taken)
        here = _over(tile, s, w, number)
        if here < 0.0:
            right, below = x, here
        else:
            left, above = x, here
    return right
