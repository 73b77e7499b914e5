"""Contacts in pictures: events on the axis of time, impacts on paths, stops, slack ropes, and words about them."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.pictures.event_text import told
from shoal.pictures.gif import gif
from shoal.pictures.motion import scene_motion
from shoal.pictures.paths import paths
from shoal.pictures.poses import poses
from shoal.pictures.simulation import simulation
from shoal.scene import Scene

SWUNG = {
    "name": "swung", "gravity": [0.0, -9.81],
    "bodies": {
        "m": {"kind": "point-mass", "mass": 1.0},
        "arm": {"kind": "rigid-body", "mass": 1.0, "inertia": 0.0833, "centre_of_mass": [0.5, 0.0],
                "named_points": {"end": [1.0, 0.0]}},
        "fore": {"kind": "rigid-body", "mass": 0.5, "inertia": 0.02, "centre_of_mass": [0.3, 0.0],
                 "named_points": {"end": [0.6, 0.0]}},
    },
    "joints": {
        "rope": {"kind": "distance", "keeps": "at-most", "first": {"body": "ground", "point": [0.0, 0.0]},
                 "second": {"body": "m"}},
        "shoulder": {"first": {"body": "ground", "point": [1.8, 0.5]}, "second": {"body": "arm"},
                     "stops": {"min": -2.2, "restitution": 0.6}},
        "elbow": {"first": {"body": "arm", "point": "end"}, "second": {"body": "fore"},
                  "stops": {"min": -0.3, "max": 1.2, "restitution": 0.4}},
    },
    "markers": {"P": {"body": "m"}, "E": {"body": "arm", "point": "end"}, "F": {"body": "fore", "point": "end"}},
    "initial": {"m": {"position": [0.0, -1.0], "velocity": [5.86, 0.0]}, "arm": {"angle": -0.9, "rate": 0.0},
                "fore": {"angle": -0.5, "rate": 0.0}},
    "solver": {"duration": 2.0},
}  # fmt: skip
"""A mass on a rope that flies and is caught, beside an arm between stops."""


@pytest.mark.compiles("kernels of contacts, which few machines need")
def test_events_are_marked_on_the_axis_of_time_and_on_the_paths_that_they_bend() -> None:
    moving = scene_motion(Scene.parse(SWUNG), get_engine("gauss"), 2.0)
    kinds = {(event["joint"], event["kind"]) for event in moving.events}
    assert {("rope", "opens"), ("rope", "impact"), ("elbow", "impact")} <= kinds
    # The mass on the rope and the arm are machines of their own.
    impacts = {joint: [e["time"] for e in moving.events if e["joint"] == joint and e.get("impulse", 0.0) > 0.0]
               for joint in ("rope", "shoulder", "elbow")}  # fmt: skip
    assert moving.struck["P"].tolist() == impacts["rope"]
    assert sorted(moving.struck["E"].tolist()) == sorted(impacts["shoulder"] + impacts["elbow"])
    figure = paths(moving, "title")
    (legend,) = figure.legends
    said = [text.get_text() for text in legend.get_texts()]
    count = sum(map(len, impacts.values()))
    assert sorted(said) == ["E", "F", "P", f"impact ({count})", "opens (1)"]
    assert "impact" in [text.get_text() for text in poses(moving, "title").legends[0].get_texts()]


def test_stops_are_drawn_where_the_second_body_stands_at_its_limit() -> None:
    moving = scene_motion(Scene.parse(SWUNG), get_engine("gauss"), 2.0, frames=801)
    hits = [event["time"] for event in moving.events if event["joint"] == "elbow" and event.get("impulse", 0.0) > 0.0]
    frame = int(np.argmin(np.abs(moving.times - hits[0])))
    elbow, tip = moving.outlines["fore"][frame]
    way = (tip - elbow) / np.linalg.norm(tip - elbow)
    drawn = moving.stops["elbow"][frame] - elbow
    drawn = drawn[np.isfinite(drawn[:, 0])]
    ends = drawn / np.linalg.norm(drawn, axis=1, keepdims=True)
    assert np.min(np.linalg.norm(ends[-4:] - way, axis=1)) < 0.05
    # The arm's own stop stands still.
    assert np.ptp(moving.stops["shoulder"], axis=0)[0].max() == 0.0


def test_a_slack_rope_is_told_from_a_taut_one() -> None:
    moving = scene_motion(Scene.parse(SWUNG), get_engine("gauss"), 2.0)
    times = {event["kind"]: event["time"] for event in moving.events if event["joint"] == "rope"}
    opens, caught = times["opens"], times["impact"]
    loose = moving.times[moving.slack["rope"]]
    assert opens < loose.min() < opens + 0.1
    assert caught - 0.05 < loose.max() < caught
    assert gif(moving, "title").startswith(b"GIF")


def test_the_page_and_the_terminal_say_what_happened() -> None:
    scene = Scene.parse(SWUNG)
    run = get_engine("gauss").simulate(scene)
    (said,) = told(run.model)
    count = sum(event.get("impulse", 0.0) > 0.0 for event in run.model["events"])
    last = run.model["events"][-1]
    assert said.startswith(f"{count} impacts, the last event: {last['joint']} {last['kind']} at ")
    assert said.endswith("in contact at the end: rope")
    assert not list(told({"events": []}))
    page = simulation(run, scene)
    assert said in page
    shown = json.loads(re.search(r"<script type=.application/json.[^>]*>(.*?)</script>", page, re.DOTALL)[1])  # type: ignore[index]
    symbols = shown["drawing"]["symbols"]
    assert {one["part"] for one in symbols if one["look"] == "stop"} == {"shoulder", "elbow"}
    assert {"rope"} == {one["part"] for one in symbols if one["look"] == "rope"}
    assert any(shown["slack"]["rope"])
    assert not all(shown["slack"]["rope"])


def test_surfaces_of_contacts_are_drawn_and_impacts_are_those_of_the_bodies_that_touch() -> None:
    balls = {name: {"kind": "rigid-body", "mass": 1.0, "inertia": 0.01} for name in ("low", "high")}
    floor = {"first": {"body": "low", "radius": 0.1}, "second": {"body": "ground", "line": 0.0}, "restitution": 0.5}
    scene = Scene.parse({
        "name": "balls", "gravity": [0.0, -9.81], "bodies": balls, "contacts": {"floor": floor},
        "markers": {name: {"body": name} for name in balls},
        "initial": {"low": {"position": [0.0, 0.3]}, "high": {"position": [1.0, 0.5]}}, "solver": {"duration": 0.4},
    })  # fmt: skip
    moving = scene_motion(scene, get_engine("gauss"), 0.4)
    assert [len(moving.struck[name]) for name in balls] == [len([e for e in moving.events if e["kind"] == "impact"]), 0]
    circle, line = moving.stops["floor first"], moving.stops["floor second"]
    away = np.linalg.norm(circle - moving.markers["low"][:, None], axis=2)
    np.testing.assert_allclose(away, 0.1, atol=1e-12)
    assert np.ptp(line[..., 1]) == 0.0
    (said,) = told(get_engine("gauss").simulate(scene).model)
    assert "the last event: floor" in said


def test_polygons_cams_and_boxes_of_guides_are_drawn_with_their_bodies() -> None:
    """A point mass carries its circle without turning."""
    body = {"kind": "rigid-body", "mass": 1.0, "inertia": 0.01}
    guide = {"kind": "slider", "first": {"body": "ground", "point": [0.0, -1.0]}, "play": 0.01, "size": [0.2, 0.1],
             "second": {"body": "box", "point": [0.0, 0.0]}}  # fmt: skip
    ground = {"body": "ground", "point": [0.0, 1.0], "polygon": [[0, 0], [1, 0], [0, 1]]}
    cam = {"body": "cam", "point": [0.0, 0.0], "cam": {"table": [[0.0, 0.1], [2.0, 0.1], [4.0, 0.1]]}}
    scene = Scene.parse({
        "name": "drawn", "gravity": [0.0, 0.0], "joints": {"guide": guide},
        "bodies": {"ball": {"kind": "point-mass", "mass": 1.0}, "cam": body, "box": body},
        "contacts": {"hill": {"first": {"body": "ball", "radius": 0.1}, "second": ground},
                     "cam": {"first": {"body": "ball", "radius": 0.1}, "second": cam}},
        "markers": {"ball": {"body": "ball"}, "cam": {"body": "cam"}, "box": {"body": "box"}},
        "initial": {"ball": {"position": [3.0, 3.0]}, "cam": {"position": [5.0, 0.0], "rate": 1.0}},
        "solver": {"duration": 0.1},
    })  # fmt: skip
    moving = scene_motion(scene, get_engine("gauss"), 0.1)
    drawn = moving.stops
    np.testing.assert_allclose(drawn["hill second"][0], [[0, 1], [1, 1], [0, 2], [0, 1]])
    for name, marker in (("hill first", "ball"), ("cam second", "cam")):
        away = np.linalg.norm(drawn[name] - moving.markers[marker][:, None], axis=2)
        np.testing.assert_allclose(away, 0.1, atol=1e-9)
    assert np.ptp(drawn["guide box"][0], axis=0) == pytest.approx([0.2, 0.1])
