"""Profile likelihood of each parameter, all others fitted again."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from shoal.identification import Estimate, Problem
from shoal.identification.uncertainty.profiles import Profile
from shoal.pictures import units
from shoal.pictures.style import BLACK, BLUE, ORANGE, VERMILION, canvas, headline, styled

_COLUMNS = 3


@styled
def profiles(estimate: Estimate, problem: Problem) -> Figure:
    """Rise of the misfit over the 95 % threshold against each parameter; the dotted parabola is the interval's."""
    found = estimate.profiles
    columns = min(_COLUMNS, len(found))
    rows = -(-len(found) // columns)
    figure, axes = canvas(1.4 + 2.3 * rows, nrows=rows, ncols=columns, squeeze=False, sharey=True)
    for panel, (name, profile) in zip(axes.flat, found.items(), strict=False):
        _draw(panel, estimate, name, profile)
        panel.set_xlabel(units.parameter(problem, name))
    for panel in axes.flat[len(found) :]:
        panel.set_visible(False)
    for row in axes:
        row[0].set_ylabel("rise of the misfit\n[95 % threshold]")
    headline(figure, _says(estimate))
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower left", ncols=4)
    return figure


def _draw(panel: Axes, estimate: Estimate, name: str, profile: Profile) -> None:
    value = estimate.parameters[name]
    half = (value.upper - value.lower) / 2
    if value.identifiable and half > 0:
        fine = np.linspace(profile.values[0], profile.values[-1], 200)
        panel.plot(fine, ((fine - value.value) / half) ** 2, ":", color=ORANGE, label="interval")
    panel.plot(profile.values, profile.rise, "o-", color=BLUE, markersize=3, label="profile")
    panel.axhline(1.0, color=BLACK, linestyle="--", linewidth=1, label="95 %")
    panel.axvline(value.value, color=VERMILION, linewidth=1, label="the answer")
    panel.set_ylim(-0.1, 3.0)
    panel.locator_params(axis="x", nbins=3)


def _says(estimate: Estimate) -> str:
    """Return whether the data bound each parameter on both sides, in words."""
    unbounded = [name for name, profile in estimate.profiles.items() if profile.open]
    if unbounded:
        return f"{estimate.problem}: the data leave a side of {', '.join(unbounded)} open"
    return f"{estimate.problem}: the data bound every parameter on both sides"
