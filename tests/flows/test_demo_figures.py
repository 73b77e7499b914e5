from __future__ import annotations

import warnings
from collections.abc import Callable
from xml.etree import ElementTree

import pytest
from matplotlib.figure import Figure
from shoal.engines.compare import Comparison
from shoal.engines.sweep import Sweep
from shoal.errors import InputError
from shoal_flows import jobs
from shoal_flows.figures import titles
from shoal_flows.figures.convergence import convergence
from shoal_flows.figures.engines import engines
from shoal_flows.figures.mesh_error import mesh_error
from shoal_flows.figures.overlay import overlay
from shoal_flows.figures.residuals import residuals
from shoal_flows.figures.style import png, svg
from shoal_flows.figures.sweep import sweep as draw_sweep
from shoal_flows.figures.trajectory import trajectory
from shoal_flows.jobs import Fit

DRAWN: list[Callable[[list[Fit], Comparison, Sweep], Figure]] = [
    lambda fits, comparison, sweep: trajectory(fits[0], "title"),
    lambda fits, comparison, sweep: residuals(fits, "title"),
    lambda fits, comparison, sweep: convergence(fits, "title"),
    lambda fits, comparison, sweep: mesh_error(fits, "title"),
    lambda fits, comparison, sweep: engines(comparison, "B", "title"),
    lambda fits, comparison, sweep: draw_sweep(sweep, "B"),
]


@pytest.mark.parametrize("draw", DRAWN)
def test_figure_is_drawn_without_warnings_and_labelled(
    draw: Callable[[list[Fit], Comparison, Sweep], Figure], fits: list[Fit], comparison: Comparison, sweep: Sweep
) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figure = draw(fits, comparison, sweep)
        assert png(figure).startswith(b"\x89PNG")
        assert ElementTree.fromstring(svg(figure)).tag.endswith("svg")
    assert figure.axes[0].get_title(loc="left")
    assert figure.axes[-1].get_xlabel()
    assert all(axes.get_ylabel() for axes in figure.axes)


def test_two_values_make_maps_and_three_no_picture() -> None:
    vary = {"initial.OA.angle": (0.0, 1.0, 3), "initial.AB.angle": (0.0, 1.0, 2)}
    figure = draw_sweep(jobs.swept("flexible-double-pendulum", vary, "gauss", 0.01), "B")
    assert [axes.get_ylabel() for axes in figure.axes][:2] == ["initial.AB.angle [rad]"] * 2
    more = jobs.swept("flexible-double-pendulum", {**vary, "bodies.OA.length": (1.0, 1.0, 1)}, "gauss", 0.01)
    with pytest.raises(InputError, match="3 values"):
        draw_sweep(more, "B")


def test_titles_say_what_the_numbers_say(fits: list[Fit], comparison: Comparison) -> None:
    assert titles.pays("Case", fits) == "Case: least-squares needs 18 runs, least-squares 18"
    assert titles.leaves("Case", fits) == "Case: every method leaves the same remainder"
    assert titles.follows("Case", fits) == "Case: the fitted model follows the data to 1.5 mm (RMS)"
    assert titles.agrees(comparison, "B") == "3 engines place B within 56 µm of each other"


def test_overlay_needs_no_network(fits: list[Fit]) -> None:
    page = overlay(fits)
    assert "measured" in page
    assert 'src="http' not in page
