"""Geoms of MJCF as contacts: which may touch, as MuJoCo has it, and how they roll."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from shoal.imported import Imported, read
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene

mujoco: Any = pytest.importorskip("mujoco")
SLOPE = np.radians(10.0)


def found(folder: Path, inside: str, more: str = "", **options: Any) -> Imported:
    path = folder / "touching.xml"
    path.write_text(f"""<mujoco><option gravity="0 0 -9.81"/><worldbody>
      <geom name="floor" type="plane" size="5 5 1" euler="0 10 0"/>{inside}</worldbody>{more}</mujoco>""")
    return read(path, **options)


def on_slope(height: float, along: float = 0.0) -> str:
    """A place so high over the slope."""
    x = along * np.cos(SLOPE) + height * np.sin(SLOPE)
    return f"{x} 0 {-along * np.sin(SLOPE) + height * np.cos(SLOPE)}"


ROLLING = {
    "sphere": ('<geom name="g" size=".1" friction=".6"/>', 0.1, 5 / 7),
    "sphere-that-slips": ('<geom name="g" size=".1" friction="0" condim="1" priority="1"/>', 0.1, 1.0),
    "wheel": ('<geom name="g" type="cylinder" size=".2 .03" friction=".6" euler="90 0 0"/>', 0.2, 2 / 3),
    "capsule": ('<geom name="g" type="capsule" size=".1 .3" euler="90 0 0" friction=".6"/>', 0.1, None),
}


@pytest.mark.parametrize("name", ROLLING)
@pytest.mark.compiles("kernels of contacts in space")
def test_round_geoms_roll_down_a_slope(name: str, tmp_path: Path) -> None:
    """With the acceleration of a body whose inertia about its axle is that of the geom."""
    geom, radius, part = ROLLING[name]
    scene = found(tmp_path, f'<body name="b" pos="{on_slope(radius)}"><freejoint/>{geom}</body>').scene
    body = scene["bodies"]["b"]
    if part is None:
        part = 1.0 / (1.0 + body["inertia"][1][1] / (body["mass"] * radius**2))
    times = np.array([0.2, 0.4])
    moved = simulate(Scene.parse(scene).with_values({"solver.integrator": "dop853"}), times)
    assert moved.ok, moved.message
    way = 0.5 * part * 9.81 * np.sin(SLOPE) * times**2
    for place, along in zip(moved.marker("b"), way, strict=True):
        assert place == pytest.approx(np.array(on_slope(radius, along).split(), dtype=float), abs=1e-6)


def test_what_may_touch_is_what_mujoco_lets_touch(tmp_path: Path) -> None:
    """Not a body and its parent, nor what is excluded or of other types; as many contacts as MuJoCo finds."""
    ball = '<geom name="{}" size=".1" {}/>'
    inside = f"""<body name="a" pos="0 0 1"><freejoint/>{ball.format("a1", "")}
      <body name="b" pos=".05 0 0"><joint axis="0 1 0"/>{ball.format("b1", "")}
        <body name="c" pos=".05 0 0"><joint axis="1 0 0"/>{ball.format("c1", "")}</body></body></body>
      <body name="d" pos="0 .1 1"><freejoint/>{ball.format("d1", 'contype="2" conaffinity="2"')}</body>
      <body name="e" pos="0 -.1 1"><freejoint/>{ball.format("e1", "")}</body>"""
    more = '<contact><exclude body1="a" body2="e"/></contact>'
    made = found(tmp_path, inside, more)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "touching.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    close = {tuple(sorted(model.geom(k).name for k in one.geom)) for one in data.contact}
    assert close == {("a1", "c1"), ("b1", "e1"), ("c1", "e1")}
    (line,) = [one for one in made.left_out if "from the start" in one]
    assert line.startswith(f"geoms: {len(close)} pairs that touch others from the start are no contacts: ")
    assert set(made.scene["contacts"]) == {f"{name}1-on-floor" for name in "abce"}


def test_geoms_without_contacts_are_counted_by_their_types(tmp_path: Path) -> None:
    inside = """<body name="a" pos="0 0 1"><freejoint/><geom name="x" type="box" size=".1 .1 .1"/></body>
      <body name="b" pos="0 1 1"><freejoint/><geom name="s" size=".1" friction=".9"/></body>"""
    made = found(tmp_path, inside)
    assert made.left_out[0] == "geoms: 2 pairs that touch others are no contacts: 1 box-plane, 1 box-sphere"
    assert made.scene["contacts"]["s-on-floor"]["mu"] == 1.0
    assert any("without rebound" in note for note in made.notes)
    without = found(tmp_path, inside, contacts=False)
    assert "contacts" not in without.scene
    assert without.left_out[0] == "geoms: all that touch others, as asked"


def test_bodies_between_joints_weigh_more_where_contacts_are(tmp_path: Path) -> None:
    """1e-6 of what they carry in place of 1.5e-8: forces of contacts need less round-off, and less accuracy."""
    inside = """<body name="a" pos="0 0 1"><joint name="h" axis="0 1 0" damping=".1"/><joint axis="1 0 0"/>
      <geom size=".1" pos=".2 0 0" mass="2"/></body>"""
    for contacts, part in ((True, 1e-6), (False, np.sqrt(np.finfo(float).eps))):
        scene = found(tmp_path, inside, contacts=contacts).scene
        assert scene["bodies"]["h-link"]["mass"] == pytest.approx(part * 2.0)
