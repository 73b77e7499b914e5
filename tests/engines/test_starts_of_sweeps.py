"""Points of a sweep that cannot start as stated, against where a slider-crank can be put together."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.engines.one_by_one import one_by_one
from shoal.engines.sweep import sweep
from shoal.pictures import files
from shoal.scene import Scene
from shoal.serialization import packed, unpacked

ANGLE, CRANK, LINE = 1.2, 0.3, 0.1
"""Stated angle [rad] and length [m] of the crank; height of the slider's line above its hinge [m]."""


def slider_crank(dimensions: int = 2) -> Scene:
    """In space its crank turns about z and a rod between points holds the slider; the rod's angle is a guess."""
    space = dimensions == 3
    ground = {"body": "ground", "point": [0.0] * dimensions}
    line = {"body": "ground", "point": [0.0, LINE, 0.0][:dimensions]}
    bar = {"kind": "rigid-body", "mass": 1.0, "inertia": [0.1] * 3 if space else 0.1,
           "named_points": {"end": [CRANK, 0.0, 0.0][:dimensions]}}  # fmt: skip
    return Scene.parse({
        "name": "slider-crank", "dimensions": dimensions,
        "bodies": {"crank": bar, "P": {"kind": "point-mass", "mass": 0.5}},
        "joints": {
            "O": {"first": ground, "second": {"body": "crank"}},
            "S": {"kind": "slider", "first": line, "second": {"body": "P"}, **({"axis": "x"} if space else {})},
            "R": {"kind": "distance", "first": {"body": "crank", "point": "end"}, "second": {"body": "P"},
                  "length": 0.4},
        },
        "markers": {"P": {"body": "P"}, "A": {"body": "crank", "point": "end"}},
        "initial": {"crank": {"angle": ANGLE}, "P": {"position": [0.5, LINE, 0.0][:dimensions], "guess": ["position"]}},
    })  # fmt: skip


RODS = np.array([0.1, 0.15, 0.17, 0.2, 0.5])
SHORT = CRANK * math.sin(ANGLE) > RODS + LINE
"""These are too short to reach from the crank where it is stated to the slider's line."""


@pytest.mark.parametrize("dimensions", [2, 3])
def test_points_that_start_elsewhere_than_stated_are_told(dimensions: int, tmp_path: Path) -> None:
    """A place that is a guess may move without a word; lengths that are set first make no guess of a stated angle."""
    found = sweep(slider_crank(dimensions), {"joints.R.length": RODS}, get_engine("gauss"), 0.0)
    assert found.ok, found.complaint
    used = [row["start.crank.angle"] for row in found.rows()]
    assert [one is not None for one in used] == SHORT.tolist()
    places = found.positions["A"]
    away = np.abs(np.arctan2(places[:, 1], places[:, 0]) - ANGLE)
    for angle, place in zip(used, places, strict=True):
        assert angle is None or math.atan2(place[1], place[0]) == pytest.approx(angle, abs=1e-9)
    told = found.to_json()
    assert told["starts"] == {
        "runs": len(RODS),
        "elsewhere": SHORT.sum(),
        "values": {"initial.crank.angle": {"runs": SHORT.sum(), "by": pytest.approx(away.max()), "unit": "rad"}},
    }
    assert f"{SHORT.sum()} of {len(RODS)} points start elsewhere" in told["message"]
    files.sweep(found, tmp_path / "sweep.csv")
    with (tmp_path / "sweep.csv").open() as file:
        assert [row["start.crank.angle"] != "" for row in csv.DictReader(file)] == SHORT.tolist()
    set_first = slider_crank(dimensions).with_values({"joints.R.length": 0.5})
    again = sweep(set_first, {"joints.R.length": RODS}, get_engine("gauss"), 0.0)
    assert again.to_json()["starts"] == told["starts"]
    assert unpacked(packed(again)).to_json() == again.to_json()


def test_a_sweep_of_which_all_points_start_as_stated_says_nothing() -> None:
    found = sweep(slider_crank(), {"joints.R.length": RODS[~SHORT]}, get_engine("gauss"), 0.0)
    assert not found.elsewhere
    assert found.message == ""
    assert set(found.rows()[0]) == {"joints.R.length", "status"} | {
        f"{m}.{d}{x}" for m in "PA" for d in ("", "d") for x in "xy"
    }


def test_a_scene_that_states_nothing_of_its_start_starts_nowhere_else() -> None:
    scene = Scene.parse({key: value for key, value in slider_crank().model_dump(exclude_unset=True).items()
                         if key != "initial"})  # fmt: skip
    found = sweep(scene, {"joints.R.length": RODS}, get_engine("gauss"), 0.0)
    assert found.message == found.complaint
    assert found.to_json()["starts"]["values"] == {}


def test_points_that_cannot_be_put_together_have_a_reason_and_no_places() -> None:
    """The swept angle itself is not kept where the rod does not reach the slider's line."""
    scene = slider_crank().with_values({"joints.R.length": 0.1})
    angles = np.array([-0.5, 0.0, 0.5, 1.0, 1.5])
    found = sweep(scene, {"initial.crank.angle": angles}, get_engine("gauss"), 0.0)
    reaches = np.abs(CRANK * np.sin(angles) - LINE) <= 0.1
    assert [status == "ok" for status in found.status] == reaches.tolist()
    for row, reached, angle in zip(found.rows(), reaches, angles, strict=True):
        assert (row["P.x"] is not None) == (row["A.dy"] is not None) == reached
        assert (row["reason"] == "") == reached
        assert reached or f"initial.crank.angle: {angle:g} rad cannot be kept" in row["reason"]
    assert "the first: initial.crank.angle: -0.5 rad cannot be kept" in found.complaint


def test_lanes_of_a_motion_tell_it_wherever_they_are_computed() -> None:
    """As JSON and one by one they are what each is alone."""
    scene, engine, times = slider_crank(), get_engine("gauss"), np.array([0.001])
    together = engine.simulate_many(scene, {"joints.R.length": RODS}, times)
    crossed, single = unpacked(packed(together)), one_by_one(engine, scene, {"joints.R.length": RODS}, times)
    for lane, length in enumerate(RODS):
        alone = engine.simulate(scene.with_values({"joints.R.length": length}), times).changed()
        assert ("crank" in alone) == SHORT[lane]
        assert crossed.changed(lane) == together.changed(lane)
        for other in (together.changed(lane), single.changed(lane)):
            assert other.keys() == alone.keys()
            for body, quantities in alone.items():
                for name, change in quantities.items():
                    assert other[body][name]["stated"] == change["stated"]
                    assert other[body][name]["used"] == pytest.approx(change["used"], abs=1e-9)
