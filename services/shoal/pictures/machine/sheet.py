"""A sheet on which parts of a machine draw their symbols, once its motion is known."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from shoal.pictures.links import At
from shoal.pictures.machine.drawing import Carrier, Drawing, Symbol
from shoal.pictures.machine.marks import STILL, Motion
from shoal.pictures.style import LOOKS
from shoal.trajectory import Array

_SHARE, _OF_BODY, _MOST = 0.025, 0.3, 0.75
"""Largest unit of symbols over the longest side of the machine, and over an extent that this share of bodies exceed."""


class Sheet:
    """Symbols, with the paths of markers, the times of the motion [s] and the unit of symbols [m].

    down: the direction in which symbols stand on the ground, (d,)
    """

    def __init__(self, at: At, times: Array, unit: float, down: Array) -> None:
        self.at, self.times, self.unit, self.down = at, times, unit, down
        d = len(down)
        self.carriers: dict[str, Carrier] = {STILL: Carrier(np.zeros((1, d)), np.eye(d)[None])}
        self._symbols: list[Symbol] = []

    def add(
        self, part: str, look: str, lines: Array, by: str = STILL, carrier: Carrier | None = None, *, at: Any = 0.0
    ) -> None:
        """Draw lines about a place on a carrier, (points, k); one of a name is kept for all that it carries."""
        if carrier is not None:
            self.carriers.setdefault(by, carrier)
        self._symbols.append(Symbol(part, look, by, lines, at + np.zeros(lines.shape[1])))

    def carrier(self, frame: tuple[str, Array, Motion]) -> Carrier:
        """Return what carries a place; frame: of `Marks.frame`."""
        by, _, moves = frame
        if by not in self.carriers:
            self.carriers[by] = moves(self.at, self.times)
        return self.carriers[by]

    def carried(self, part: str, look: str, lines: Array, frame: tuple[str, Array, Motion]) -> None:
        """Draw lines about a place of a body; frame: of `Marks.frame`."""
        self.carrier(frame)
        self._symbols.append(Symbol(part, look, frame[0], lines, frame[1]))

    @property
    def drawing(self) -> Drawing:
        """The drawing so far, the lowest layer first."""
        ordered = sorted(self._symbols, key=lambda symbol: float(LOOKS[symbol.look]["layer"]))
        return Drawing(tuple(ordered), self.carriers, self.unit)


Part = Callable[[Sheet], None]
"""Draws one part of the machine."""


def unit_of(size: float, extents: Iterable[float]) -> float:
    """Return the unit of symbols [m], so that they neither cover a machine nor are lost in it.

    size: longest side of the machine [m]; extents: largest distances of places of each body [m]
    """
    found = [extent for extent in extents if extent > 1e-6 * size]
    return min(_SHARE * size, _OF_BODY * float(np.quantile(found, 1.0 - _MOST)) if found else size)


def turned(lines: Array, angle: float) -> Array:
    """Return lines of the plane turned by an angle [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(lines @ np.array([[c, s], [-s, c]]))


def facing(lines: Array, way: Array) -> Array:
    """Return lines of the plane turned so that their x axis points along a way."""
    return turned(lines, float(np.arctan2(way[1], way[0])))
