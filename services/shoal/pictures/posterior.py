"""Draws from the posterior: every parameter by itself, and every two together."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from shoal.identification import Estimate, Problem
from shoal.identification.uncertainty.posterior import Posterior
from shoal.pictures import units
from shoal.pictures.style import BLACK, BLUE, ORANGE, VERMILION, canvas, headline, styled
from shoal.trajectory import Array

_BINS = 40
_SHOWN = 4000
"""Points of a panel, evenly from all draws."""
_MOST = 8
"""Parameters that one picture has room for."""


@styled
def posterior(estimate: Estimate, problem: Problem) -> Figure:
    """Histograms on the diagonal, draws of two parameters below; dashed: the central 95 %, orange: the intervals."""
    found = estimate.posterior
    assert found is not None
    names = shown(found)
    figure, axes = canvas(
        min(1.5 + 1.7 * len(names), 11.0), nrows=len(names), ncols=len(names), squeeze=False, sharex="col"
    )
    for (row, column), panel in np.ndenumerate(axes):
        if column > row:
            panel.set_visible(False)
        elif column == row:
            _alone(panel, estimate, found, names[row])
        else:
            _together(panel, found, names[column], names[row])
        panel.locator_params(nbins=3)
        panel.tick_params(labelleft=column == 0 and row > 0, labelsize=9)
        if row == len(names) - 1:
            panel.set_xlabel(units.parameter(problem, names[column]), fontsize=10)
            panel.tick_params(axis="x", labelrotation=30)
        if column == 0 and row:
            panel.set_ylabel(units.parameter(problem, names[row]), fontsize=10)
    headline(figure, says(estimate))
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower left", ncols=4)
    return figure


def shown(found: Posterior) -> list[str]:
    """The parameters of the picture: all, or those that the draws leave widest over their size."""
    wide = {name: one.sd / max(abs(one.median), 1e-300) for name, one in found.marginals.items()}
    kept = sorted(wide, key=lambda name: -wide[name])[:_MOST]
    return [name for name in found.names if name in kept]


def says(estimate: Estimate) -> str:
    """Describe the diagnostics of the draws."""
    found = estimate.posterior
    assert found is not None
    state = "converged" if found.converged else "NOT converged"
    return f"{estimate.problem}: {state}, {found.worth:.0f} effective draws from the posterior"


def _alone(panel: Axes, estimate: Estimate, found: Posterior, name: str) -> None:
    one, value = found.marginals[name], estimate.parameters[name]
    panel.hist(_column(found, name), bins=_BINS, color=BLUE, alpha=0.6, label="draws")
    for k, end in enumerate((one.lower, one.upper)):
        panel.axvline(end, color=BLACK, linestyle="--", linewidth=1, label="central 95 %" if k == 0 else None)
    if value.identifiable:
        for k, end in enumerate((value.lower, value.upper)):
            panel.axvline(end, color=ORANGE, linestyle=":", linewidth=2, label="interval" if k == 0 else None)
    panel.axvline(value.value, color=VERMILION, linewidth=1, label="the answer")
    panel.set_yticks([])


def _together(panel: Axes, found: Posterior, across: str, up: str) -> None:
    every = max(1, len(found.flat) // _SHOWN)
    points = _column(found, across)[::every], _column(found, up)[::every]
    panel.plot(*points, ".", color=BLUE, markersize=2, alpha=0.25, rasterized=True)


def _column(found: Posterior, name: str) -> Array:
    return np.asarray(found.flat[:, found.names.index(name)])
