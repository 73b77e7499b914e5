"""Machines of URDF and MJCF files: they move as in MuJoCo, and what has no counterpart is told."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from click.testing import CliRunner
from shoal.cli import main
from shoal.errors import InputError
from shoal.imported import read
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene

mujoco: Any = pytest.importorskip("mujoco")
FINE = {"solver.integrator": "dop853", "solver.relative_tolerance": 1e-11, "solver.absolute_tolerance": 1e-12}

ARM = """
<mujoco model="arm">
  <option gravity="0.3 0 -9.81" timestep="2e-4" integrator="RK4"><flag contact="disable" constraint="disable"/></option>
  <worldbody>
    <body name="frame" pos="0 0 1" euler="0 10 0">
      <body name="upper" pos="0.1 0 0" euler="20 30 10">
        <joint name="shoulder" type="ball" pos="0 0 0.1"/>
        <inertial pos="0.1 0 -0.2" mass="1.5" fullinertia="0.05 0.06 0.04 0.01 0 0.005"/>
        <body name="fore" pos="0 0 -0.5" euler="0 40 0">
          <joint name="elbow" type="hinge" axis="0 1 1" damping="0.1" stiffness="2" springref="0"/>
          <inertial pos="0 0 -0.2" mass="0.7" diaginertia="0.02 0.02 0.01"/>
          <site name="hand" pos="0 0 -0.4"/>
          <body name="rail" pos="0 0 -0.4">
            <joint name="slide" type="slide" axis="1 0 0.2" damping="0.3" armature="0"/>
            <inertial pos="0 0 0" mass="0.3" diaginertia="0.01 0.01 0.01"/>
            <body name="wrist" pos="0 0 -0.1">
              <joint name="first" type="hinge" axis="1 0 0"/> <joint name="second" type="hinge" axis="0 1 0"/>
              <inertial pos="0.05 0.1 0" mass="0.4" diaginertia="0.01 0.012 0.014"/>
            </body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>"""

LOOP = """
<mujoco>
  <worldbody>
    <geom type="plane" size="1 1 1"/>
    <body name="a" pos="0 0 1">
      <joint name="ja" type="hinge" axis="0 1 0" range="-90 90" limited="true" frictionloss="0.01" armature="0.02"/>
      <geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.02" mass="1"/>
      <body name="b" pos="0.3 0 0">
        <joint name="jb" type="hinge" axis="0 1 0"/>
        <geom type="capsule" fromto="0 0 0 0.1 0 0.3" size="0.02" mass="1"/>
      </body>
    </body>
    <body name="c" pos="0.6 0 1">
      <joint name="jc" type="hinge" axis="0 1 0"/>
      <geom type="capsule" fromto="0 0 0 -0.2 0 0.3" size="0.02" mass="1" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
  <equality><connect name="close" body1="b" body2="c" anchor="0.1 0 0.3"/></equality>
  <actuator><motor joint="ja"/></actuator>
  <sensor><jointpos joint="ja"/></sensor>
</mujoco>"""

URDF = """
<robot name="two">
  <link name="base"/>
  <link name="one"><inertial><origin xyz="0.2 0 0"/><mass value="1"/>
    <inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0.001" ixz="0" iyz="0"/></inertial></link>
  <link name="two"><inertial><origin xyz="0.1 0 0" rpy="0.3 0 0"/><mass value="0.5"/>
    <inertia ixx="0.01" iyy="0.02" izz="0.015" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="hip" type="continuous"><parent link="base"/><child link="one"/>
    <origin xyz="0 0 0.5" rpy="0.1 0.2 0.3"/><axis xyz="0 1 0"/><dynamics damping="0.2" friction="0.0"/></joint>
  <joint name="knee" type="prismatic"><parent link="one"/><child link="two"/>
    <origin xyz="0.4 0 0"/><axis xyz="1 0 1"/><limit lower="-5" upper="5" effort="1" velocity="1"/></joint>
</robot>"""


def written(folder: Path, text: str, name: str) -> Path:
    path = folder / name
    path.write_text(text)
    return path


def own_motion(path: Path, times: list[float], bodies: list[str]) -> Any:
    """Where MuJoCo has the origins of bodies, (times, bodies, 3)."""
    model = mujoco.MjModel.from_xml_path(str(path))
    model.opt.timestep, model.opt.integrator = 2e-4, mujoco.mjtIntegrator.mjINT_RK4
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    data = mujoco.MjData(model)
    found = []
    for end in times:
        while data.time < end - 1e-9:
            mujoco.mj_step(model, data)
        mujoco.mj_kinematics(model, data)
        found.append([data.body(name).xpos.copy() for name in bodies])
    return np.array(found)


@pytest.mark.parametrize(
    ("text", "name", "bodies"),
    [(ARM, "arm.xml", ["upper", "fore", "rail", "wrist"]), (URDF, "two.urdf", ["one", "two"])],
)
def test_a_chain_moves_as_in_mujoco(text: str, name: str, bodies: list[str], tmp_path: Path) -> None:
    path = written(tmp_path, text, name)
    scene = Scene.parse(read(path).scene).with_values(FINE)
    times = [0.2, 0.5]
    found = simulate(scene, np.array(times))
    assert found.ok, found.message
    ours = np.stack([found.marker(body) for body in bodies], axis=1)
    assert ours == pytest.approx(own_motion(path, times, bodies), abs=1e-8)


def test_a_loop_closes_rigidly_and_what_is_left_out_is_told(tmp_path: Path) -> None:
    found = read(written(tmp_path, LOOP, "loop.xml"), contacts=False)
    scene = Scene.parse(found.scene)
    assert scene.joints["close"].kind == "spherical"
    moved = simulate(scene.with_values(FINE), np.array([0.1, 0.2]))
    assert moved.ok
    assert moved.constraint_drift[0] < 1e-9
    assert scene.joints["ja"].coulomb == pytest.approx(0.01)  # type: ignore[union-attr]
    told = "\n".join(found.left_out)
    assert scene.joints["ja"].stops.max == pytest.approx(np.pi / 2)  # type: ignore[union-attr]
    assert scene.joints["ja"].armature == pytest.approx(0.02)  # type: ignore[union-attr]
    for part in ("geoms: all that touch others, as asked", "1 that are only seen", "actuators: 1", "sensors: 1"):
        assert part in told


def test_the_command_writes_a_scene_and_lists_the_rest(tmp_path: Path) -> None:
    path, out = written(tmp_path, LOOP, "loop.xml"), tmp_path / "made.yaml"
    done = CliRunner().invoke(main, ["import", str(path), "--out", str(out)])
    assert done.exit_code == 0
    assert "left out: actuators: 1" in done.stderr
    assert done.stdout.strip() == str(out)
    assert Scene.parse(yaml.safe_load(out.read_text())).dimensions == 3


def test_the_command_reports_what_became_what(tmp_path: Path) -> None:
    """Every body, joint and equality has a row; findings say what the rest changes; the same as one JSON object."""
    path, out = written(tmp_path, LOOP, "loop.xml"), tmp_path / "made.yaml"
    done = CliRunner().invoke(main, ["import", str(path), "--out", str(out), "--json"])
    assert done.exit_code == 0, done.stderr
    report = json.loads(done.stdout)
    became = {row["element"]: row["became"] for row in report["rows"]}
    assert became["body b"] == "bodies.b (rigid-body)"
    assert became["joint ja"] == "joints.ja (revolute)"
    assert became["equality close"] == "joints.close (spherical)"
    assert became["actuators"] == became["sensors"] == ""
    remarks = {row["element"]: row["remark"] for row in report["rows"]}
    assert remarks["joint ja"] == "coulomb 0.01, armature 0.02, stops -1.571 to 1.571"
    assert len([one for one in became.values() if one.startswith("contacts.")]) == 2
    codes = [one["code"] for one in report["findings"]]
    assert codes == ["file-forces-left-out", "file-parts-without-motion", "file-leaves-open"]
    told = CliRunner().invoke(main, ["import", str(path), "--out", str(out)])
    assert "joints.close (spherical)" in told.stderr
    assert "file-forces-left-out: Actuators, springs, dampers or rotors of the file are not in the scene" in told.stderr


def test_what_mujoco_warns_of_is_a_note(tmp_path: Path, recwarn: pytest.WarningsRecorder) -> None:
    """Such as an attribute that it will not have for long; in one line without its source."""
    text = LOOP.replace("<mujoco>", '<mujoco><compiler settotalmass="3"/>')
    path, out = written(tmp_path, text, "loop.xml"), tmp_path / "made.yaml"
    done = CliRunner().invoke(main, ["import", str(path), "--out", str(out)])
    assert done.exit_code == 0
    assert not recwarn.list
    (note,) = [line for line in done.stderr.splitlines() if "settotalmass" in line]
    assert note.startswith("note: MuJoCo says: ")
    assert "UserWarning" not in done.stderr


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<mujoco><worldbody><body><joint/></body></worldbody></mujoco>", "mass"),
        ("<mujoco><worldbody", "bad.xml: "),
    ],
)  # fmt: skip
def test_what_cannot_be_read_is_refused_in_one_line(text: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=message) as error:
        read(written(tmp_path, text, "bad.xml"))
    assert "\n" not in str(error.value)
