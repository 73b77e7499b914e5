"""The interactive picture: every method's motion over the data, in a page that needs no network."""

from __future__ import annotations

from collections.abc import Sequence

from shoal_flows.figures.style import METHODS, OTHER
from shoal_flows.jobs import Fit


def overlay(fits: Sequence[Fit]) -> str:
    """HTML of the paths of the observed marker in the plane; hover for the time, click a name to hide it."""
    import plotly.graph_objects as plotly

    measurement = fits[0].estimate.measurement.first
    marker = measurement.channels[0].marker
    figure = plotly.Figure()
    if [c.quantity for c in measurement.channels] == ["x", "y"]:
        figure.add_scatter(
            x=measurement.values[:, 0],
            y=measurement.values[:, 1],
            customdata=measurement.times,
            mode="markers",
            name="measured",
            marker={"symbol": "circle-open", "color": "#000000"},
            hovertemplate="t = %{customdata:.3f} s<br>x = %{x:.5f} m<br>y = %{y:.5f} m",
        )
    for fit in fits:
        path = fit.motion.marker(marker)
        figure.add_scatter(
            x=path[:, 0],
            y=path[:, 1],
            customdata=fit.motion.times,
            mode="lines",
            name=fit.cell.name,
            line={"color": METHODS.get(fit.cell.method, OTHER)["color"]},
            hovertemplate="t = %{customdata:.3f} s<br>x = %{x:.5f} m<br>y = %{y:.5f} m",
        )
    figure.update_layout(
        title=f"{fits[0].estimate.problem}: path of {marker}, model over measured",
        template="plotly_white",
        xaxis={"title": f"x of {marker} [m]"},
        yaxis={"title": f"y of {marker} [m]", "scaleanchor": "x"},
    )
    return str(figure.to_html(include_plotlyjs=True, full_html=True))
