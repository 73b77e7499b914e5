"""Forces and torques of joints in space: closed forms of shafts, pendulums and rods, and the plane."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from shoal.mechanics.analysis.evaluate import Evaluator
from shoal.mechanics.analysis.joint_reactions import Reactions
from shoal.mechanics.analysis.reactions import reactions
from shoal.mechanics.analysis.sections import SpatialSections, sections
from shoal.mechanics.analysis.statics import statics
from shoal.scene import Scene, load_scene

GROUND = {"body": "ground", "point": [0.0, 0.0, 0.0]}
FINE = {"integrator": "dop853", "relative_tolerance": 1e-11, "absolute_tolerance": 1e-12}


def scene(**parts: Any) -> Scene:
    return Scene.parse({"name": "test", "dimensions": 3, "gravity": [0, 0, 0], "solver": FINE, **parts})


def once(given: Scene, time: float = 0.0) -> Reactions:
    """The reactions at one time, which have to balance."""
    (found,) = reactions(given, [time])
    assert found.ok
    return found


def test_an_unbalanced_shaft_pulls_at_its_bearing_as_euler_says() -> None:
    """A body at a constant spin w about an axis off its principal ones: F = -m w^2 r, M = w x I w + r x F."""
    inertia = np.array([[0.3, 0.05, -0.04], [0.05, 0.4, 0.03], [-0.04, 0.03, 0.5]])
    spin, centre = np.array([0.0, 0.0, 7.0]), np.array([0.1, -0.2, 0.3])
    shaft = {"kind": "rigid-body", "mass": 2.0, "inertia": inertia.tolist(), "centre_of_mass": centre.tolist()}
    given = scene(
        bodies={"B": shaft}, initial={"B": {"spin": spin.tolist()}}, markers={"o": {"body": "B"}},
        joints={"J": {"kind": "revolute", "first": GROUND, "second": {"body": "B"}}},
    )  # fmt: skip
    found = once(given).joints["J"]
    force = 2.0 * np.cross(spin, np.cross(spin, centre))
    torque = np.cross(spin, inertia @ spin) + np.cross(centre, force)
    # The torque about the axis turns the body; the bearing bears the other two.
    assert found.force == pytest.approx(force, abs=1e-9)
    assert found.torque == pytest.approx([torque[0], torque[1], 0.0], abs=1e-9)
    assert found.unique


def test_a_driven_hinge_holds_nothing_twice() -> None:
    """The model holds the cosine and the sine of the angle of a body whose director is of unit length: one for all."""
    sides = {"first": {"body": "ground", "point": [0.0, 0.0, 0.0]}, "second": {"body": "B"}, "axis": [1.0, 0.0, 0.0]}
    scene = Scene.parse({
        "name": "shaft", "dimensions": 3, "gravity": [0.0, 0.0, 0.0],
        "bodies": {"B": {"kind": "rigid-body", "mass": 1.0, "inertia": [0.1, 0.2, 0.3]}},
        "joints": {"h": {"kind": "revolute", **sides}, "d": {"kind": "driven-angle", **sides, "angle": "3*t"}},
        "markers": {"m": {"body": "B"}},
    })  # fmt: skip
    (found,) = reactions(scene)
    assert found.redundancy == 0
    assert found.constraints == ()
    assert found.not_unique == ()


def test_a_conical_pendulum_pulls_along_its_rod() -> None:
    """Speed so that the angle stays: m g tan a = m w^2 L sin a; the pull is m g / cos a."""
    angle, length, g = 0.6, 1.3, 9.81
    turn = math.sqrt(g / (length * math.cos(angle)))
    place = [length * math.sin(angle), 0.0, -length * math.cos(angle)]
    given = scene(
        gravity=[0, 0, -g], bodies={"P": {"kind": "point-mass", "mass": 2.0}}, markers={"p": {"body": "P"}},
        joints={"D": {"kind": "distance", "first": GROUND, "second": {"body": "P"}}},
        initial={"P": {"position": place, "velocity": [0.0, turn * place[0], 0.0]}},
    )  # fmt: skip
    found = once(given, 0.7).joints["D"]
    assert np.linalg.norm(found.force) == pytest.approx(2.0 * g / math.cos(angle), rel=1e-9)
    assert found.components["axial"] == pytest.approx(-2.0 * g / math.cos(angle), rel=1e-9)


def test_planar_machines_bear_in_space_what_they_bear_in_the_plane(many_joints: dict[str, Any]) -> None:
    four_bar = load_scene("equal-slider-crank").model_dump(mode="json", exclude_unset=True)
    for data in (many_joints, four_bar):
        plane, space = (once(Scene.parse({**data, "dimensions": d, "solver": FINE}), 0.2) for d in (2, 3))
        largest = max(np.abs(one.force).max() for one in plane.joints.values())
        for name, flat in plane.joints.items():
            solid = space.joints[name]
            if not flat.unique:
                continue
            assert solid.force[:2] == pytest.approx(flat.force, abs=1e-7 * largest), name
            assert solid.torque[2] == pytest.approx(flat.torque, abs=1e-7 * largest), name
            assert solid.force[2] == pytest.approx(0.0, abs=1e-7 * largest)


@pytest.mark.parametrize(
    ("kind", "more"),
    [("weld", {}), ("revolute", {"axis": [0, 0, 1]}), ("slider", {"axis": [1, 0, 0], "rotation": "locked"})],
)
def test_joints_of_space_bear_the_weight_of_an_arm(kind: str, more: dict[str, Any]) -> None:
    """An arm that its joint keeps at rest: the balance of forces, and of torques about the joint."""
    arm = {"kind": "rigid-body", "mass": 2.0, "inertia": 0.1, "centre_of_mass": [0.5, 0.2, 0.1]}
    weight = np.array([0, 0, 2.0 * 9.81])
    given = scene(
        gravity=[0, 0, -9.81], bodies={"A": arm}, markers={"o": {"body": "A"}},
        joints={"J": {"kind": kind, "first": GROUND, "second": {"body": "A"}, **more}},
    )  # fmt: skip
    found = once(given).joints["J"]
    assert found.force == pytest.approx(weight, abs=1e-9)
    assert found.torque == pytest.approx(np.cross([0.5, 0.2, 0.1], weight), abs=1e-9)


def test_a_clamped_rod_bears_the_moment_of_its_load_where_it_has_bent_to() -> None:
    """A director rod on a turned hub at rest: its clamp bears the force and r x F, about both axes and in torsion."""
    turn = Rotation.from_rotvec([0.3, 0.2, -0.5])
    pose = {"rotation": turn.as_rotvec().tolist()}
    force = np.array([0.3, -2.0, 1.5])
    rod = {"kind": "rod", "length": 1.0, "height": 0.02, "width": 0.01, "density": 1000.0, "youngs_modulus": 1e9,
           "element": "director-rod", "elements": 6, "curvature": [1.0], "director": "z"}  # fmt: skip
    given = scene(
        bodies={"hub": {"kind": "rigid-body", "mass": 1.0, "inertia": 0.1}, "B": rod},
        joints={"H": {"kind": "weld", "first": GROUND, "second": {"body": "hub"}},
                "W": {"kind": "weld", "first": {"body": "hub"}, "second": {"body": "B"}}},
        loads={"P": {"kind": "force", "at": {"body": "B", "point": "end"}, "force": force.tolist()}},
        markers={"e": {"body": "B", "point": "end"}}, initial={"hub": pose, "B": pose},
    )  # fmt: skip
    found = statics(given)
    assert found.ok
    assert found.reactions is not None
    moment = np.cross(found.marker("e"), -force)
    for name in ("H", "W"):
        assert found.reactions.joints[name].force == pytest.approx(-force, abs=1e-6)
        assert found.reactions.joints[name].torque == pytest.approx(moment, abs=1e-6)


def test_what_a_loop_holds_twice_is_not_unique() -> None:
    """A door on two hinges: the force along their axis may be shared in any way, its sum is the weight."""
    door = {"kind": "rigid-body", "mass": 3.0, "inertia": 0.5, "centre_of_mass": [0.5, 0.0, 1.0],
            "named_points": {"up": [0.0, 0.0, 2.0]}}  # fmt: skip
    top = {"body": "ground", "point": [0.0, 0.0, 2.0]}
    given = scene(
        gravity=[0, 0, -9.81], bodies={"D": door}, markers={"u": {"body": "D", "point": "up"}},
        joints={"low": {"kind": "revolute", "first": GROUND, "second": {"body": "D"}},
                "high": {"kind": "revolute", "first": top, "second": {"body": "D", "point": "up"}}},
    )  # fmt: skip
    found = once(given)
    assert found.redundancy == 5
    assert set(found.not_unique) == {"low", "high"}
    total = np.add(*(found.joints[name].force for name in ("low", "high")))
    assert total == pytest.approx([0.0, 0.0, 3.0 * 9.81], abs=1e-9)


@pytest.mark.parametrize(
    ("element", "more"),
    [
        ("ancf-cable", {}),
        ("ancf-quintic", {}),
        ("director-rod", {"width": 0.006}),
        ("director-rod", {"width": 0.006, "curvature": [0.5], "twist": [1.0]}),
    ],
)
@pytest.mark.by_day(2)
def test_section_forces_balance_the_loads_beyond_the_section(element: str, more: dict[str, Any]) -> None:
    """A cantilever under its weight, a force and a torque at its end: the law of the lever, on any mesh."""
    force, torque, gravity = np.array([0.3, -2.0, 1.5]), np.array([0.05, 0.02, -0.03]), np.array([0.0, 1.0, -9.0])
    end = {"body": "B", "point": "end"}
    loads: dict[str, Any] = {"P": {"kind": "force", "at": end, "force": force.tolist()}}
    if element == "director-rod":
        size = float(np.linalg.norm(torque))
        loads["M"] = {"kind": "torque", "at": end, "axis": torque.tolist(), "torque": size}
    else:
        torque = np.zeros(3)
    rod = {"kind": "rod", "length": 1.0, "height": 0.01, "width": 0.01, "density": 2700.0, "youngs_modulus": 7e9,
           "element": element, "elements": 8}  # fmt: skip
    heavy = scene(
        gravity=gravity.tolist(),
        bodies={"B": rod | more},
        joints={"W": {"kind": "weld", "first": GROUND, "second": {"body": "B"}}},
        loads=loads,
        markers={f"m{k}": {"body": "B", "point": [k / 8, 0.0]} for k in range(9)},
    )
    found = statics(heavy)
    assert found.ok, found.message
    evaluator, rest = Evaluator.of(heavy), np.zeros_like(found.q)
    cut = sections(evaluator, found.q, rest, rest, 0.0, "B")
    assert isinstance(cut, SpatialSections)
    body = heavy.bodies["B"]
    np.testing.assert_allclose(cut.force, force + np.outer(body.mass * (1 - cut.s), gravity), atol=1e-8)
    assert cut.moment[-1] == pytest.approx(torque, abs=1e-8)
    assert cut.torque[-1] == pytest.approx(cut.tangent[-1] @ torque, abs=1e-8)
    assert found.reactions is not None
    held = found.reactions.joints["W"]
    assert -cut.force[0] == pytest.approx(held.force, abs=1e-7)
    assert -cut.moment[0] == pytest.approx(held.torque, abs=1e-6)
    light = heavy.with_values({"gravity": [0.0, 0.0, 0.0]})
    weightless = statics(light)
    cut = sections(Evaluator.of(light), weightless.q, rest, rest, 0.0, "B")
    lever = weightless.points[-1] - weightless.points[np.repeat(np.arange(9), 2)[1:-1]]
    np.testing.assert_allclose(cut.moment, torque + np.cross(lever, force), atol=1e-7)
