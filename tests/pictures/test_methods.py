"""Pictures that compare methods and meshes: drawn without warnings, labelled, with titles that say what they show."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.figure import Figure
from shoal.engines import get_engine
from shoal.engines.compare import compare
from shoal.engines.sweep import sweep
from shoal.errors import InputError
from shoal.identification import Estimate
from shoal.pictures import titles
from shoal.pictures.convergence import convergence
from shoal.pictures.mesh_error import mesh_error
from shoal.pictures.numbers import length
from shoal.pictures.remainders import remainders
from shoal.pictures.style import png, svg
from shoal.pictures.sweep import sweep as draw_sweep
from shoal.scene import load_scene

Estimates = Mapping[str, Estimate]


@pytest.mark.parametrize("draw", [convergence, remainders, mesh_error])
@pytest.mark.by_day(1)
def test_figure_is_drawn_without_warnings_and_labelled(
    draw: Callable[[Estimates, str], Figure], estimates: Estimates
) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figure = draw(estimates, "title")
        assert png(figure).startswith(b"\x89PNG")
        assert ElementTree.fromstring(svg(figure)).tag.endswith("svg")
    assert figure.get_suptitle() == "title"
    assert figure.axes[-1].get_xlabel()
    assert all(axes.get_ylabel() for axes in figure.axes)


def test_a_fit_better_than_its_mesh_stays_in_the_picture(estimates: Estimates) -> None:
    """The axis began a little below the mesh error: the curve lay beneath it, and the chart was empty."""
    fine = estimates["fine"]
    (axes,) = convergence({"fine": replace(fine, model_error_rms=1e3 * float(np.sqrt(fine.fitness)))}, "title").axes
    assert axes.get_ylim()[0] <= fine.fitness


def test_two_values_make_maps_and_three_no_picture() -> None:
    scene = load_scene("single-pendulum")
    vary = {"initial.OA.angle": np.linspace(0, 1, 3), "initial.OA.rate": np.linspace(0, 1, 2)}
    figure = draw_sweep(sweep(scene, vary, get_engine("gauss"), 0.01), "A")
    assert [axes.get_ylabel() for axes in figure.axes][:2] == ["initial.OA.rate [rad/s]"] * 2
    more = sweep(scene, {**vary, "bodies.OA.mass": np.ones(1)}, get_engine("gauss"), 0.01)
    with pytest.raises(InputError, match="3 values"):
        draw_sweep(more, "A")


def test_titles_say_what_the_numbers_say(estimates: Estimates) -> None:
    fine = estimates["fine"]
    # The coarse mesh fits worse, so that only the fine one reached the level of the best.
    assert titles.best(estimates) is fine
    assert titles.pays("Case", estimates) == f"Case: least-squares needs {fine.evaluations} runs of the model"
    assert titles.leaves("Case", estimates) == "Case: least-squares did not reach the best fit"
    assert titles.leaves("Case", {"fine": fine}) == "Case: every method leaves the same remainder"
    comparison = compare(load_scene("single-pendulum"), ["gauss", "casadi"])
    largest = max(row["largest"] for row in comparison.differences())
    assert titles.agrees(comparison, "A").startswith(
        f"single-pendulum: 2 engines place A within {length(largest)} of each other"
    )
    assert "known error" in titles.agrees(comparison, "A")
