"""One look for every picture: colours that colour-blind readers can distinguish, room for a message in the title."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import wraps
from io import BytesIO
from textwrap import fill
from typing import Any, ParamSpec, TypeVar

import numpy as np
from matplotlib import colormaps, rc_context
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatterSciNotation, LogLocator, NullFormatter

P = ParamSpec("P")
R = TypeVar("R")

# Okabe and Ito (2008), Color Universal Design.
BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
BLUE, VERMILION, PURPLE, GREY = "#0072B2", "#D55E00", "#CC79A7", "#767676"

_PATH, _BEYOND = re.compile(rb' d="[^"]*"'), re.compile(rb"(\.\d\d)\d+")
"""Data of a path in SVG, and its digits beyond a hundredth."""
_WIDTH = 56
"""Characters in a line of a title."""
_UNIT, _HARD = re.compile(r"(?<=\d) (?=[^\W\d]+\b|%)"), "\u00a0"
"""The space between a number and its unit, and one at which no line ends."""
_SHORT = 100.0
"""A logarithmic axis whose ends are within this factor has too few powers of ten to label."""

METHODS: dict[str, dict[str, Any]] = {
    "auto": {"color": PURPLE, "marker": "X", "linestyle": (0, (5, 1))},
    "least-squares": {"color": BLACK, "marker": "o"},
    "iafsa": {"color": BLUE, "marker": "s"},
    "iafsa-unseeded": {"color": SKY, "marker": "D", "linestyle": "--"},
    "afsa": {"color": ORANGE, "marker": "^"},
    "iafsa-printed": {"color": VERMILION, "marker": "v", "linestyle": "-."},
    "casadi": {"color": GREEN, "marker": "P", "linestyle": ":"},
}
ENGINES: dict[str, dict[str, Any]] = {
    "gauss": {"color": BLUE, "linestyle": "-"},
    "exudyn": {"color": ORANGE, "linestyle": "--"},
    "casadi": {"color": GREEN, "linestyle": ":"},
    "exudyn-ge": {"color": PURPLE, "linestyle": "-."},
}
OTHER: dict[str, Any] = {"color": PURPLE, "linestyle": "-"}
LINES: tuple[dict[str, Any], ...] = (
    {"color": BLUE, "linestyle": "-"},
    {"color": ORANGE, "linestyle": "--"},
    {"color": GREEN, "linestyle": "-."},
    {"color": VERMILION, "linestyle": ":"},
    {"color": PURPLE, "linestyle": (0, (5, 1))},
    {"color": SKY, "linestyle": (0, (1, 1))},
)
"""Looks of lines that have no fixed meaning."""

PALE, LIGHT, DARK, BROWN = "#B9DAF0", "#E4F1FA", "#4A4A4A", "#8A5A00"
"""Insides of bodies and of what lies behind them; lines of springs and guides; ropes."""

LOOKS: dict[str, dict[str, Any]] = {
    "ring": {"layer": 0, "edge": BLUE, "width": 1.2, "fill": None},
    "gear": {"layer": 0, "edge": BLUE, "width": 1.2, "fill": LIGHT},
    "spoke": {"layer": 0.5, "edge": BLUE, "width": 1.0, "fill": None},
    "ground": {"layer": 1, "edge": DARK, "width": 1.2, "fill": "#E6E6E6"},
    "hatch": {"layer": 1, "edge": DARK, "width": 1.1, "fill": None},
    "guide": {"layer": 1, "edge": DARK, "width": 1.3, "fill": None},
    "foot": {"layer": 1, "edge": DARK, "width": 0.6, "fill": "#D0D0D0", "solid": True},
    "wheel": {"layer": 2, "edge": BLUE, "width": 0.5, "fill": LIGHT, "solid": True},
    "plate": {"layer": 2.2, "edge": BLUE, "width": 1.3, "fill": LIGHT},
    "solid": {"layer": 5, "edge": BLUE, "width": 0.6, "fill": PALE, "solid": True},
    "surface": {"layer": 2, "edge": BLACK, "width": 1.3, "fill": PALE},
    "body": {"layer": 3, "edge": BLUE, "width": 1.6, "fill": PALE},
    "block": {"layer": 2.5, "edge": BLUE, "width": 1.6, "fill": PALE},
    "mass": {"layer": 3, "edge": BLUE, "width": 1.6, "fill": BLUE},
    "ball": {"layer": 3, "edge": BLUE, "width": 0.5, "fill": BLUE, "solid": True},
    "link": {"layer": 3, "edge": GREY, "width": 1.3, "fill": "#FFFFFF"},
    "stop": {"layer": 4, "edge": BLACK, "width": 1.5, "fill": None},
    "spring": {"layer": 4, "edge": DARK, "width": 1.5, "fill": None},
    "rope": {"layer": 4, "edge": BROWN, "width": 1.6, "fill": None},
    "weld": {"layer": 5, "edge": BLUE, "width": 1.2, "fill": BLUE},
    "pin": {"layer": 5, "edge": BLUE, "width": 1.5, "fill": "#FFFFFF"},
    "drive": {"layer": 5.5, "edge": GREEN, "width": 2.0, "fill": None},
    "load": {"layer": 6, "edge": GREEN, "width": 1.0, "fill": GREEN},
}
"""Looks of symbols: the layer, the colour and width [pixels or 1/96 inch] of lines, and the colour inside, if any.
Faces of solids are seen from outside alone.

Okabe and Ito's colours: blue moves, dark grey stands or is elastic, green drives and loads."""

STRESS = "largest normal stress"
"""What the colours of rods show."""


def palette(count: int) -> list[str]:
    """Return colours from low to high of a scale that colour-blind readers see as even, and that grows lighter."""
    return [to_hex(colormaps["cividis"](share)) for share in np.linspace(0.0, 1.0, count)]


_RC: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 12.5,
    "axes.titlesize": 12.5,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#DDDDDD",
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "legend.fontsize": 11.5,
    "lines.linewidth": 1.8,
    "figure.constrained_layout.use": True,
    "svg.hashsalt": "shoal",
}


def styled(draw: Callable[P, R]) -> Callable[P, R]:
    """Let a function draw in this look."""

    @wraps(draw)
    def drawn(*args: P.args, **kwargs: P.kwargs) -> R:
        with rc_context(_RC):
            return draw(*args, **kwargs)

    return drawn


def canvas(height: float = 4.2, **layout: Any) -> tuple[Figure, Any]:
    """A figure that stays legible at the width of a phone, and its axes; `layout` goes to `Figure.subplots`."""
    figure = Figure(figsize=(6.4, height))
    return figure, figure.subplots(**layout)


def headline(figure: Figure, text: str) -> None:
    """Set the title above all axes, folded so that nothing is cut off."""
    figure.suptitle(fill(_UNIT.sub(_HARD, text), _WIDTH), x=0.01, ha="left", fontsize=12.5, fontweight="bold")


def log_ticks(axes: Axes) -> None:
    """Labels that do not run into each other: powers of ten, and 2 and 5 between them on a short axis; no fine grid."""
    axes.grid(False, which="minor")
    for axis, (low, high) in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
        if axis.get_scale() == "log":
            axis.set_minor_formatter(NullFormatter())
            if high < _SHORT * low:
                axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
                axis.set_major_formatter(LogFormatterSciNotation(minor_thresholds=(np.inf, np.inf)))


def png(figure: Figure) -> bytes:
    """The picture as PNG."""
    return _saved(figure, format="png", dpi=120)


def svg(figure: Figure) -> bytes:
    """The picture as SVG, the same bytes for the same numbers; paths to a hundredth of a point."""
    drawn = _saved(figure, format="svg", metadata={"Date": None})
    return _PATH.sub(lambda path: _BEYOND.sub(rb"\1", path[0]), drawn)


def _saved(figure: Figure, **options: Any) -> bytes:
    stream = BytesIO()
    with rc_context(_RC):
        figure.savefig(stream, **options)
    # What is laid out once stays so, which halves the work of the next format.
    figure.set_layout_engine("none")
    return stream.getvalue()
