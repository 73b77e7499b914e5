"""Symbols of machines: where and how they are drawn follows from the motion, in pages and stills alike."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from matplotlib.colors import to_rgb
from PIL import Image
from shoal.cli import main
from shoal.engines import get_engine
from shoal.errors import InputError
from shoal.mechanics.rope_path import spans
from shoal.pictures.emphasis import Emphasis
from shoal.pictures.machine import shapes
from shoal.pictures.machine.drawing import Symbol
from shoal.pictures.machine.sheet import unit_of
from shoal.pictures.motion import DrawnMotion, plain_motion, scene_motion
from shoal.pictures.poses import poses
from shoal.pictures.strokes import pieces
from shoal.pictures.style import GREEN, png
from shoal.scene import Scene, load_scene
from shoal.trajectory import Array

GALLERY = Path(__file__).parents[2] / "docs" / "gallery"
ORIGIN = {"body": "ground", "point": [0.0, 0.0]}
DISC = {"kind": "rigid-body", "mass": 1.0, "inertia": 0.01}


def moving(scene: Any, until: float, frames: int = 13) -> DrawnMotion:
    scene = load_scene(str(GALLERY / f"{scene}.yaml")) if isinstance(scene, str) else Scene.parse(scene)
    return scene_motion(scene, get_engine("gauss"), until, frames)


def drawn(found: DrawnMotion, part: str, look: str) -> list[Symbol]:
    return [one for one in found.drawing.symbols if (one.part, one.look) == (part, look)]


def path(found: DrawnMotion, part: str, look: str, number: int = 0) -> Array:
    return found.drawing.path(drawn(found, part, look)[number])


@pytest.fixture(scope="module")
def absorber() -> DrawnMotion:
    return moving("vibration-absorber", 1.0)


def test_a_coil_ends_at_the_ends_of_its_spring_at_every_instant(absorber: DrawnMotion) -> None:
    coil = path(absorber, "tuned", "spring")
    np.testing.assert_allclose(coil[:, 0], absorber.links["tuned"][:, 0], atol=1e-12)
    np.testing.assert_allclose(coil[:, -1], absorber.links["tuned"][:, 1], atol=1e-12)
    # One with a damper lies beside the line, which a tie at both ends leads back to.
    beside = path(absorber, "wall", "spring")
    assert beside[:, 0, 0] == pytest.approx(absorber.links["wall"][:, 0, 0])
    assert beside[:, -1, 0] == pytest.approx(absorber.links["wall"][:, 1, 0])


def test_the_piston_of_a_damper_stays_in_its_cylinder(absorber: DrawnMotion) -> None:
    by = {one.carrier: found for one, found in zip(drawn(absorber, "wall", "spring"), range(4), strict=False)}
    cylinder = path(absorber, "wall", "spring", by["wall cylinder"])
    piston = path(absorber, "wall", "spring", by["wall piston"])
    head = piston[:, -1, 0]
    assert np.all(head > np.nanmin(cylinder[:, 3:, 0], axis=1))
    assert np.all(head < np.nanmax(cylinder[:, 3:, 0], axis=1))
    assert piston[:, 0, 0] == pytest.approx(absorber.links["wall"][:, 1, 0])
    assert np.ptp(cylinder, axis=0)[np.isfinite(cylinder[0])].max() == 0.0


def test_a_guide_is_parallel_to_its_axis_and_as_long_as_the_travel() -> None:
    found = moving("slider-crank", 1.0)
    guide = path(found, "guide", "guide")[0]
    rails = list(pieces(guide))[:2]
    for rail in rails:
        assert np.diff(rail[:, 1]) == pytest.approx(0.0)
    travel = found.markers["piston"][:, 0]
    assert rails[0][0, 0] < travel.min() - found.drawing.unit
    assert rails[0][1, 0] > travel.max() + found.drawing.unit
    block = path(found, "guide", "block")
    np.testing.assert_allclose(block[:, :4].mean(axis=1), found.markers["piston"], atol=1e-12)
    # Of a body that turns it turns along.
    rocker = moving("quick-return", 1.0)
    rail = path(rocker, "pin", "guide")[:, :2]
    along = np.diff(rocker.outlines["rocker"], axis=1)[:, 0]
    assert np.cross(rail[:, 1] - rail[:, 0], along) == pytest.approx(0.0, abs=1e-9)


def test_an_arrow_turns_as_its_torque() -> None:
    found = moving("planetary-gear", 6.0, 40)
    torque = 0.4 * np.cos(found.times)
    for sense in (1.0, -1.0):
        (arc,) = [one for one in drawn(found, "motor", "load") if one.carrier == f"motor {sense:+g}"]
        size = np.linalg.norm(found.drawing.path(arc)[:, 14], axis=1)
        assert np.array_equal(size > 0, sense * torque > 0)
        seen = size > 0
        # From the tail to the tip counter-clockwise by less than a turn.
        turned = np.unwrap(np.arctan2(*np.moveaxis(found.drawing.path(arc)[seen][:, :30, ::-1], 2, 0)), axis=1)
        assert np.all(sense * (turned[:, -1] - turned[:, 0]) > np.pi)
        assert size[seen] / np.abs(torque[seen]) == pytest.approx(size.max() / np.abs(torque[size.argmax()]))


def test_a_drive_and_a_force_point_where_they_go() -> None:
    scene = {
        "name": "driven", "gravity": [0.0, 0.0],
        "bodies": {"wheel": DISC, "mass": {"kind": "point-mass", "mass": 1.0}},
        "joints": {"O": {"first": ORIGIN, "second": {"body": "wheel"}},
                   "motor": {"kind": "driven-angle", "first": ORIGIN, "second": {"body": "wheel"}, "angle": "-2*t"}},
        "loads": {"push": {"kind": "force", "at": {"body": "mass"}, "force": [0.0, -3.0], "scale": "cos(t)"},
                  "follow": {"kind": "force", "at": {"body": "mass"}, "force": [1.0, 0.0],
                             "scale": "position(mass, x)"}},
        "markers": {"mass": {"body": "mass"}, "wheel": {"body": "wheel"}},
        "initial": {"mass": {"position": [1.0, 0.0]}},
    }  # fmt: skip
    found = moving(scene, 3.0)
    assert [one.carrier for one in drawn(found, "motor", "load")] == ["motor -1"]
    push = path(found, "push", "load")
    np.testing.assert_allclose(push[:, 0].round(9) + 0.0, push[:, -1].round(9) + 0.0)
    way = push[:, 3] - found.markers["mass"]
    np.testing.assert_allclose(way[:, 1] / way[0, 1], np.cos(found.times), atol=1e-9)
    assert way[0, 1] < 0
    # Nothing states the sign of what follows the motion: both arrows are there.
    assert len(drawn(found, "follow", "load")) == 2


def profile(lines: Array, centre: Array, angle: float) -> float:
    """Radius of a closed outline in a direction."""
    polar = lines - centre
    turn, radius = np.arctan2(polar[:, 1], polar[:, 0]), np.linalg.norm(polar, axis=1)
    order = np.argsort((turn - angle + np.pi) % (2 * np.pi))
    return float(np.interp(np.pi, ((turn - angle + np.pi) % (2 * np.pi))[order], radius[order]))


@pytest.mark.parametrize("ratio", ["-20/31", "-3/4"])
def test_teeth_mesh_at_all_times(ratio: str) -> None:
    scene = {
        "name": "train", "gravity": [0.0, 0.0], "bodies": {"a": DISC, "b": DISC},
        "joints": {"A": {"first": ORIGIN, "second": {"body": "a"}},
                   "B": {"first": {"body": "ground", "point": [0.3, 0.4]}, "second": {"body": "b"}},
                   "mesh": {"kind": "gear", "first": {"body": "a"}, "second": {"body": "b"}, "ratio": ratio}},
        "markers": {"a": {"body": "a"}}, "initial": {"a": {"rate": 1.0}},
    }  # fmt: skip
    found = moving(scene, 2.0, 60)
    wheels = [path(found, "mesh", "gear", k) for k in range(2)]
    centres, across = (np.zeros(2), np.array([0.3, 0.4])), np.arctan2(0.4, 0.3)
    sums = [
        profile(wheels[0][k], centres[0], across) + profile(wheels[1][k], centres[1], across + np.pi)
        for k in range(len(found.times))
    ]
    first, second = (int(number) for number in ratio[1:].split("/"))
    module = 2 * 0.5 / sum(shapes.teeth(first, second) or ())
    # A tooth of one is in a gap of the other, with the clearance at its root.
    assert max(sums) < 0.5 + 1e-9
    assert min(sums) > 0.5 - 2.3 * module
    assert np.ptp([profile(wheels[0][k], centres[0], across) for k in range(60)]) > module


def test_a_slack_rope_hangs_by_its_length() -> None:
    scene = {
        "name": "rope", "bodies": {"m": {"kind": "point-mass", "mass": 1.0}},
        "joints": {"rope": {"kind": "distance", "keeps": "at-most", "length": 1.0, "first": ORIGIN,
                            "second": {"body": "m"}}},
        "markers": {"m": {"body": "m"}}, "initial": {"m": {"position": [0.9, 0.0]}},
    }  # fmt: skip
    hanging = path(moving(scene, 0.3), "rope", "rope")
    length = np.linalg.norm(np.diff(hanging, axis=1), axis=2).sum(axis=1)
    assert length == pytest.approx(1.0, rel=0.01)
    below = hanging[:, [0, -1], 1].mean(axis=1) - hanging[:, 8, 1]
    assert np.all(below[:-1] > 0.05)
    assert below[-1] == pytest.approx(0.0, abs=1e-3)


def test_symbols_neither_cover_a_machine_nor_stand_for_one() -> None:
    assert unit_of(1.0, [0.5, 0.7]) == pytest.approx(0.025)
    assert unit_of(1.0, [0.004] * 300) == pytest.approx(0.3 * 0.004)
    found = moving("slider-crank", 0.2)
    many = plain_motion(found)["drawing"]
    assert many["unit"] == found.drawing.unit
    # Bodies are drawn by their shape, once.
    assert not plain_motion(found)["outlines"]
    assert {"rod", "crank"} <= found.drawing.parts("body")
    ends = path(found, "crank", "body")
    assert np.ptp(ends[0] @ np.array([-np.sin(1.0), np.cos(1.0)])) == pytest.approx(0.02)


def test_the_script_of_a_page_draws_what_a_still_draws(absorber: DrawnMotion) -> None:
    """Its arithmetic in Python, with the numbers that the page has."""
    data = plain_motion(absorber)["drawing"]
    kinds = set()
    for number, symbol in enumerate(data["symbols"]):
        carrier = data["carriers"][symbol["by"]]
        kinds.add(carrier["kind"])
        for frame in (0, 5, 12):
            place, axes = (np.array(carrier[key][min(frame, len(carrier[key]) - 1)]) for key in ("place", "axes"))
            size = 1.0 if carrier["kind"] == "turned" else 1.0 / np.hypot(axes[0], axes[1])
            y = axes[2:] if carrier["kind"] == "any" else size * np.array([-axes[1], axes[0]])
            lines = np.array(data["shapes"][symbol["shape"]], dtype=float) + symbol["at"]
            found = place + lines[:, :1] * axes[:2] + lines[:, 1:] * y
            np.testing.assert_allclose(found, absorber.drawing.path(absorber.drawing.symbols[number], frame), atol=2e-3)
    assert {"turned", "stretched"} <= kinds


def test_stills_show_drives_in_their_colour(absorber: DrawnMotion) -> None:
    picture = np.asarray(Image.open(BytesIO(png(poses(absorber, "title")))).convert("RGB"), dtype=int)
    green = 255 * np.array(to_rgb(GREEN))
    assert np.count_nonzero(np.abs(picture - green).max(axis=2) < 12) > 50


def cantilever(**rod: Any) -> dict[str, Any]:
    """A clamped rod at rest under a force at its tip."""
    space = rod.get("element") == "director-rod"
    none = [0.0] * (3 if space else 2)
    return {
        "name": "cantilever", "gravity": none, **({"dimensions": 3} if space else {}),
        "bodies": {"beam": {"kind": "rod", "length": 1.0, "height": 0.02, "width": 0.01, "density": 7800.0,
                            "youngs_modulus": 2.1e11, "element": "ancf-cable", "elements": 4, **rod}},
        "joints": {"wall": {"kind": "weld", "first": {"body": "ground", "point": none}, "second": {"body": "beam"}}},
        "loads": {"tip": {"kind": "force", "at": {"body": "beam", "point": "end"}, "force": [500.0, -2.0, *none[2:]]}},
        "markers": {"tip": {"body": "beam", "point": "end"}}, "initial": {"from": "statics"},
    }  # fmt: skip


@pytest.mark.parametrize("rod", [{}, {"section": "round", "width": None}, {"element": "director-rod"}])
def test_stress_is_that_of_the_closed_form(rod: dict[str, Any]) -> None:
    """Of a cantilever, N / A + M c / I, where M is F (L - x) less that of the axial force, N times the deflection."""
    scene = Scene.parse(cantilever(**rod))
    found = scene_motion(scene, get_engine("gauss"), 1e-4, 2, Emphasis(stress=True))
    assert found.stress is not None
    s, stress = np.linspace(0.0, 1.0, 33), found.stress.values["beam"][0]
    body = scene.flexible_rods["beam"]
    section = body.section_at(0.0)
    k = np.sqrt(500.0 / (2.1e11 * section.bending))
    moment = 2.0 / k * np.sinh(k * (1.0 - s)) / np.cosh(k)  # of a tie beam; Timoshenko, Strength of Materials II
    expected = 500.0 / section.area + moment * 0.01 / section.bending
    # Between nodes the moment is interpolated: (k h)^2 / 8 of it.
    assert stress[::8] == pytest.approx(expected[::8], rel=2e-3)
    assert stress == pytest.approx(expected, rel=1.5e-2)
    end, unit = found.stress.scale
    assert (end, unit) == (pytest.approx(expected[0] / 1e6, rel=2e-3), "MPa")
    assert png(poses(found, "title"))
    shown = plain_motion(found)["stress"]
    assert shown["most"] == f"{end:.3g} MPa"
    assert len(shown["rods"]["beam"][0]) == 33


def test_deflection_is_magnified_about_the_undeformed_rod() -> None:
    scene = Scene.parse(cantilever())
    true = scene_motion(scene, get_engine("gauss"), 1e-4, 2)
    large = scene_motion(scene, get_engine("gauss"), 1e-4, 2, Emphasis(magnify=30.0))
    below, larger = (one.outlines["beam"][0, :, 1] for one in (true, large))
    np.testing.assert_allclose(larger, 30.0 * below, atol=1e-4 * abs(larger[-1]))
    assert larger[-1] < -0.01
    # Symbols follow what is drawn, and numbers do not.
    assert large.drawing.carriers["tip +1"].place[0, 1] == pytest.approx(larger[-1])
    assert large.seats["tip"][0, 1] == pytest.approx(larger[-1])
    np.testing.assert_array_equal(large.markers["tip"], true.markers["tip"])
    assert "(deflection × 30)" in str(poses(large, "title").get_suptitle())
    # A rod between two joints stays joined at both.
    bending = load_scene("flexible-double-pendulum")
    found = scene_motion(bending, get_engine("gauss"), 0.3, 3, Emphasis(magnify=2.0))
    np.testing.assert_allclose(found.outlines["OA"][:, -1], found.outlines["AB"][:, 0], atol=1e-12)
    np.testing.assert_allclose(found.seats["A"], found.markers["A"], atol=1e-12)


def test_emphasis_of_nothing_is_refused(tmp_path: Path) -> None:
    said = {
        ("single-pendulum", "--magnify", "5", "--out", "x.html"): "magnify: no rod of single-pendulum bends",
        ("single-pendulum", "--stress", "--out", "x.png"): "stress: no rod of single-pendulum bends",
        ("flexible-double-pendulum", "--stress"): "stress: is of pictures",
        ("flexible-double-pendulum", "--magnify", "-1", "--out", "x.gif"): "magnify: must be a positive number",
    }
    for arguments, words in said.items():
        arguments = tuple(str(tmp_path / one) if one.startswith("x.") else one for one in arguments)
        result = CliRunner().invoke(main, ["simulate", *arguments])
        assert (result.exit_code, words in result.stderr) == (2, True), result.stderr
        assert not list(tmp_path.iterdir())
    numbers = {"section": "numbers", "rho_A": 1.0, "EA": 1e6, "EI": 10.0}
    unknown = Scene.parse(cantilever(width=None, density=None, youngs_modulus=None, **numbers))
    with pytest.raises(InputError, match="stress: no rod of cantilever has a stress that is known"):
        scene_motion(unknown, get_engine("gauss"), 1e-4, 2, Emphasis(stress=True))


def test_spans_of_a_rope_touch_its_pulleys() -> None:
    """Of an Atwood machine they hang straight; between two wheels they touch each on its side."""
    scene = {
        "name": "atwood",
        "bodies": {"a": {"kind": "point-mass", "mass": 1.0}, "b": {"kind": "point-mass", "mass": 1.2}},
        "joints": {"rope": {"kind": "rope", "first": {"body": "a"}, "second": {"body": "b"},
                            "over": [{"body": "ground", "point": [0.0, 0.0], "radius": 0.2, "side": "right"}]}},
        "markers": {"a": {"body": "a"}}, "initial": {"a": {"position": [-0.2, -1.0]}, "b": {"position": [0.2, -1.0]}},
    }  # fmt: skip
    found = moving(scene, 0.3)
    for number, x in enumerate((-0.2, 0.2)):
        np.testing.assert_allclose(path(found, "rope", "rope", number)[..., 0], x, atol=1e-9)
    one, other = np.array([[0.0, 0.0]]), np.array([[1.0, 0.5]])
    for radii in ((0.2, 0.1), (0.2, -0.1), (-0.3, 0.2)):
        begin, end = (ends[:, 0] for ends in spans(np.stack([one, other], axis=1), radii))
        way = (end - begin)[0]
        for centre, place, radius in ((one, begin, radii[0]), (other, end, radii[1])):
            away = (centre - place)[0]
            assert away @ way == pytest.approx(0.0, abs=1e-12)
            assert way[0] * away[1] - way[1] * away[0] == pytest.approx(radius * np.linalg.norm(way))
