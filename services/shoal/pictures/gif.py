"""A motion as a small moving picture, for slides and messages."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from io import BytesIO
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from PIL import Image

from shoal.pictures.machine.stress import LEVELS
from shoal.pictures.motion import DrawnMotion
from shoal.pictures.strokes import colour_bar, is_fine, move, put, strokes
from shoal.pictures.style import (
    BLACK,
    BLUE,
    BROWN,
    GREEN,
    GREY,
    ORANGE,
    SKY,
    VERMILION,
    canvas,
    headline,
    palette,
    styled,
)
from shoal.pictures.views import views

_FRAMES = 60
_PAUSE_MS = 80
_SHADES = 12
"""Of each colour, from white on."""


@styled
def gif(found: DrawnMotion, title: str) -> bytes:
    """The motion as GIF of sixty frames, slowed down or sped up to about five seconds; in space from a corner."""
    found = found if found.up is None else found.seen(views(found.up)[-1])
    figure, moving, clock = _stage(found, title)
    drawing: Any = FigureCanvasAgg(figure)
    drawing.draw()
    figure.set_layout_engine("none")
    drawing.draw()
    still = drawing.copy_from_bbox(figure.bbox)
    images = []
    for k in np.linspace(0, len(found.times) - 1, _FRAMES).round().astype(int):
        # What stands still is drawn once.
        drawing.restore_region(still)
        for artists, shown_at in moving:
            shown_at(int(k))
            for artist in artists:
                figure.draw_artist(artist)
        clock.set_text(f"t = {found.times[k]:.3f} s")
        figure.draw_artist(clock)
        images.append(Image.fromarray(np.asarray(drawing.buffer_rgba())).convert("RGB"))
    palette = _palette()
    frames = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
    stream = BytesIO()
    frames[0].save(stream, "GIF", save_all=True, append_images=frames[1:], duration=_PAUSE_MS, loop=0)
    return stream.getvalue()


def _palette() -> Image.Image:
    """The colours that are drawn with and their way to white: one palette for all frames, so that nothing flickers."""
    shares = np.linspace(0.0, 1.0, _SHADES)
    colours = [np.array(to_rgb(name)) for name in (BLACK, GREY, BLUE, ORANGE, VERMILION, GREEN, SKY, BROWN)]
    scale = [255 * np.array(to_rgb(name)) for name in palette(LEVELS)]
    table = scale + [255 * (share * colour + 1.0 - share) for colour in colours for share in shares]
    found = Image.new("P", (1, 1))
    found.putpalette(np.round(table).astype(np.uint8).tobytes())
    return found


Shown = tuple[list[Any], Callable[[int], None]]
"""Artists, and what lets them show a frame."""


def _stage(found: DrawnMotion, title: str) -> tuple[Figure, list[Shown], Any]:
    """The figure without what moves, what moves in the order in which it is drawn, and the clock."""
    figure, axes = canvas(1.4 + 5.6 * found.aspect)
    low, high = found.box
    size = float(np.max(high - low)) or 1.0
    shown: list[Shown] = []

    def line(path: Any, style: str, label: str, **look: Any) -> None:
        (drawn,) = axes.plot([], [], style, label=label, **look)
        shown.append(([drawn], lambda k: drawn.set_data(*np.atleast_2d(path[k]).T)))

    fine = is_fine(found)
    drawn = found.drawing.parts() if fine else set()
    if not fine:
        axes.plot(*found.ground.T, "s", color=GREY, markersize=8)
    for thin in found.thin.values():
        line(thin, "-", "", color=GREY, linewidth=0.8)
    for name, ends in found.links.items():
        if name in drawn:
            continue
        loose = found.slack.get(name, np.zeros(len(ends), dtype=bool))[:, None, None]
        line(np.where(loose, np.nan, ends), "-", "", color=GREY, linewidth=0.8)
        if np.any(loose):
            line(np.where(loose, ends, np.nan), "--", "", color=GREY, linewidth=0.8)
    for name, outline in found.outlines.items():
        if name not in found.shaped:
            line(outline, "o-", "", color=BLUE, linewidth=3, markersize=4, markevery=[0, -1])
    for stroke in strokes(found):
        artists = put(axes, stroke, 0)
        if not stroke.still:
            shown.append((artists, partial(move, artists, stroke)))
    for number, path in enumerate(found.seats.values()):
        axes.plot(*path.T, "-", color=VERMILION, linewidth=0.8, alpha=0.4)
        line(path, "o", "" if number else "marker", color=VERMILION, markersize=6)
    for number, path in enumerate(found.measured.values()):
        line(path, "o", "" if number else "measured", color=BLACK, fillstyle="none", markersize=11)
    for number, (name, angle) in enumerate(found.directions.items()):
        arm = 0.08 * size * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        path = np.stack([found.seats[name], found.seats[name] + arm], axis=1)
        line(path, "-", "" if number else "measured direction", color=ORANGE, linewidth=3)
    axes.set_xlim(low[0] - 0.08 * size, high[0] + 0.08 * size)
    axes.set_ylim(low[1] - 0.08 * size, high[1] + 0.08 * size)
    axes.set_aspect("equal")
    colour_bar(figure, axes, found)
    headline(figure, f"{title} ({found.note})" if found.note else title)
    axes.set_xlabel(found.labels[0])
    axes.set_ylabel(found.labels[1])
    if not all(found.labels):
        axes.set_axis_off()
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower left", ncols=3)
    clock = axes.text(0.99, 0.99, "", transform=axes.transAxes, ha="right", va="top", family="monospace")
    for artist in (*(artist for artists, _ in shown for artist in artists), clock):
        artist.set_animated(True)  # left out of the still picture
    return figure, shown, clock
