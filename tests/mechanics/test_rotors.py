"""Rotors that joints turn, `armature`, and couplings of joints that others carry: closed forms and MuJoCo."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from shoal.engines import get_engine
from shoal.errors import InputError
from shoal.mechanics.analysis.modes import modes
from shoal.mechanics.analysis.reactions import reactions
from shoal.mechanics.simulate import simulate
from shoal.notebook import sweep
from shoal.scene import Scene

FINE = {"solver.integrator": "dop853", "solver.relative_tolerance": 1e-10, "solver.absolute_tolerance": 1e-11}


def body(mass: float, inertia: Any, centre: list[float]) -> dict[str, Any]:
    return {"kind": "rigid-body", "mass": mass, "inertia": inertia, "centre_of_mass": centre}


def joint(first: str, at: list[float], second: str, kind: str = "revolute", **fields: Any) -> dict[str, Any]:
    zeros = [0.0] * len(at)
    return {"kind": kind, "first": {"body": first, "point": at}, "second": {"body": second, "point": zeros}, **fields}


def pendulum(armature: float, swing: float = 0.0) -> Scene:
    """A rod on the ground, in the plane."""
    return Scene.parse({
        "name": "pendulum", "bodies": {"a": body(1.2, 0.05, [0.4, 0.0])},
        "joints": {"O": joint("ground", [0.0, 0.0], "a", armature=armature)},
        "markers": {"tip": {"body": "a", "point": [1.0, 0.0]}}, "initial": {"a": {"angle": -np.pi / 2 + swing}},
    })  # fmt: skip


def test_a_rotor_adds_its_inertia_to_a_pendulum() -> None:
    armature, moment = 0.3, 1.2 * 0.4 * 9.81
    inertia = 0.05 + 1.2 * 0.4**2 + armature
    scene = pendulum(armature, 0.7)
    found = simulate(scene.with_values(FINE), np.array([1.0]))
    way = solve_ivp(
        lambda _, x: [x[1], -moment * np.sin(x[0]) / inertia], (0, 1), [0.7, 0], rtol=1e-11, atol=1e-12
    ).y[0, -1]  # fmt: skip
    assert found.marker("tip")[0] == pytest.approx([np.sin(way), -np.cos(way)], abs=1e-9)
    assert abs(modes(pendulum(armature)).modes[0].eigenvalue) == pytest.approx(np.sqrt(moment / inertia), rel=1e-9)


def chain(dimensions: int, armature: tuple[float, float, float], coupled: Any = None, **more: Any) -> Scene:
    """A hinge on the ground, one on a body that it turns, and a slider on that."""
    z = [0.0] * (dimensions - 2)
    flat = dimensions == 2
    second, along = ({}, {"direction": 0.4}) if flat else ({"axis": [1.0, 0.2, 0.5]}, {"axis": [1.0, 0.2, 0.5]})
    turned = {"angle": 0.6, "rate": -1.0} if flat else {"angle": 0.6}
    inertia = 0.02 if flat else [0.02, 0.03, 0.015]
    coupling = {} if coupled is None else {"T": {"kind": "coupling", "terms": coupled}}
    return Scene.parse({
        "name": "chain", "dimensions": dimensions, "gravity": [0.3, -9.81, *z],
        "bodies": {"a": body(1.0, inertia, [0.2, 0.1, *z]), "b": body(0.5, inertia, [0.1, 0.02, *z]),
                   "c": body(0.3, inertia, [0.05, 0.03, *z])},
        "joints": {"one": joint("ground", [0.0, 0.0, *z], "a", armature=armature[0]),
                   "two": joint("a", [0.4, 0.0, *z], "b", armature=armature[1], friction=0.02, **second),
                   "bar": joint("b", [0.2, 0.0, *z], "c", "slider", armature=armature[2], rotation="locked", **along),
                   **coupling},
        "markers": {"c": {"body": "c", "point": [0.1, 0.0, *z]}, "b": {"body": "b", "point": [0.2, 0.1, *z]}},
        "initial": {"a": {"angle": 0.2, "rate": 0.5}, "b": turned, "c": turned},
        "solver": {"duration": 0.4, "step": 1e-4},
    } | more)  # fmt: skip


@pytest.mark.parametrize("dimensions", [2, 3])
@pytest.mark.parametrize("armature", [(0.05, 0.0, 0.0), (0.0, 0.04, 0.0), (0.0, 0.0, 0.2), (0.03, 1e-7, 0.4)])
def test_rotors_of_joints_that_others_carry_move_as_in_mujoco(dimensions: int, armature: Any) -> None:
    pytest.importorskip("mujoco")
    scene, times = chain(dimensions, armature), np.array([0.2, 0.4])
    ours, theirs = simulate(scene.with_values(FINE), times), get_engine("mujoco").simulate(scene, times)
    assert ours.ok, ours.message
    assert ours.energy_drift[0] < 1e-6
    for name in scene.markers:
        assert ours.marker(name) == pytest.approx(theirs.marker(name), abs=1e-8)


@pytest.mark.parametrize("dimensions", [2, 3])
def test_reactions_balance_with_rotors(dimensions: int) -> None:
    """Bodies and the rotors' own torques; without these a hundredth of all forces would be left."""
    found = reactions(chain(dimensions, (0.05, 0.04, 0.3)), [0.1])[0]
    assert found.ok, found.message
    assert found.unbalanced < 1e-9


def test_a_rotor_between_the_ground_and_a_body_needs_no_unknowns() -> None:
    count = [simulate(pendulum(armature), np.array([0.0])).model["unknowns"] for armature in (0.0, 0.3)]
    assert count[0] == count[1]


STIFF = 'solref="2e-4 1" solimp="0.99999 0.99999 0.001 0.5 2"'
COUPLED = {
    "gear-on-a-body-that-moves": ([("two", 1.0), ("one", 2.0)], 'joint1="two" joint2="one" polycoef="0 -2 0 0 0"'),
    "rack": ([("bar", 1.0), ("two", -0.1)], 'joint1="bar" joint2="two" polycoef="0 .1 0 0 0"'),
    "fraction": ([("two", 0.6), ("one", -0.45)], 'joint1="two" joint2="one" polycoef="0 .75 0 0 0"'),
    "any-ratio": (
        [("two", 1.0), ("one", 2.0**0.5)],
        'joint1="two" joint2="one" polycoef="0 -1.4142135623730951 0 0 0"',
    ),
    "rack-and-gear": (
        [("bar", 1.0), ("two", -0.1), ("one", -0.07)],
        None,
    ),
    "held": ([("two", 1.0)], 'joint1="two" polycoef="0 0 0 0 0"'),
}


@pytest.mark.parametrize("name", COUPLED)
def test_a_coupling_holds_joints_as_in_mujoco(name: str) -> None:
    mujoco: Any = pytest.importorskip("mujoco")
    terms, equality = COUPLED[name]
    tendon, held = "", f"<joint {equality} {STIFF}/>"
    if equality is None:
        joints = "".join(f'<joint joint="{one}" coef="{factor}"/>' for one, factor in terms)
        tendon, held = f'<tendon><fixed name="t">{joints}</fixed></tendon>', f'<tendon tendon1="t" {STIFF}/>'
    still = {"angle": 0.0}
    shares = [{"of": f"{'slide' if one == 'bar' else 'angle'}({one})", "factor": factor} for one, factor in terms]
    scene = chain(3, (0.0, 0.01, 0.0), shares, initial={"a": still, "b": still, "c": still})
    found = simulate(scene.with_values(FINE), np.array([0.3]))
    assert found.ok, found.message
    model = mujoco.MjModel.from_xml_string(f"""<mujoco><option gravity=".3 -9.81 0" integrator="RK4" timestep="1e-4"/>
      <worldbody><body><joint name="one" axis="0 0 1"/><inertial pos=".2 .1 0" mass="1" diaginertia=".02 .03 .015"/>
      <body pos=".4 0 0"><joint name="two" axis="1 .2 .5" armature=".01" damping=".02"/>
      <inertial pos=".1 .02 0" mass=".5" diaginertia=".02 .03 .015"/><body pos=".2 0 0">
      <joint name="bar" type="slide" axis="1 .2 .5"/><inertial pos=".05 .03 0" mass=".3" diaginertia=".02 .03 .015"/>
      <site name="c" pos=".1 0 0"/></body></body></body></worldbody>
      {tendon}<equality>{held}</equality></mujoco>""")
    there = mujoco.MjData(model)
    mujoco.mj_step(model, there, 3000)
    mujoco.mj_kinematics(model, there)
    assert found.marker("c")[0] == pytest.approx(there.site("c").xpos, abs=1e-6)


def test_a_gear_that_turns_whole_turns_stays_in_mesh() -> None:
    """Three turns of the first, on a body that is carried: the second has turned by 2/3 of that."""
    spin = 40.0
    data = {
        "name": "gears", "dimensions": 3, "gravity": [0.0, 0.0, 0.0],
        "bodies": {name: body(1.0, [0.02, 0.02, 0.01], [0.0, 0.0, 0.0]) for name in ("carrier", "one", "two")},
        "joints": {"base": joint("ground", [0.0, 0.0, 0.0], "carrier", axis=[1.0, 0.0, 0.0]),
                   "p": joint("carrier", [0.0, 0.1, 0.0], "one"), "q": joint("carrier", [0.0, -0.1, 0.0], "two"),
                   "T": {"kind": "coupling",
                         "terms": [{"of": "angle(p)", "factor": 2}, {"of": "angle(q)", "factor": -3}]}},
        "markers": {"one": {"body": "one", "point": [1.0, 0.0, 0.0]}, "two": {"body": "two", "point": [1.0, 0.0, 0.0]}},
        "initial": {"one": {"spin": [0.0, 0.0, spin]}, "two": {"spin": [0.0, 0.0, spin * 2 / 3]}},
    }  # fmt: skip
    time = 6 * np.pi / spin + 0.01
    found = simulate(Scene.parse(data).with_values(FINE), np.array([time]))
    assert found.ok, found.message
    for name, rate, y in (("one", spin, 0.1), ("two", spin * 2 / 3, -0.1)):
        assert found.marker(name)[0] == pytest.approx([np.cos(rate * time), y + np.sin(rate * time), 0.0], abs=1e-6)


def test_engines_without_rotors_refuse_them() -> None:
    with pytest.raises(InputError, match=r"joints.O.armature: engine tree cannot do armature; use gauss or mujoco"):
        get_engine("tree").simulate(pendulum(0.1))


def test_lanes_have_rotors_of_their_own() -> None:
    """None of them, in a batch with others, is as a scene without."""
    values = [0.0, 0.1, 0.3]
    scene = pendulum(0.1, 0.5)
    swept = sweep(scene, {"joints.O.armature": values}, 0.2).positions["tip"]
    alone = [simulate(pendulum(one, 0.5), np.array([0.2])).marker("tip")[0] for one in values]
    assert swept == pytest.approx(np.array(alone), abs=1e-6)
