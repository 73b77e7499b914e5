"""Machines in space as pages, moving pictures and drawings: what is drawn is where it is, and turned as it is."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from click.testing import CliRunner
from PIL import Image
from shoal.cli import main
from shoal.engines import get_engine
from shoal.pictures.motion import DrawnMotion, plain_motion, scene_motion, upwards
from shoal.pictures.poses import poses
from shoal.pictures.views import views
from shoal.scene import Scene
from shoal.trajectory import Array

ORIGIN = {"body": "ground", "point": [0, 0, 0]}
FINE = {"integrator": "dop853", "relative_tolerance": 1e-9, "absolute_tolerance": 1e-11}


def machine(**parts: Any) -> Scene:
    return Scene.parse({"name": "machine", "dimensions": 3, "gravity": [0, 0, -9.81], "solver": FINE, **parts})


@pytest.fixture(scope="module")
def linked() -> DrawnMotion:
    """A tilted crank, a bar on a universal joint, a block on a slider of its own, a mass on a thread, a spring."""
    axis = [1.0, 2.0, 2.0]
    scene = machine(
        bodies={
            "crank": {"kind": "rod", "length": 1.0, "height": 0.1, "width": 0.04, "density": 500.0,
                      "rotary_inertia": True},
            "bar": {"kind": "rod", "length": 0.5, "height": 0.05, "width": 0.05, "density": 500.0,
                    "rotary_inertia": True},
            "block": {"kind": "rigid-body", "mass": 2.0, "centre_of_mass": [0.0, 0.0, 0.1],
                      "inertia": [[0.03, 0.004, 0.0], [0.004, 0.02, 0.0], [0.0, 0.0, 0.035]]},
            "ball": {"kind": "point-mass", "mass": 0.5},
        },
        joints={
            "O": {"kind": "revolute", "first": ORIGIN, "second": {"body": "crank"}, "axis": axis},
            "U": {"kind": "universal", "first": {"body": "crank", "point": "end"}, "second": {"body": "bar"},
                  "axis": [0, 1, 0], "second_axis": [0, 0, 1]},
            "S": {"kind": "slider", "first": {"body": "bar"}, "second": {"body": "block"}, "direction": 0.4,
                  "rotation": "locked"},
            "D": {"kind": "distance", "first": {"body": "crank", "point": "end"}, "second": {"body": "ball"}},
        },
        loads={"K": {"kind": "spring", "first": {"body": "block"}, "second": {"body": "bar"}, "stiffness": 50.0}},
        markers={"B": {"body": "bar", "point": "end"}, "ball": {"body": "ball"}},
        initial={"ball": {"position": [1.0, 0.0, -0.7]}, "crank": {"angle": 0.0}},
    )  # fmt: skip
    return scene_motion(scene, get_engine("gauss"), 0.6, frames=7)


def test_bars_keep_their_length_and_their_section_turns_with_them(linked: DrawnMotion) -> None:
    for name, length in (("crank", 1.0), ("bar", 0.5)):
        bar = linked.bars[name]
        along = bar.axis[:, 1] - bar.axis[:, 0]
        assert np.linalg.norm(along, axis=1) == pytest.approx(length)
        assert bar.side is not None
        assert np.linalg.norm(bar.side[:, 0], axis=1) == pytest.approx(1.0)
        assert np.sum(along * bar.side[:, 0], axis=1) == pytest.approx(0.0, abs=1e-8)
    assert linked.bars["crank"].size.tolist() == [[0.1, 0.04], [0.1, 0.04]]
    assert linked.bars["crank"].axis[:, 1] == pytest.approx(linked.bars["bar"].axis[:, 0], abs=1e-9)


def test_the_edges_of_a_bar_are_those_of_its_section(linked: DrawnMotion) -> None:
    edges = linked.bars["crank"].edges
    assert np.nanmax(np.linalg.norm(edges - edges[:, :1], axis=2), axis=1) == pytest.approx(
        np.hypot(1, np.hypot(0.1, 0.04))
    )
    turned = edges[0] @ np.array([1.0, 2.0, 2.0]) / 3
    assert np.nanmean(turned) == pytest.approx(1 / 6, abs=0.01)


def test_the_cuboid_of_a_body_has_its_mass_and_inertia(linked: DrawnMotion) -> None:
    """Its moments, by 12 I = m (b^2 + c^2), about its own axes, in the body's frame at the start."""
    bar = linked.bars["block"]
    assert bar.stands_for
    assert bar.side is not None
    along = bar.axis[0, 1] - bar.axis[0, 0]
    a, (b, c) = np.linalg.norm(along), bar.size[0]
    axes = np.stack([along / a, bar.side[0, 0], np.cross(along / a, bar.side[0, 0])], axis=1)
    inertia = axes @ np.diag([b * b + c * c, a * a + c * c, a * a + b * b]) @ axes.T * 2.0 / 12
    assert inertia == pytest.approx(np.array([[0.03, 0.004, 0], [0.004, 0.02, 0], [0, 0, 0.035]]), abs=1e-9)
    middle, start = bar.axis.mean(axis=1), linked.outlines["block"][:, 1]
    assert np.linalg.norm(middle - start, axis=1) == pytest.approx(0.1)


def test_axes_of_joints_turn_with_the_bodies_that_carry_them(linked: DrawnMotion) -> None:
    assert linked.axes["O"][:, 1] == pytest.approx(np.tile(np.array([1, 2, 2]) / 3, (7, 1)))
    first, second = linked.axes["U"], linked.axes["U1"]
    assert np.sum(first[:, 1] * second[:, 1], axis=1) == pytest.approx(0.0, abs=1e-8)
    assert np.ptp(first[:, 1], axis=0).max() > 0.1
    along = linked.bars["bar"].axis[:, 1] - linked.bars["bar"].axis[:, 0]
    assert np.sum(linked.axes["S"][:, 1] * along, axis=1) / 0.5 == pytest.approx(np.cos(0.4))


def test_threads_and_springs_are_lines_between_their_places(linked: DrawnMotion) -> None:
    assert np.linalg.norm(np.diff(linked.links["D"], axis=1), axis=2) == pytest.approx(0.7)
    assert linked.links["K"][:, 1] == pytest.approx(linked.bars["bar"].axis[:, 0])


def test_a_page_has_all_of_it_once(linked: DrawnMotion) -> None:
    data = plain_motion(linked)
    assert json.loads(json.dumps(data, allow_nan=False)) == data
    assert len(data["box"]) == 6
    assert list(data["views"]) == ["front", "top", "right side", "corner"]
    assert data["bars"]["crank"]["axis"] is None  # its outline
    assert data["bars"]["block"]["clear"]
    assert data["front"] == [[1, 0, 0], [0, 0, 1]]


@pytest.mark.parametrize("up", [s * row for row in np.eye(3) for s in (1, -1)])
def test_views_are_those_of_a_drawing(up: Array) -> None:
    front, top, side, corner = views(up)
    for view in (front, top, side, corner):
        assert view.plane.T @ view.plane == pytest.approx(np.eye(2), abs=1e-12)
    assert front.up == pytest.approx(up)
    assert side.up == pytest.approx(up, abs=1e-12)
    assert top.right == pytest.approx(front.right, abs=1e-12)
    # From above, what is farther from who stands in front is higher on the paper; from the right it is to the right.
    away = -np.cross(front.right, front.up)
    assert top.up == pytest.approx(away, abs=1e-12)
    assert side.right == pytest.approx(away, abs=1e-12)
    assert corner.up @ up > 0.9
    assert all((*front.labels, *top.labels, *side.labels))
    assert not any(corner.labels[:1])


def test_up_is_against_gravity() -> None:
    bodies, markers = {"P": {"kind": "point-mass", "mass": 1.0}}, {"P": {"body": "P"}}
    at = {"P": {"position": [0.0, 0.0, 1.0]}}
    for gravity, up in (([0, -9.81, 0], [0, 1, 0]), ([3.0, 0, 1.0], [-1, 0, 0]), ([0, 0, 0], [0, 0, 1])):
        assert upwards(machine(bodies=bodies, markers=markers, initial=at, gravity=gravity)).tolist() == up


def test_drawings_show_every_view(linked: DrawnMotion) -> None:
    figure = poses(linked, "title")
    shown = {axes.get_title(loc="left"): (axes.get_xlabel(), axes.get_ylabel()) for axes in figure.axes}
    assert shown == {
        "front": ("x [m]", "z [m]"), "top": ("x [m]", "y [m]"), "right side": ("y [m]", "z [m]"), "corner": ("", ""),
    }  # fmt: skip


def test_flexible_rods_in_space_are_round_and_bend() -> None:
    held = machine(
        bodies={"R": {"kind": "rod", "length": 1.0, "height": 0.02, "width": 0.02, "density": 1000.0,
                      "youngs_modulus": 1e7, "element": "ancf-cable", "elements": 4}},
        joints={"O": {"kind": "spherical", "first": ORIGIN, "second": {"body": "R"}}},
        markers={"tip": {"body": "R", "point": "end"}}, initial={"R": {"spin": [0.0, 3.0, 1.0]}},
        solver={"integrator": "leapfrog", "step": 5e-5},
    )  # fmt: skip
    found = scene_motion(held, get_engine("gauss"), 0.2, frames=4)
    assert found.bars["R"].side is None
    assert found.outlines["R"].shape == (4, 33, 3)
    assert found.outlines["R"][:, -1] == pytest.approx(found.markers["tip"])
    assert found.bars["R"].edges is found.bars["R"].axis


@pytest.mark.slow
def test_page_moving_picture_and_drawing_by_one_command(tmp_path: Path) -> None:
    scene = machine(
        bodies={"P": {"kind": "point-mass", "mass": 1.0}},
        joints={"S": {"kind": "distance", "first": ORIGIN, "second": {"body": "P"}}},
        markers={"P": {"body": "P"}}, initial={"P": {"position": [0.6, 0, -0.8], "velocity": [0, 1.0, 0]}},
    )  # fmt: skip
    file = tmp_path / "pendulum.yaml"
    file.write_text(yaml.safe_dump(scene.model_dump(mode="json", exclude_unset=True)), encoding="utf-8")
    for ending in ("html", "gif", "png"):
        result = CliRunner().invoke(main, ["simulate", str(file), "--json", "--out", str(tmp_path / f"x.{ending}")])
        assert result.exit_code == 0, result.stderr
    final = json.loads(result.stdout)["final"]["P"]
    text = (tmp_path / "x.html").read_text(encoding="utf-8")
    assert "P is at ({:.4g}, {:.4g}, {:.4g}) m".format(*final) in text
    assert "<td>{:.6f}</td><td>{:.6f}</td><td>{:.6f}</td></tr>".format(*final) in text
    found = re.search(r'<script type="application/json">(.*?)</script>', text, re.DOTALL)
    assert found is not None
    assert json.loads(found[1])["markers"]["P"][-1] == pytest.approx(final, abs=1e-4)
    with Image.open(tmp_path / "x.gif") as picture:
        assert getattr(picture, "n_frames", 1) == 60
    with Image.open(tmp_path / "x.png") as picture:
        assert picture.size[0] > 500
