"""The fitted model over the measured motion."""

from __future__ import annotations

from matplotlib.figure import Figure

from shoal_flows.figures.style import BLACK, METHODS, OTHER, canvas, styled
from shoal_flows.jobs import Fit

_UNITS = {"x": "m", "y": "m", "angle": "rad"}


@styled
def trajectory(fit: Fit, title: str) -> Figure:
    """Each channel against time: circles are measured, the line is the model."""
    measurement, estimate = fit.estimate.measurement.first, fit.estimate
    channels = measurement.channels
    figure, axes = canvas(1.6 + 1.7 * len(channels), nrows=len(channels), sharex=True, squeeze=False)
    colour = METHODS.get(estimate.method, OTHER)["color"]
    if colour == BLACK:
        colour = OTHER["color"]
    for k, channel in enumerate(channels):
        panel = axes[k, 0]
        index = fit.motion.markers.index(channel.marker)
        model = (
            fit.motion.angles[:, index, 0]
            if channel.quantity == "angle"
            else fit.motion.points[:, index, 0 if channel.quantity == "x" else 1, 0]
        )
        dots = {"linestyle": "none", "marker": "o", "markersize": 4, "markerfacecolor": "none"}
        panel.plot(fit.motion.times, model, color=colour, label=f"model ({estimate.method})")
        panel.plot(measurement.times, measurement.values[:, k], color=BLACK, label="measured", **dots)
        panel.set_ylabel(f"{channel.quantity} of {channel.marker} [{_UNITS[channel.quantity]}]")
    axes[0, 0].legend()
    axes[0, 0].set_title(title)
    axes[-1, 0].set_xlabel("time [s]")
    return figure
