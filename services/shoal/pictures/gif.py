"""The identified motion as a small moving picture, for slides and messages."""

from __future__ import annotations

from io import BytesIO
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from shoal.pictures.motion import Motion
from shoal.pictures.style import BLACK, BLUE, VERMILION, canvas, styled

_FRAMES = 60
_PAUSE_MS = 80


def gif(found: Motion, title: str) -> bytes:
    """The motion as GIF of sixty frames, slowed down or sped up to about five seconds."""
    figure, images = _first(found, title), []
    drawing: Any = FigureCanvasAgg(figure)
    axes = figure.axes[0]
    for k in np.linspace(0, len(found.times) - 1, _FRAMES).round().astype(int):
        for line, outline in zip(axes.lines, found.outlines.values(), strict=False):
            line.set_data(*outline[k].T)
        places = axes.lines[len(found.outlines) :]
        shown = [*found.markers.values(), *found.measured.values()]
        for line, path in zip(places, shown, strict=True):
            line.set_data(path[[k], 0], path[[k], 1])
        axes.set_xlabel(f"x [m], t = {found.times[k]:.3f} s")
        drawing.draw()
        figure.set_layout_engine("none")
        images.append(Image.fromarray(np.asarray(drawing.buffer_rgba())).convert("RGB").quantize(64))
    stream = BytesIO()
    images[0].save(stream, "GIF", save_all=True, append_images=images[1:], duration=_PAUSE_MS, loop=0)
    return stream.getvalue()


@styled
def _first(found: Motion, title: str) -> Figure:
    figure, axes = canvas(5.0)
    every = np.concatenate([o.reshape(-1, 2) for o in (*found.outlines.values(), *found.measured.values())])
    low, high = np.nanmin(every, axis=0), np.nanmax(every, axis=0)
    border = 0.06 * float(np.max(high - low))
    for _ in found.outlines:
        axes.plot([], [], color=BLUE, linewidth=3)
    for number, _ in enumerate(found.markers):
        axes.plot([], [], "o", color=VERMILION, label="" if number else "fitted model")
    for number, _ in enumerate(found.measured):
        axes.plot([], [], "o", color=BLACK, fillstyle="none", markersize=10, label="" if number else "measured")
    axes.set_xlim(low[0] - border, high[0] + border)
    axes.set_ylim(low[1] - border, high[1] + border)
    axes.set_aspect("equal")
    axes.set_title(title)
    axes.set_ylabel("y [m]")
    axes.legend(loc="upper left")
    return figure
