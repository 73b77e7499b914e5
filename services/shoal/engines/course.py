"""Functions of time for engines that call them one instant at a time: exact branches, exact slopes, and their sides.

No polynomial is fitted here: the values are those of the formula or the table itself.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from shoal.mechanics import fitting
from shoal.mechanics.narrow import narrow
from shoal.scene import Function
from shoal.scene.branches import Branches, branches
from shoal.scene.enclosure import at
from shoal.scene.formula import Node, value
from shoal.trajectory import Array

SLOPE_JUMP = 1e-9
"""A slope that changes by less than this, or than this relative to itself, does not jump."""


_SOON = 1e-6
"""[s]"""


def slope_after(f: Function, t: float) -> float:
    """The derivative of a function on the right side of one instant [s]. Raises InputError where it has none."""
    if f.formula is None:
        return f.table_slope(t, left=False)
    return float(_bounded(branches(f.formula, t, t + _SOON).nodes[0], t)[1])


def _bounded(node: Node, t: float) -> Array:
    """Value and slope of a smooth tree by bounds as narrow as rounding."""
    low, high = at(node, np.array([t]))
    return np.asarray(low[:, 0] + high[:, 0]) / 2


@dataclass
class Clock:
    """The functions of time of one machine up to `horizon` [s].

    until: the last instant before the next of `halts` [s], at which steps end and a function may jump.
    """

    horizon: float
    step: float
    until: float = np.inf
    halts: Array = field(default_factory=lambda: np.zeros(0))

    def course(self, f: Function, *, held: bool = False) -> PiecewiseFunction:
        """A function to be called; held: it prescribes a position. Raises InputError where it has no value or jumps."""
        if held:
            fitting.require_no_jump(f, self.horizon)
        fitted = fitting.fit(f, self.horizon, f.knots, steep=not held)
        inside = np.concatenate([fitted.kinks, narrow(fitted.breaks, self.step, False)])
        self.halts = np.union1d(self.halts, inside)
        pieces = None if f.formula is None else branches(f.formula, 0.0, self.horizon)
        return PiecewiseFunction(f, self, pieces, fitted.kinks)


@dataclass(frozen=True)
class PiecewiseFunction:
    """A function of time that knows where it is smooth."""

    function: Function
    clock: Clock
    pieces: Branches | None
    kinks: Array

    def value(self, t: float) -> float:
        """The value at one instant [s], at a halt that of the step that is under way."""
        return float(self(np.array([min(t, self.clock.until)]))[0])

    def slope(self, t: float) -> float:
        """Its derivative there."""
        return self._slope(min(t, self.clock.until), left=False)

    def jumps(self) -> list[float]:
        """Return the instants at which its slope jumps [s]."""
        sides = [(t, self._slope(t, left=True), self._slope(t, left=False)) for t in self.kinks.tolist()]
        return [t for t, a, b in sides if abs(b - a) > SLOPE_JUMP * (1.0 + abs(a))]

    def _slope(self, t: float, left: bool) -> float:
        if self.pieces is not None:
            return float(_bounded(self.pieces.around(t, left), t)[1])
        return self.function.table_slope(t, left)

    def __call__(self, t: Array) -> Array:
        """Values at instants [s], on the right side of jumps; of the shape of t."""
        t = np.asarray(t, dtype=float)
        if self.pieces is None:
            return self.function(t)
        nodes = self.pieces.nodes
        which = np.clip(np.searchsorted(self.pieces.edges, t, side="right") - 1, 0, len(nodes) - 1)
        out = np.empty(t.shape)
        for number in np.unique(which):
            chosen: Any = which == number
            out[chosen] = value(nodes[number], t[chosen])
        if not np.all(known := np.isfinite(out)):
            # sin(t)/t at 0
            gaps = t[~known].tolist()
            out[~known] = [_bounded(self.pieces.around(gap, False), gap)[0] for gap in gaps]
        return out
