"""A motion on paper: the machine at a few instants over each other."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from shoal.pictures.contacts import mark_impacts
from shoal.pictures.motion import DrawnMotion
from shoal.pictures.strokes import colour_bar, is_fine, put, strokes
from shoal.pictures.style import BLACK, BLUE, GREY, LOOKS, ORANGE, VERMILION, canvas, headline, styled
from shoal.pictures.views import views

_POSES = 7
_FEW = 10
"""So many places on the ground have large marks."""
_BEFORE = 0.6
"""Strength of a machine before its last pose, in which its symbols are drawn."""
_EARLIER = [LOOKS[name] for name in ("block", "mass", "surface")]
"""Looks that are drawn of earlier poses too."""
_HALO = [withStroke(linewidth=3, foreground="white")]


@styled
def poses(found: DrawnMotion, title: str, way: str = "paths of the markers") -> Figure:
    """The machine at a few instants, the later the darker, the paths of its markers, and the measured places.

    A machine in space from the front, from above it, from its right, as on a drawing, and from a corner.
    way: what the lines of the markers are called
    """
    if found.up is None:
        figure, axes = canvas(1.4 + 5.6 * found.aspect)
        _draw(axes, found, way)
        axes.set_aspect("equal", adjustable="datalim")
        shown = axes
    else:
        figure, ((top, corner), (front, side)) = canvas(7.4, nrows=2, ncols=2)
        for axes, view in zip((front, top, side, corner), views(found.up), strict=True):
            seen = found.seen(view)
            _draw(axes, seen, way)
            _frame(axes, seen, 0.55 * found.size, view.name)
        shown = front
    colour_bar(figure, shown if found.up is None else corner, found)
    headline(figure, f"{title} ({found.note})" if found.note else title)
    figure.legend(*shown.get_legend_handles_labels(), loc="outside lower left", ncols=3)
    return figure


def _frame(axes: Axes, seen: DrawnMotion, half: float, name: str) -> None:
    """So wide [m] to each side that all views along an axis have one scale."""
    middle = np.mean(seen.box, axis=0)
    half = half if all(seen.labels) else 0.55 * seen.size
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlim(middle[0] - half, middle[0] + half)
    axes.set_ylim(middle[1] - half, middle[1] + half)
    axes.set_title(name, fontweight="normal")
    if not all(seen.labels):
        axes.set_xticks([])
        axes.set_yticks([])
        axes.spines[:].set_visible(False)


def _draw(axes: Axes, found: DrawnMotion, way: str) -> None:
    count = min(_POSES, len(found.times))
    chosen = np.linspace(0, len(found.times) - 1, count).round().astype(int)
    machine, fine = strokes(found), is_fine(found)
    drawn = found.drawing.parts() if fine else set()
    for number, k in enumerate(chosen):
        strength, last = min(1.0, 0.2 + 0.8 * number / max(count - 1, 1)), k == chosen[-1]
        for line in found.thin.values() if last else ():
            axes.plot(*line[k].T, color=GREY, alpha=strength, linewidth=0.7)
        for name, line in found.links.items():
            style = "--" if name in found.slack and found.slack[name][k] else "-"
            if name not in drawn:
                axes.plot(*line[k].T, style, color=GREY, alpha=strength, linewidth=0.7)
        for name, outline in found.outlines.items():
            if not (last and name in found.shaped):
                axes.plot(*outline[k].T, color=BLUE, alpha=_BEFORE * strength, linewidth=1.6, solid_capstyle="round")
        for stroke in machine:
            if last or (stroke.look in _EARLIER and not stroke.still):
                put(axes, stroke, k, 1.0 if last else _BEFORE * strength)
    size = 7 if len(found.ground) <= _FEW else 3
    if not fine:
        axes.plot(
            *found.ground.T, "s", color=GREY, markersize=size, label="ground" if len(found.ground) else "", zorder=3
        )
    for number, place in enumerate(found.measured.values()):
        axes.plot(*place.T, "o", color=BLACK, markersize=4, fillstyle="none", label="" if number else "measured")
    for number, path in enumerate(found.seats.values()):
        axes.plot(*path.T, color=VERMILION, linewidth=1.2, label="" if number else way)
    hit = [name for name, hits in found.struck.items() if len(hits)]
    for name in hit:
        label = "impact" if name == hit[0] else ""
        mark_impacts(axes, found.times, found.seats[name], found.struck[name], label)
    _names(axes, found)
    _directions(axes, found, chosen)
    axes.set_xlabel(found.labels[0])
    axes.set_ylabel(found.labels[1])


def _names(axes: Axes, found: DrawnMotion) -> None:
    """The names of the markers where they end; those in one place stand in one line."""
    low, high = found.box
    places: dict[tuple[int, ...], list[str]] = {}
    for name, path in found.seats.items():
        places.setdefault(tuple(np.round(50 * (path[-1] - low) / np.max(high - low)).astype(int)), []).append(name)
    for names in places.values():
        place = found.seats[names[0]][-1]
        axes.annotate(
            ", ".join(names), place, (6, 4), textcoords="offset points", fontweight="bold", path_effects=_HALO
        )


def _directions(axes: Axes, found: DrawnMotion, chosen: np.ndarray[tuple[int], np.dtype[np.int_]]) -> None:
    """Measured angles as short lines from their markers."""
    low, high = found.box
    length = 0.08 * float(np.max(high - low))
    for number, (marker, angle) in enumerate(found.directions.items()):
        for k in chosen:
            tip = found.seats[marker][k] + length * np.array([np.cos(angle[k]), np.sin(angle[k])])
            label = "measured direction" if number == 0 and k == chosen[0] else ""
            axes.plot(*np.stack([found.seats[marker][k], tip]).T, color=ORANGE, linewidth=2, label=label)
