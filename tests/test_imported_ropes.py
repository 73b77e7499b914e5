"""Tendons over several sites, as ropes over eyes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from shoal.imported import read
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene

FINE = {"solver.integrator": "dop853", "solver.relative_tolerance": 1e-10, "solver.absolute_tolerance": 1e-11}
MODEL = """<mujoco><option gravity="0 0 -9.81" integrator="RK4" timestep="1e-4"/>
<default><site size=".01"/></default>
<worldbody><site name="wall" pos="-.6 0 .2"/><site name="eye" pos=".2 .3 .5"/>
<body name="arm"><joint name="h" axis="0 1 0"/><inertial pos=".3 0 0" mass="1" diaginertia=".02 .02 .02"/>
<site name="tip" pos=".6 0 0"/></body></worldbody>
<tendon><spatial name="t" {fields}><site site="wall"/><site site="eye"/><site site="tip"/></spatial></tendon>{more}
</mujoco>"""


def imported(tmp_path: Path, fields: str, more: str = "") -> tuple[Any, Any]:
    """What a file becomes, and MuJoCo's state after 0.3 s."""
    mujoco: Any = pytest.importorskip("mujoco")
    text = MODEL.format(fields=fields, more=more)
    (tmp_path / "m.xml").write_text(text)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 3000)
    mujoco.mj_kinematics(model, data)
    return read(tmp_path / "m.xml"), data


def test_a_spring_that_only_pulls_becomes_an_elastic_rope(tmp_path: Path) -> None:
    found, there = imported(tmp_path, 'stiffness="60" springlength="0 1.5"')
    rope = found.scene["joints"]["t-spring"]
    assert (rope["kind"], len(rope["over"]), rope["law"]["stiffness"]) == ("rope", 1, 60.0)
    scene = Scene.parse(found.scene | {"markers": {"tip": {"body": "arm", "point": [0.6, 0.0, 0.0]}}})
    ours = simulate(scene.with_values(FINE), np.array([0.3]))
    assert ours.ok, ours.message
    assert ours.marker("tip")[0] == pytest.approx(there.site("tip").xpos, abs=1e-6)


def test_limits_and_kept_lengths_become_ropes(tmp_path: Path) -> None:
    found, _ = imported(tmp_path, 'limited="true" range="0 1.9"')
    assert {name: one.get("length") for name, one in found.scene["joints"].items() if one["kind"] == "rope"} == {
        "t-at-most": 1.9
    }
    kept, _ = imported(tmp_path, "", '<equality><tendon tendon1="t"/></equality>')
    assert kept.scene["joints"]["t-length"]["keeps"] == "exactly"
    damped, _ = imported(tmp_path, 'damping="1"')
    assert any("tendon t: between more than two sites; its damping" in line for line in damped.left_out)


BALL = """<mujoco><option gravity="0 0 -9.81" integrator="RK4" timestep="1e-4"/><worldbody>
<body name="arm"><joint name="b" type="ball" stiffness="3" damping=".05"/>
<inertial pos=".3 0 0" mass="1" diaginertia=".02 .02 .02"/><site name="tip" pos=".6 0 0"/></body>
</worldbody></mujoco>"""


def test_a_ball_with_a_spring_and_damping_becomes_a_bushing(tmp_path: Path) -> None:
    mujoco: Any = pytest.importorskip("mujoco")
    (tmp_path / "m.xml").write_text(BALL)
    model = mujoco.MjModel.from_xml_string(BALL)
    there = mujoco.MjData(model)
    mujoco.mj_step(model, there, 3000)
    mujoco.mj_kinematics(model, there)
    found = read(tmp_path / "m.xml")
    assert found.scene["loads"]["b-bushing"]["turn_stiffness"] == 3.0
    assert not any("joint b" in line for line in found.left_out)
    scene = Scene.parse(found.scene | {"markers": {"tip": {"body": "arm", "point": [0.6, 0.0, 0.0]}}})
    ours = simulate(scene.with_values(FINE), np.array([0.3]))
    assert ours.marker("tip")[0] == pytest.approx(there.site("tip").xpos, abs=1e-6)
