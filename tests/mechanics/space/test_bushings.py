"""Bushings in space: springs and dampers of displacements and turns, against MuJoCo and closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from shoal.errors import InputError
from shoal.mechanics.analysis.modes import modes
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene

FINE = {"solver.integrator": "dop853", "solver.relative_tolerance": 1e-10, "solver.absolute_tolerance": 1e-11}
ORIGIN = {"body": "ground", "point": [0.0, 0.0, 0.0]}

AT = {"body": "a", "point": [0.0, 0.0, 0.0]}
BALL = {"o": {"kind": "spherical", "first": ORIGIN, "second": AT}}


def solid(name: str = "a") -> dict[str, Any]:
    return {
        name: {"kind": "rigid-body", "mass": 1.0, "inertia": [0.02, 0.03, 0.015], "centre_of_mass": [0.2, 0.1, 0.05]}
    }


def hung(joints: dict[str, Any], **bushing: Any) -> Scene:
    return Scene.parse({
        "name": "hung", "dimensions": 3, "gravity": [0.3, 0.0, -9.81], "bodies": solid(), "joints": joints,
        "loads": {"b": {"kind": "bushing", "first": ORIGIN, "second": AT} | bushing},
        "markers": {"tip": {"body": "a", "point": [0.5, 0.2, -0.1]}},
        "initial": {"a": {"position": [0.0, 0.0, 0.0], "spin": [1.0, -2.0, 3.0]}}, "solver": {"duration": 0.5},
    })  # fmt: skip


CENTRE = [0.2, 0.1, 0.05]


def mujocos(joint: str, time: float) -> Any:
    """Where MuJoCo's marker is."""
    mujoco: Any = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string(f"""<mujoco><option gravity=".3 0 -9.81" integrator="RK4" timestep="5e-5"/>
      <worldbody><body name="a">{joint}<inertial pos=".2 .1 .05" mass="1" diaginertia=".02 .03 .015"/>
      <site name="tip" pos=".5 .2 -.1"/></body></worldbody></mujoco>""")
    data = mujoco.MjData(model)
    data.qvel[-3:] = [1.0, -2.0, 3.0]
    mujoco.mj_step(model, data, round(time / 5e-5))
    mujoco.mj_kinematics(model, data)
    return data.site("tip").xpos.copy()


@pytest.mark.parametrize(("stiffness", "damping"), [(4.0, 0.0), (0.0, 0.05), (6.0, 0.03)])
def test_a_ball_with_spring_and_damping_is_mujocos(stiffness: float, damping: float) -> None:
    """Turns of more than a right angle: the torque grows with the angle, not with its sine."""
    scene = hung(BALL, turn_stiffness=stiffness, turn_damping=damping)
    found = simulate(scene.with_values(FINE), np.array([0.5]))
    assert found.ok, found.message
    there = mujocos(f'<joint type="ball" stiffness="{stiffness}" damping="{damping}"/>', 0.5)
    assert found.marker("tip")[0] == pytest.approx(there, abs=1e-6)


def test_small_motions_of_a_free_body_have_six_frequencies() -> None:
    """At its centre of mass, of principal axes: sqrt(k/m) along and sqrt(K/J) about each."""
    stiffness, turn = [100.0, 200.0, 300.0], 2.0
    at = {"body": "a", "point": CENTRE}
    scene = hung({}, stiffness=stiffness, turn_stiffness=turn, second=at, first={"body": "ground", "point": CENTRE})
    scene = scene.with_values({"gravity": [0.0, 0.0, 0.0], "initial.a.spin": [0.0, 0.0, 0.0]})
    found = sorted(abs(one.eigenvalue) for one in modes(scene, count=6).modes)
    exact = sorted([*np.sqrt(stiffness), *np.sqrt(turn / np.array([0.02, 0.03, 0.015]))])
    assert found == pytest.approx(exact, rel=1e-6)


def test_a_turn_beyond_half_a_turn_is_told() -> None:
    scene = hung(BALL, turn_damping=1e-3).with_values({"initial.a.spin": [0.0, 0.0, 20.0]})
    found = simulate(scene, np.array([0.5]))
    assert not found.ok
    assert "the turn reaches half a turn" in found.message


@pytest.mark.parametrize(("fields", "message"), [
    ({"stiffness": [1.0, 2.0]}, "loads.b.stiffness"),
    ({"turn_stiffness": -1.0}, "loads.b.turn_stiffness"),
])  # fmt: skip
def test_wrong_bushings_are_refused_by_their_field(fields: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        hung(BALL, **fields)
