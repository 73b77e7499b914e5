"""Drawings on paper: what a still or a moving picture draws of a machine, in the order of its layers."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon

from shoal.pictures.machine.bodies import ribbon
from shoal.pictures.machine.drawing import ALWAYS, FINE
from shoal.pictures.machine.stress import LEVELS
from shoal.pictures.motion import DrawnMotion
from shoal.pictures.style import DARK, LOOKS, PALE, STRESS, palette
from shoal.trajectory import Array

_WIDTH = 480.0
"""Of what a picture shows of a machine [1/96 inch]."""
_POINTS = 0.75
"""Points of a typesetter in 1/96 inch."""


@dataclass(frozen=True)
class Stroke:
    """Lines of one look; path: of a frame [m], (points, 2), nan between lines; tint: colour of a frame, of stress."""

    look: dict[str, Any]
    path: Callable[[int], Array]
    still: bool
    tint: Callable[[int], str] | None = None


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
    tinted = {} if found.stress is None else found.stress.values
    for name, half in found.half.items():
        if name not in tinted:
            shown.append(Stroke(LOOKS["body"], _strip(found.outlines[name], half), still=False))
    for name in tinted:
        shown += _tinted(found, name)
    return sorted(shown, key=lambda stroke: float(stroke.look["layer"]))


def _at(found: DrawnMotion, symbol: Any) -> Callable[[int], Array]:
    return lambda k: found.drawing.path(symbol, k)


def _strip(outline: Array, half: Array) -> Callable[[int], Array]:
    return lambda k: ribbon(outline[k : k + 1], half)[0]


def _tinted(found: DrawnMotion, name: str) -> Iterator[Stroke]:
    """Yield the parts of a rod between its points, coloured by their stress, and its edge; lines on paper of space."""
    assert found.stress is not None
    outline, levels, colours = found.outlines[name], found.stress.levels(name), palette(LEVELS)
    half = found.half.get(name)
    look = {"layer": 3.1, "edge": DARK, "width": 3.5 if half is None else 0.4, "fill": None if half is None else PALE}
    for part in range(outline.shape[1] - 1):
        ends = outline[:, part : part + 2]
        path = (lambda k, ends=ends: ends[k]) if half is None else _strip(ends, half[part : part + 2])
        tint = levels[:, part : part + 2].max(axis=1)
        yield Stroke(look, path, still=False, tint=lambda k, tint=tint: colours[tint[k]])  # type: ignore[misc]
    if half is not None:
        edge = {"layer": 3.2, "edge": DARK, "width": 1.0, "fill": None}
        yield Stroke(edge, _strip(outline, half), still=False)


def colour_bar(figure: Figure, axes: Axes, found: DrawnMotion) -> None:
    """Draw the scale of the colours, with its unit, beside some axes; nothing without stress."""
    if found.stress is not None:
        most, unit = found.stress.scale
        colours = ScalarMappable(Normalize(0.0, most or 1.0), ListedColormap(palette(LEVELS)))
        figure.colorbar(colours, ax=axes, label=f"{STRESS} [{unit}]", shrink=0.8, pad=0.02)


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
    tint = None if stroke.tint is None else stroke.tint(frame)
    for line in _seen(stroke, frame):
        one: Artist
        if look["fill"] is None:
            one = Line2D(*line.T, color=tint or look["edge"], linewidth=width, alpha=alpha, zorder=order)
            axes.add_line(one)
        else:
            inside, edge = tint or look["fill"], tint or look["edge"]
            one = Polygon(line, facecolor=inside, edgecolor=edge, linewidth=width, alpha=alpha, zorder=order)
            axes.add_patch(one)
        made.append(one)
    return made


def move(artists: list[Artist], stroke: Stroke, frame: int) -> None:
    """Let the artists of a stroke show another frame."""
    for one, line in zip(artists, _seen(stroke, frame), strict=True):
        if stroke.tint is not None:
            one.set(color=stroke.tint(frame))
        if isinstance(one, Polygon):
            one.set_xy(line)
        elif isinstance(one, Line2D):
            one.set_data(*line.T)
