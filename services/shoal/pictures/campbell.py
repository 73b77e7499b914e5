"""Campbell diagram as a figure, and as one page that needs nothing else."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from shoal.mechanics.analysis.campbell import Campbell
from shoal.pictures.drawn import Drawn
from shoal.pictures.pages import render, software
from shoal.pictures.style import BLUE, GREY, VERMILION, canvas, headline, styled

_LOOKS = (
    ("forward", "forward whirl", {"marker": "^", "color": VERMILION}),
    ("backward", "backward whirl", {"marker": "v", "color": BLUE}),
    ("", "no whirl", {"marker": "o", "color": GREY}),
)
_CAPTION = (
    "Frequencies of the modes at each speed, as an observer at rest sees them; open symbols are frequencies in the "
    "turning frame, crosses are motions that grow. On the dashed line the frequency is that of the rotation."
)
HEADINGS = ("speed [rad/s]", "mode", "frequency [Hz]", "growth [1/s]", "kind", "whirl", "frame")


@styled
def campbell(found: Campbell) -> Figure:
    """Frequencies [Hz] over the speed [rad/s], with the line of the rotation."""
    figure, axes = canvas(4.6)
    rows = [(speed, mode) for speed, one in zip(found.speeds, found.modes, strict=True) if one for mode in one.modes]
    for whirl, label, look in _LOOKS:
        mine = [(speed, mode) for speed, mode in rows if mode.whirl == whirl and mode.eigenvalue.imag > 0]
        for rotating in (False, True):
            part = [(speed, mode.damped_frequency) for speed, mode in mine if mode.rotating == rotating]
            if part:
                filled = {"markerfacecolor": "none"} if rotating else {}
                text = f"{label} (turning frame)" if rotating else label
                axes.plot(*np.transpose(part), linestyle="none", markersize=4.5, label=text, **look, **filled)
    grows = [(speed, mode.damped_frequency) for speed, mode in rows if mode.kind == "unstable"]
    if grows:
        axes.plot(*np.transpose(grows), linestyle="none", marker="x", markersize=8, color="black", label="grows")
    ends = np.array([0.0, max(found.speeds)])
    top = axes.get_ylim()[1]
    axes.plot(ends, ends / (2 * np.pi), color=GREY, linestyle="--", linewidth=1.0, label="rotation")
    axes.set_ylim(0.0, top)
    axes.set_xlabel("speed [rad/s]")
    axes.set_ylabel("frequency [Hz]")
    axes.legend(ncols=2)
    headline(figure, says(found))
    return figure


def says(found: Campbell) -> str:
    """The finding in one sentence."""
    if not found.ok:
        return f"{found.scene.name}: {found.message}"
    critical = ", ".join(f"{speed:.4g}" for speed in found.critical_speeds)
    ends = f"from {min(found.speeds):.4g} to {max(found.speeds):.4g} rad/s"
    text = f"critical at {critical} rad/s" if critical else "no forward whirl meets the rotation"
    return f"{found.scene.name}, {ends}: {text}" + (f"; {found.message}" if found.message else "")


def rows(found: Campbell) -> list[list[str]]:
    """A row a speed and mode, as `HEADINGS` names the columns."""
    table = []
    for speed, one in zip(found.speeds, found.modes, strict=True):
        for number, mode in enumerate(one.modes if one else (), 1):
            values = f"{mode.frequency:.6g}", f"{mode.eigenvalue.real:.6g}"
            table.append([f"{speed:.6g}", str(number), *values, mode.kind, mode.whirl or "-", mode.frame])
    return table


def page(found: Campbell) -> str:
    """The page as HTML without a reference to anything outside."""
    return render(
        "campbell.html.j2",
        title=f"{found.scene.name}: Campbell diagram",
        trusted=found.ok,
        lead=f"{says(found)}.",
        picture=Drawn("campbell", campbell(found), "Frequencies over the speed.", _CAPTION).embedded(),
        headings=list(HEADINGS),
        rows=rows(found),
        provenance=[("about", found.about), ("versions", software())],
    )
