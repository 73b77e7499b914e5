"""Drawings on paper: what a still or a moving picture draws of a machine, in the order of its layers."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon

from shoal.pictures.machine.bodies import ribbon
from shoal.pictures.machine.drawing import ALWAYS, FINE
from shoal.pictures.motion import DrawnMotion
from shoal.pictures.style import LOOKS
from shoal.trajectory import Array

_WIDTH = 480.0
"""Of what a picture shows of a machine [1/96 inch]."""
_POINTS = 0.75
"""Points of a typesetter in 1/96 inch."""


@dataclass(frozen=True)
class Stroke:
    """Lines of one look; path: of a frame [m], (points, 2), nan between lines."""

    look: dict[str, Any]
    path: Callable[[int], Array]
    still: bool


def is_fine(found: DrawnMotion) -> bool:
    """Return whether symbols are large enough to be drawn on paper."""
    return found.drawing.unit * _WIDTH >= FINE * max(found.size, 1e-300)


def strokes(found: DrawnMotion) -> list[Stroke]:
    """Return all strokes of a motion in the plane or on paper, the lowest layer first."""
    fine, drawing = is_fine(found), found.drawing
    shown = [
        Stroke(LOOKS[one.look], _at(found, one), drawing.stands_still(one))
        for one in drawing.symbols
        if fine or one.look in ALWAYS
    ]
    for name, half in found.half.items():
        outline = found.outlines[name]
        shown.append(Stroke(LOOKS["body"], _strip(outline, half), still=False))
    return sorted(shown, key=lambda stroke: float(stroke.look["layer"]))


def _at(found: DrawnMotion, symbol: Any) -> Callable[[int], Array]:
    return lambda k: found.drawing.path(symbol, k)


def _strip(outline: Array, half: Array) -> Callable[[int], Array]:
    return lambda k: ribbon(outline[k : k + 1], half)[0]


def pieces(path: Array) -> Iterator[Array]:
    """Yield the lines between gaps."""
    gaps = np.flatnonzero(np.isnan(path[:, 0]))
    for part in np.split(path, gaps):
        kept = part[np.isfinite(part[:, 0])]
        if len(kept) > 1:
            yield kept


def _seen(stroke: Stroke, frame: int) -> list[Array]:
    """Return the lines of a stroke; of a solid those faces that are seen from outside, else a point."""
    lines = list(pieces(stroke.path(frame)))
    if not stroke.look.get("solid"):
        return lines
    return [line if _area(line) > 0 else line[:1].repeat(3, axis=0) for line in lines]


def _area(line: Array) -> float:
    x, y = line.T
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def put(axes: Axes, stroke: Stroke, frame: int, alpha: float = 1.0) -> list[Artist]:
    """Draw a stroke of a frame and return its artists, one for each line."""
    look = stroke.look
    width, order = _POINTS * float(look["width"]), 2.0 + 0.1 * float(look["layer"])
    made: list[Artist] = []
    for line in _seen(stroke, frame):
        one: Artist
        if look["fill"] is None:
            one = Line2D(*line.T, color=look["edge"], linewidth=width, alpha=alpha, zorder=order)
            axes.add_line(one)
        else:
            colours = {"facecolor": look["fill"], "edgecolor": look["edge"]}
            one = Polygon(line, **colours, linewidth=width, alpha=alpha, zorder=order)
            axes.add_patch(one)
        made.append(one)
    return made


def move(artists: list[Artist], stroke: Stroke, frame: int) -> None:
    """Let the artists of a stroke show another frame."""
    for one, line in zip(artists, _seen(stroke, frame), strict=True):
        if isinstance(one, Polygon):
            one.set_xy(line)
        elif isinstance(one, Line2D):
            one.set_data(*line.T)
