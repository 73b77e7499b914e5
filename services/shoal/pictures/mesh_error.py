"""Effect of the mesh on the identified values, and the estimate of it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from shoal.identification import Estimate
from shoal.pictures.style import BLUE, ORANGE, VERMILION, canvas, headline, log_ticks, styled


@styled
def mesh_error(estimates: Mapping[str, Estimate], title: str) -> Figure:
    """Size of the true error of every parameter, of the error predicted from the mesh, and of the interval."""
    names = list(next(iter(estimates.values())).truth)
    figure, axes = canvas(2.0 + 2.0 * len(names), nrows=len(names), sharex=True, sharey=True, squeeze=False)
    places = np.arange(len(estimates))
    for panel, name in zip(axes[:, 0], names, strict=True):
        values = [e.parameters[name] for e in estimates.values()]
        true = [abs(e.parameters[name].value - e.truth[name]) for e in estimates.values()]
        predicted = [abs(v.correction) if v.correction is not None else np.nan for v in values]
        half = [(v.upper - v.lower) / 2 for v in values]
        dots = {"linestyle": "none", "markersize": 9}
        panel.plot(
            places,
            np.degrees(half),
            color=ORANGE,
            marker="_",
            markeredgewidth=2,
            label="half the 95 % interval",
            **dots,
        )
        panel.plot(places, np.degrees(predicted), color=BLUE, marker="D", label="predicted", fillstyle="none", **dots)
        panel.plot(places, np.degrees(true), color=VERMILION, marker="o", label="true error", **dots)
        panel.set_yscale("log")
        log_ticks(panel)
        panel.set_ylabel(f"error of {name} [°]")
    axes[-1, 0].set_xticks(places, [label.replace(" ", "\n") for label in estimates])
    axes[-1, 0].set_xlabel("elements on OA / AB, quadrature")
    axes[-1, 0].set_xlim(-0.5, len(estimates) - 0.5)
    headline(figure, title)
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower left", ncols=3)
    return figure
