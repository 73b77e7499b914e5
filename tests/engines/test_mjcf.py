"""Scenes as MJCF: MuJoCo moves them as the native solver does, and so does what is read back."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from shoal.engines.contract import sampling_times
from shoal.engines.mujoco.engine import MujocoEngine, stepped
from shoal.engines.mujoco.mjcf import Mjcf
from shoal.errors import InputError
from shoal.imported import read
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene, load_scene
from shoal.scene.load import scene_names

mujoco: Any = pytest.importorskip("mujoco")

HELD = {"body": "ground", "point": [0.0, 0.0, 0.0]}
LINK = {"kind": "rigid-body", "mass": 1.5, "inertia": [[0.05, 0.01, 0], [0.01, 0.2, 0], [0, 0, 0.22]],
        "centre_of_mass": [0.4, 0.1, 0.05], "named_points": {"end": [0.8, 0.0, 0.1]}}  # fmt: skip
SOLVER = {"integrator": "dop853", "relative_tolerance": 1e-11, "duration": 0.4, "samples": 4, "step": 5e-4}
PLANE = {"kind": "rigid-body", "mass": 1.0, "inertia": 0.1, "centre_of_mass": [0.4, 0.1],
         "named_points": {"end": [0.8, 0.0]}}  # fmt: skip


def end(name: str) -> dict[str, Any]:
    return {"body": name, "point": "end"}


def machine(joint: dict[str, Any], **more: Any) -> Scene:
    """A joint between two links in space, the first on a ball; at rates."""
    return Scene.parse({
        "name": "of-a-test", "dimensions": 3, "gravity": [0.5, 0.0, -9.81], "solver": SOLVER,
        "bodies": {"A": LINK, "B": LINK} | more.pop("bodies", {}),
        "joints": {"S": {"kind": "spherical", "first": HELD, "second": {"body": "A"}}, "J": joint},
        "markers": {name: {"body": name, "point": "end"} for name in "AB"},
        "initial": {"A": {"rotation": [0.3, 0.2, 0.5], "spin": [1, -2, 3]}} | more.pop("initial", {}), **more,
    })  # fmt: skip


def joined(**fields: Any) -> dict[str, Any]:
    return {"first": end("A"), "second": {"body": "B"}, **fields}


def turned(**fields: Any) -> dict[str, Any]:
    """From the child to its parent."""
    return {"first": {"body": "B"}, "second": end("A"), **fields}


JOINTS = {
    "hinge": joined(axis=[1, 2, 0], friction=0.3),
    "universal": joined(kind="universal", axis=[1, 0, 0], second_axis=[0, 1, 1]),
    "universal-back": turned(kind="universal", axis=[1, 0, 0], second_axis=[0, 1, 1]),
    "cylindrical": joined(kind="cylindrical", axis=[0, 1, 1]),
    "cylindrical-back": turned(kind="cylindrical", axis=[0, 1, 1]),
    "planar": joined(kind="planar", axis=[0.3, 1, 1]),
    "planar-back": turned(kind="planar", axis=[0.3, 1, 1]),
    "planar-free": joined(kind="planar", axis=[0, 0, 1], rotation="free"),
    "planar-locked": joined(kind="planar", axis=[0, 0, 1], rotation="locked"),
    "slider": joined(kind="slider", axis=[1, 0, 1], friction=0.2),
    "slider-back": turned(kind="slider", axis=[1, 0, 1], friction=0.2),
    "slider-locked": joined(kind="slider", axis=[1, 0, 1], rotation="locked", friction=0.2),
    "weld": joined(kind="weld"),
}

LOADED = machine(
    joined(axis=[0, 1, 0]),
    bodies={"M": {"kind": "point-mass", "mass": 0.3}, "F": LINK},
    loads={
        "spiral": {"kind": "torsion-spring", **joined(axis=[0, 1, 0], stiffness=4.0, damping=0.1)},
        "coil": {"kind": "spring", "first": end("B"), "second": {"body": "M"}, "stiffness": 30.0, "damping": 0.2,
                 "length": 0.3},
        "push": {"kind": "force", "at": end("B"), "force": [1.0, 2.0, 0.5], "scale": 2.0},
        "jet": {"kind": "force", "at": end("F"), "force": [1.0, 0.0, 3.0], "follows": True},
        "motor": {"kind": "torque", "at": {"body": "B"}, "torque": 0.7, "axis": [0, 1, 0], "reaction": {"body": "A"}},
        "twist": {"kind": "torque", "at": {"body": "F"}, "torque": -0.4, "axis": [1, 1, 0]},
    },
    initial={"M": {"position": [1.0, 0.5, 0.2], "velocity": [0.0, 1.0, 0.0]},
             "F": {"position": [3.0, 0.0, 0.0], "rotation": [0.3, 0.0, 1.0], "spin": [1.0, 2.0, 0.0],
                   "velocity": [0.0, 0.0, 2.0]}},
    markers={"M": {"body": "M"}, "F": end("F"), "A": end("A"), "B": end("B")},
)  # fmt: skip

FLAT = Scene.parse({
    "name": "flat", "solver": SOLVER,
    "bodies": {"A": PLANE, "B": PLANE, "F": PLANE, "M": {"kind": "point-mass", "mass": 0.3}},
    "joints": {
        "O": {"first": {"body": "ground", "point": [0, 0]}, "second": {"body": "A"}},
        "R": {"kind": "slider", "first": end("A"), "second": {"body": "B"}, "direction": 0.4, "friction": 0.1},
    },
    "loads": {
        "spiral": {"kind": "torsion-spring", "first": {"body": "A"}, "second": {"body": "ground", "point": [0, 0]},
                   "stiffness": 5.0, "angle": 0.3},
        "coil": {"kind": "spring", "first": end("B"), "second": {"body": "F"}, "stiffness": 10.0},
        "motor": {"kind": "torque", "at": {"body": "A"}, "torque": 0.5},
    },
    "markers": {"A": end("A"), "B": end("B"), "F": end("F"), "M": {"body": "M"}},
    "initial": {"A": {"angle": 0.4, "rate": 1.0}, "F": {"position": [2.0, 0.0], "angle": 1.0, "rate": -2.0},
                "M": {"position": [0.0, 2.0], "velocity": [1.0, 1.0]}},
})  # fmt: skip


def distances(scene: Scene, folder: Path) -> tuple[float, float]:
    """How far MuJoCo's motion is from the native one at most, and how far that of what is read back [m]."""
    text, times = stepped(scene), sampling_times(scene, None)
    theirs, ours = MujocoEngine().run(text, times), simulate(scene, times)
    assert theirs.ok, theirs.message
    assert ours.ok, ours.message
    path = folder / "machine.xml"
    path.write_text(text.text)
    found = read(path)
    numerics = ("<option>: integrator, iterations, timestep, tolerance (", "<flag>: energy (", "<tendon>: ")
    soft = tuple(f"<{kind}>: " for kind in ("connect", "weld", "joint"))
    assert not found.missing
    assert all(line.startswith(("geoms: ", *numerics, *soft)) for line in found.left_out), found.left_out
    back = simulate(Scene.parse({**found.scene, "solver": scene.solver.model_dump()}), times)
    assert back.ok, back.message
    away = 0.0
    for name in scene.markers:
        own = f"site-{name}" if f"site-{name}" in back.markers else name
        away = max(away, float(np.max(np.abs(back.marker(own)[:, : scene.dimensions] - ours.marker(name)))))
    return theirs.distance(ours), away


@pytest.mark.parametrize("kind", JOINTS)
@pytest.mark.by_day(3)
def test_every_joint_moves_as_in_the_native_solver_there_and_back(kind: str, tmp_path: Path) -> None:
    theirs, back = distances(machine(JOINTS[kind]), tmp_path)
    assert theirs < 1e-8
    assert back < 1e-9


def test_dry_friction_sticks_in_mujoco_and_creeps_here(tmp_path: Path) -> None:
    """The nearer, the slower it creeps; what is read back creeps as usual."""
    far, back = distances(machine({**JOINTS["hinge"], "coulomb": 0.3}), tmp_path)
    near, _ = distances(machine({**JOINTS["hinge"], "coulomb": 0.3, "coulomb_speed": 1e-3}), tmp_path)
    assert back < 1e-9
    assert far < 5e-4
    assert near < 0.2 * far


@pytest.mark.parametrize("scene", [LOADED, FLAT], ids=["space", "plane"])
def test_loads_and_free_bodies(scene: Scene, tmp_path: Path) -> None:
    theirs, back = distances(scene, tmp_path)
    assert theirs < 1e-8
    # What several joints of one body have between them weighs 1.5e-8 of the body when it is read back.
    assert back < 5e-8


SOFT = {"parallelogram": 5e-3, "n-four-bar-2": 2e-3, "spherical-pendulum": 1e-3, "n-four-bar-40": 1e-3}
"""How far soft constraints let them part."""
FAST = "andrews-squeezer", "rigid-double-pendulum", "ibm-double-pendulum", "equal-slider-crank", "spherical-pendulum"
FLEXIBLE = [
    name
    for name in scene_names()
    if any(getattr(body, "element", "rigid") != "rigid" for body in load_scene(name).bodies.values())
]
RIGID = [name for name in scene_names() if name not in FLEXIBLE]


@pytest.mark.parametrize(
    "name", [name if name in FAST else pytest.param(name, marks=pytest.mark.slow) for name in RIGID]
)
@pytest.mark.by_day(2)
def test_built_in_scenes(name: str, tmp_path: Path) -> None:
    theirs, back = distances(load_scene(name), tmp_path)
    assert theirs < SOFT.get(name, 2e-5)
    assert back < 1e-8


@pytest.mark.parametrize("name", FLEXIBLE)
def test_flexible_rods_are_refused(name: str) -> None:
    kinds = "ancf-cable|modal|director-rod"
    with pytest.raises(InputError, match=rf"bodies\.\w+\.element: MJCF has no ({kinds}); rigid bodies only$"):
        Mjcf(load_scene(name))


def test_soft_loops_close_better_with_shorter_steps() -> None:
    apart = []
    for step in (1e-3, 2.5e-4):
        scene = load_scene("n-four-bar-2").with_values({"solver.duration": 1.0, "solver.step": step})
        times = sampling_times(scene, None)
        machine = Mjcf(scene)
        assert machine.soft == ["joints.C1", "joints.C2"]
        assert "constraints of MuJoCo are soft" in machine.text
        apart.append(MujocoEngine().run(machine, times).distance(simulate(scene, times)))
    assert apart[1] < 0.3 * apart[0]


def test_stiff_dampers_take_shorter_steps() -> None:
    assert stepped(load_scene("flyball-governor")).scene.solver.step == pytest.approx(1.25e-4)


def test_numbers_are_those_of_the_scene() -> None:
    """Each to the last bit."""
    model = mujoco.MjModel.from_xml_string(Mjcf(LOADED).text)
    assert model.body("A").mass[0] == 1.5
    assert tuple(model.opt.gravity) == (0.5, 0.0, -9.81)
    assert model.opt.timestep == 5e-4
    assert np.ravel(model.tendon_stiffness[0])[0] == 30.0


LOOP = {"first": {"body": "B", "point": "end"}, "second": {"body": "ground", "point": [1.0, 0.0]}}
BASE: dict[str, Any] = {
    "name": "refused", "bodies": {"A": PLANE, "B": PLANE}, "markers": {"B": end("B")},
    "joints": {"O": {"first": {"body": "ground", "point": [0, 0]}, "second": {"body": "A"}},
               "P": {"first": end("A"), "second": {"body": "B"}}},
}  # fmt: skip


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"joints": {"D": {"kind": "driven-angle", "angle": "t", "first": {"body": "A"}, "second": {"body": "B"}}}},
         "joints.D: MJCF has no driven-angle"),
        ({"joints": {"D": {"kind": "distance", "length": "1 + t", **LOOP}}},
         "joints.D.length: MJCF has no functions of time"),
        ({"joints": {"D": {"friction": 0.1, **LOOP}}},
         "joints.D.friction: MJCF has none in a joint that closes a loop"),
        ({"loads": {"F": {"kind": "force", "at": end("B"), "force": [1, 0], "scale": "sin(t)"}}},
         "loads.F.scale: MJCF has no functions of time"),
        ({"loads": {"F": {"kind": "spring", "cubic": 2.0, **LOOP}}}, "loads.F.cubic: MJCF has linear springs only"),
        ({"loads": {"F": {"kind": "torsion-spring", "stiffness": 2.0, **LOOP}}},
         "loads.F: MJCF has torsion springs in revolute joints only, about their axis"),
        ({"joints": {"P": {"first": end("A"), "second": {"body": "B"}, "stops": {"max": 3.0}}}},
         "joints.P.stops: not written as MJCF"),
        ({"joints": {"D": {"kind": "distance", "keeps": "at-most", **LOOP}}}, "joints.D.keeps: not written as MJCF"),
        ({"contacts": {"C": {"first": end("B"), "second": {"body": "ground", "line": 0.0}}}},
         "contacts.C: not written as MJCF"),
        ({"ground_points": {"P": {"x": "t"}}}, "ground_points.P: MJCF has no functions of time"),
    ],
)  # fmt: skip
def test_what_mjcf_has_not_is_named(fields: dict[str, Any], message: str) -> None:
    data = {**BASE, **{key: {**BASE.get(key, {}), **value} for key, value in fields.items()}}
    with pytest.raises(InputError) as refused:
        Mjcf(Scene.parse(data).with_values({"solver.step": 1e-3}))
    assert str(refused.value).startswith(message)
