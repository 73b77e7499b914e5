"""Pictures are drawn without warnings, with labelled axes and a message in the title."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from shoal.engines import get_engine
from shoal.engines.compare import compare
from shoal.engines.sweep import sweep
from shoal.notebook import uncertain
from shoal.pictures import files
from shoal.pictures.engines import engines
from shoal.pictures.gaps import gaps
from shoal.pictures.indices import indices
from shoal.pictures.response import response
from shoal.pictures.sweep import sweep as draw_sweep
from shoal.pictures.uncertainty import uncertainty
from shoal.scene import load_scene


def said(figure: Figure) -> str:
    """The title as one line."""
    return " ".join(figure.get_suptitle().split())


SCENE = load_scene("single-pendulum")


@pytest.mark.parametrize("paths", [["initial.OA.angle"], ["initial.OA.angle", "initial.OA.rate"]])
def test_sweeps(paths: list[str]) -> None:
    result = sweep(SCENE, {path: np.linspace(0, 1, 4) for path in paths}, get_engine("gauss"), 0.5)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figure = draw_sweep(result, "A")
    title = said(figure)
    size = np.linalg.norm(result.displacements["A"], axis=1)
    assert f"after 0.5 s A has moved farthest, {size.max():.3g} m, from initial.OA.angle =" in title
    assert f"{paths[-1]} = {result.grid[paths[-1]][size.argmax()]:.3g}" in title
    labels = {axes.get_xlabel() for axes in figure.axes} | {axes.get_ylabel() for axes in figure.axes}
    assert "initial.OA.angle [rad]" in labels
    assert len(paths) == 1 or "initial.OA.rate [rad/s]" in labels


def test_engines_over_each_other() -> None:
    figure = engines(compare(SCENE, ["gauss", "casadi"]), "A", "both")
    above, below = figure.axes
    assert [text.get_text() for text in above.get_legend().get_texts()] == ["gauss", "casadi"]
    assert "[m]" in above.get_ylabel()
    assert "[s]" in below.get_xlabel()


def test_in_space_all_three_axes_are_drawn() -> None:
    scene = load_scene("spherical-pendulum").with_values({"solver.duration": 0.2})
    path = "initial.A.velocity.1"
    compared = compare(scene, ["gauss", "exudyn"])
    above, _ = engines(compared, "A", "both").axes
    assert [text.get_text() for text in above.texts] == ["x", "y", "z"]
    np.testing.assert_allclose(
        [line.get_ydata() for line in above.lines[:3]], compared.trajectories["gauss"].marker("A").T
    )
    found = sweep(scene, {path: np.linspace(1, 2, 3)}, get_engine("gauss"), 0.2)
    (axes,) = draw_sweep(found, "A").axes
    np.testing.assert_allclose([line.get_ydata() for line in axes.lines], found.displacements["A"].T)
    maps = draw_sweep(
        sweep(scene, {path: np.arange(1.0, 3.0), "gravity.2": np.array([-9.81, -1.6])}, get_engine("gauss"), 0.2), "A"
    )
    assert sum(axes.get_ylabel() == "gravity.2 [m/s²]" for axes in maps.axes) == 3


def test_engines_that_end_at_one_height_are_named_together() -> None:
    """The point of Bricard's mechanism starts at (1, -1, 1): z was written over x. One engine has no distances."""
    bricard = load_scene("bricard").with_values({"solver.duration": 0.01})
    above, below = engines(compare(bricard, ["gauss", "exudyn"]), "P3", "two").axes
    assert [text.get_text() for text in above.texts] == ["x, z", "y"]
    assert [line.get_label() for line in below.lines] == ["gauss, exudyn", "known error of the model"]
    alone = engines(compare(bricard, ["gauss"]), "P3", "one").axes
    assert [len(axes.lines) for axes in alone] == [3]


@pytest.mark.parametrize("marginal", [(0.9, 1.1), "normal(1, 0.1)"])
def test_bounds_at_a_single_instant_can_be_seen(marginal: Any) -> None:
    """The chart was empty."""
    found = uncertain(SCENE, {"initial.OA.angle": marginal}, at=[0.5])
    for axes, quantity in zip(response(found, "A").axes, found.axes, strict=True):
        low, high = axes.get_xlim()
        begin, end = axes.patches[0].get_bbox().intervalx
        assert low < begin < 0.5 < end < high
        assert end - begin > 0.1 * (high - low)
        assert axes.get_ylabel() == f"{quantity} of A [m]"
    for axes in (gaps if found.bounds is not None else indices)(found, "A").axes:
        assert axes.lines[0].get_marker() == "o"


@pytest.mark.parametrize("marginal", [(0.9, 1.1), "normal(1, 0.1)"])
@pytest.mark.slow
def test_nothing_is_drawn_between_few_instants(marginal: Any) -> None:
    """A band from 0.5 s to 1.5 s went straight past half a swing; many instants are a band as before."""
    path = "initial.OA.angle"
    few, many = (uncertain(SCENE, {path: marginal}, at=times) for times in ([0.5, 1.5], np.linspace(0, 1.5, 40)))
    for found, bands in ((few, False), (many, True)):
        for axes, quantity in zip(response(found, "A").axes, found.axes, strict=True):
            lines = [line for line in axes.lines if line.get_linestyle() != "None" and len(line.get_xdata()) > 2]
            assert bool(axes.collections) == bool(lines) == bands
            if found.bounds is not None and not bands:
                low, high = (found.column("A", quantity, of) for of in (found.bounds.lower, found.bounds.upper))
                bars = [bar.get_bbox() for bar in axes.patches]
                np.testing.assert_allclose([bar.intervaly for bar in bars], np.column_stack([low, high]))
                np.testing.assert_allclose([np.mean(bar.intervalx) for bar in bars], found.times)
    page = uncertainty(few)
    assert "at the 2 instants looked at" in page
    assert "The band that runs attain" not in page


def test_files_are_png(tmp_path: Path) -> None:
    files.trajectory(get_engine("gauss").simulate(SCENE), SCENE, tmp_path / "motion.png")
    assert (tmp_path / "motion.png").read_bytes().startswith(b"\x89PNG")
