"""Any scene becomes a page, a moving picture or a picture, by one command."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image
from shoal.cli import main
from shoal.engines import get_engine
from shoal.errors import ComputationError
from shoal.mechanics.findings import ENERGY
from shoal.pictures import simulation
from shoal.pictures.inline import html, plot
from shoal.pictures.motion import plain_motion, scene_motion
from shoal.pictures.outline import ground
from shoal.pictures.poses import poses
from shoal.scene import load_scene, scene_names

COMPILES = "flyball-governor"
"""Its implicit integrator takes a minute to compile in space."""


@pytest.mark.parametrize(
    "name",
    [*(pytest.param(name, marks=[pytest.mark.slow] * (name == COMPILES)) for name in scene_names()), "n-four-bar-2"],
)
@pytest.mark.by_day(3)
def test_every_scene_moves(name: str) -> None:
    """Outlines of every body, finite, of the size of the machine, standing on its ground."""
    scene = load_scene(name)
    until = min(scene.solver.duration, 0.1)
    found = scene_motion(scene, get_engine("gauss"), until, frames=5)
    assert found.outlines.keys() == scene.bodies.keys()
    assert all(np.all(np.isfinite(outline)) for outline in found.outlines.values())
    assert list(found.markers) == list(scene.markers)
    low, high = found.box
    assert np.all(high >= low)
    assert len(json.dumps(plain_motion(found), allow_nan=False)) > 100
    assert poses(found, "title").get_suptitle() == "title"


def test_joints_on_the_ground_are_shown() -> None:
    assert ground(load_scene("flexible-double-pendulum")).tolist() == [[0.0, 0.0]]
    assert len(ground(load_scene("andrews-squeezer"))) == 3


def test_rods_end_where_their_markers_are() -> None:
    scene = load_scene("flexible-double-pendulum")
    found = scene_motion(scene, get_engine("gauss"), 0.5, frames=9)
    assert np.allclose(found.outlines["AB"][:, -1], found.markers["B"], atol=1e-12)
    # The same run without the outlines.
    plain = get_engine("gauss").simulate(scene, found.times)
    assert np.allclose(plain.marker("B"), found.markers["B"], atol=1e-12)


def test_page_and_moving_picture_by_one_command(tmp_path: Path) -> None:
    page, moving = tmp_path / "x.html", tmp_path / "x.gif"
    for out in (page, moving):
        result = CliRunner().invoke(main, ["simulate", "single-pendulum", "--json", "--out", str(out)])
        assert result.exit_code == 0, result.stderr
        found = json.loads(result.stdout)
    text = page.read_text(encoding="utf-8")
    x, y = found["final"]["A"]
    assert f"A is at ({x:.4g}, {y:.4g}) m" in text
    assert f"<td>{x:.6f}</td><td>{y:.6f}</td>" in text
    data = re.search(r'<script type="application/json">(.*?)</script>', text, re.DOTALL)
    assert data is not None
    assert json.loads(data[1])["markers"]["A"][-1] == pytest.approx([x, y], abs=1e-4)
    with Image.open(moving) as picture:
        assert getattr(picture, "n_frames", 1) == 60
    assert moving.stat().st_size < 500_000


def test_a_choice_of_model_is_on_the_page(pages: Callable[[str], str]) -> None:
    text = pages("selection")
    assert "for a tolerance of 30 mm" in text
    assert "<td>chosen</td>" in text


def test_what_cannot_be_trusted_says_so(tmp_path: Path) -> None:
    out = tmp_path / "x.html"
    settings = ["--set", "solver.energy_tolerance=1e-30", "--out", str(out)]
    assert CliRunner().invoke(main, ["simulate", "single-pendulum", *settings]).exit_code == 3
    page = out.read_text(encoding="utf-8")
    assert '<p class="lead bad">Not to be trusted: energy is off by' in page
    assert "No places are shown, as the run is rejected." in page
    assert "Where the markers are at the end" not in page
    assert "moves within" not in page


def test_pictures_of_a_rejected_run_tell_no_places() -> None:
    """On a page and in a notebook as on the terminal; their titles told where the last marker ended."""
    scene = load_scene("single-pendulum").with_values({"solver.duration": 0.1})
    motion = get_engine("gauss").simulate(scene)
    wrong = replace(motion, lane_findings=[[ENERGY.found("energy is off")]])
    moving = simulation.moved(motion, scene)
    for run, said in ((motion, False), (wrong, True)):
        told = [one.figure.get_suptitle().replace("\n", " ") for one in simulation.drawn(run, scene, moving)]
        told.append(plot(run).figure.get_suptitle().replace("\n", " "))
        assert [title.endswith("not to be trusted (energy-check-failed)") for title in told] == [said] * 3
        assert [any(word in title for word in (" is at ", "moves within")) for title in told] == [not said] * 3
        assert ("<td>" in html(run)) is not said


def test_a_motion_that_ends_early_is_shown_so_far() -> None:
    scene = load_scene("single-pendulum")

    def broken(known: int) -> Any:
        def simulate(*args: Any) -> Any:
            found = get_engine("gauss").simulate(*args)
            found.points[known:] = np.nan
            return found

        return SimpleNamespace(simulate=simulate)

    assert len(scene_motion(scene, broken(4), 1.0, frames=9).times) == 4
    with pytest.raises(ComputationError, match="no motion to show"):
        scene_motion(scene, broken(1), 1.0, frames=9)
