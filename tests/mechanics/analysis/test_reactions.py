"""Joint forces against closed forms, redundancy by name, and section forces of a rod."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from shoal.errors import ComputationError, InputError
from shoal.mechanics.analysis.evaluate import Evaluator
from shoal.mechanics.analysis.joint_reactions import reactions_of
from shoal.mechanics.analysis.modes import modes
from shoal.mechanics.analysis.reactions import reactions, states
from shoal.mechanics.analysis.sections import sections
from shoal.mechanics.analysis.statics import statics
from shoal.scene import Scene, load_scene

GROUND = {"body": "ground", "point": [0.0, 0.0]}


def test_swinging_mass_pulls_with_three_times_its_weight_at_most() -> None:
    # Released from the horizontal: tension 3 m g cos(phi), phi from hanging.
    scene = load_scene("single-pendulum")
    evaluator, found = states(scene, [0.0, 0.2, 0.5])
    for state in found:
        (joint,) = reactions_of(evaluator, state.q, state.v, state.a, state.time).joints.values()
        out = np.array([state.q[0], state.q[1]])
        tension = 3 * 9.81 * -out[1]
        np.testing.assert_allclose(joint.force, -tension * out, atol=1e-8)
        assert joint.unique


def test_friction_of_a_spinning_rod_is_part_of_its_reaction() -> None:
    rod = {"kind": "rod", "length": 2.0, "height": 0.01, "width": 0.1, "density": 500.0}
    scene = Scene.parse(
        {
            "name": "spinner",
            "gravity": [0.0, 0.0],
            "bodies": {"rod": rod},
            "joints": {"O": {"first": GROUND, "second": {"body": "rod"}, "friction": 0.2, "coulomb": 0.1}},
            "markers": {"end": {"body": "rod", "point": "end"}},
            "initial": {"rod": {"rate": 5.0}},
        }
    )
    (found,) = reactions(scene, [0.0])
    joint = found.joints["O"]
    assert joint.torque == pytest.approx(-1.1, rel=1e-12)
    alpha = -1.1 / (1.0 * 4 / 3)
    np.testing.assert_allclose(joint.force, [-1.0 * 25, alpha], rtol=1e-12)
    assert found.unbalanced < 1e-12


def _three_cranks() -> Scene:
    crank = {"kind": "rod", "length": 1.0, "height": 0.01, "width": 0.1, "density": 1000.0}
    cranks = {f"c{k}": crank for k in range(3)}
    joints: dict[str, Any] = {}
    for k in range(3):
        joints[f"foot{k}"] = {"first": {"body": "ground", "point": [float(k), 0.0]}, "second": {"body": f"c{k}"}}
        joints[f"head{k}"] = {
            "first": {"body": f"c{k}", "point": "end"},
            "second": {"body": "bar", "point": [float(k), 0.0]},
        }
    return Scene.parse(
        {
            "name": "three-cranks",
            "bodies": {**cranks, "bar": crank | {"length": 2.0}},
            "joints": joints,
            "markers": {"bar": {"body": "bar"}},
            "initial": {f"c{k}": {"angle": 2.0} for k in range(3)},
        }
    )


def test_three_parallel_cranks_are_one_too_many_and_are_named() -> None:
    found = statics(_three_cranks())
    assert found.ok, found.message
    np.testing.assert_allclose(found.marker("bar"), [0.0, -1.0], atol=1e-9)
    reacted = found.reactions
    assert reacted is not None
    assert reacted.redundancy == 1
    assert set(reacted.not_unique) == {f"{end}{k}" for end in ("foot", "head") for k in range(3)}
    assert reacted.constraints
    feet = np.sum([reacted.joints[f"foot{k}"].force for k in range(3)], axis=0)
    np.testing.assert_allclose(feet, [0.0, 5 * 9.81], atol=1e-8)
    # The least forces share the weight of the bar evenly, as all cranks are alike.
    heads = [reacted.joints[f"head{k}"].force[1] for k in range(3)]
    np.testing.assert_allclose(heads, np.full(3, 2 * 9.81 / 3), rtol=1e-8)
    assert reacted.unbalanced < 1e-9


def test_a_parallelogram_is_redundant_only_where_its_bars_lie_in_one_line() -> None:
    evaluator = Evaluator.of(load_scene("parallelogram"))
    q = evaluator.model.q0[:, 0]
    rest = np.zeros_like(q)
    assert reactions_of(evaluator, q, rest, evaluator.acceleration(q, rest)).redundancy == 0
    flat = Evaluator.of(load_scene("parallelogram").with_values({"initial.left.angle": 0, "initial.right.angle": 0}))
    at_line = flat.model.q0[:, 0]
    found = reactions_of(flat, at_line, rest, flat.acceleration(at_line, rest))
    assert found.redundancy == 1
    assert set(found.not_unique) == {"O", "P", "A", "B"}
    assert found.constraints == ()


def test_slider_crank_bears_its_load_by_textbook_statics() -> None:
    # A massless-like two-bar press: the slider's normal force and the rod force follow from the angle alone.
    bar = {"kind": "rod", "length": 1.0, "height": 0.01, "width": 0.01, "density": 1.0}
    angle = 0.6
    scene = Scene.parse(
        {
            "name": "press",
            "gravity": [0.0, 0.0],
            "bodies": {"crank": bar, "rod": bar},
            "joints": {
                "O": {"first": GROUND, "second": {"body": "crank"}},
                "A": {"first": {"body": "crank", "point": "end"}, "second": {"body": "rod"}},
                "B": {"kind": "slider", "first": GROUND, "second": {"body": "rod", "point": "end"}},
                "stop": {"kind": "driven-angle", "first": GROUND, "second": {"body": "crank"}, "angle": angle},
            },
            "loads": {"push": {"kind": "force", "at": {"body": "rod", "point": "end"}, "force": [-100.0, 0.0]}},
            "markers": {"B": {"body": "rod", "point": "end"}},
            "initial": {"crank": {"angle": angle}, "rod": {"angle": -angle}},
        }
    )
    found = statics(scene)
    assert found.ok, found.message
    assert found.reactions is not None
    joints = found.reactions.joints
    normal = 100 * np.tan(angle)
    np.testing.assert_allclose(joints["B"].force, [0.0, normal], atol=1e-9)
    np.testing.assert_allclose(np.hypot(*joints["A"].force), 100 / np.cos(angle), rtol=1e-9)
    assert abs(joints["stop"].torque) == pytest.approx(100 / np.cos(angle) * np.sin(2 * angle), rel=1e-9)


@pytest.mark.parametrize(
    ("element", "more"),
    [("ancf-cable", {}), ("ancf-quintic", {}), ("ancf-full", {"law": "enhanced"}), ("simo-reissner", {})],
)
def test_section_forces_of_a_bent_cantilever(element: str, more: dict[str, str]) -> None:
    length, force = 2.0, 3 * 2.07e11 * 1e-4 / 12 / 4
    rod = {"kind": "rod", "length": length, "height": 0.1, "width": 0.1, "density": 7850.0, "youngs_modulus": 2.07e11}
    scene = Scene.parse(
        {
            "name": "cantilever",
            "gravity": [0.0, 0.0],
            "bodies": {"rod": rod | {"element": element, "elements": 4, **more}},
            "joints": {"clamp": {"kind": "weld", "first": GROUND, "second": {"body": "rod"}}},
            "loads": {"tip": {"kind": "force", "at": {"body": "rod", "point": "end"}, "force": [0.0, -force]}},
            "markers": {f"m{k}": {"body": "rod", "point": [k * length / 4, 0.0]} for k in range(5)},
        }
    )
    found = statics(scene)
    assert found.ok, found.message
    evaluator = Evaluator.of(scene)
    rest = np.zeros_like(found.q)
    cut = sections(evaluator, found.q, rest, rest, 0.0, "rod")
    ends = np.array([0, 1, 1, 2, 2, 3, 3, 4])
    np.testing.assert_allclose(cut.s, ends * length / 4)
    lever = found.points[4, 0] - found.points[ends, 0]
    np.testing.assert_allclose(cut.moment, -force * lever, atol=1e-6 * force)
    angle = found.angles[ends]
    np.testing.assert_allclose(cut.normal, -force * np.sin(angle), atol=1e-6 * force)
    np.testing.assert_allclose(cut.shear, -force * np.cos(angle), atol=1e-6 * force)


def test_sections_of_a_beam_on_two_supports_under_its_weight() -> None:
    rod = {"kind": "rod", "length": 1.0, "height": 0.1, "width": 0.1, "density": 1000.0, "youngs_modulus": 2e11}
    scene = Scene.parse(
        {
            "name": "beam",
            "bodies": {"rod": rod | {"element": "ancf-quintic", "elements": 4}},
            "joints": {
                "O": {"first": GROUND, "second": {"body": "rod"}},
                "A": {
                    "kind": "slider",
                    "first": {"body": "ground", "point": [1.0, 0.0]},
                    "second": {"body": "rod", "point": "end"},
                },
            },
            "markers": {"end": {"body": "rod", "point": "end"}},
        }
    )
    found = statics(scene)
    assert found.ok, found.message
    assert found.reactions is not None
    np.testing.assert_allclose(found.reactions.joints["A"].force, [0.0, 5 * 9.81], atol=1e-6)
    evaluator, rest = Evaluator.of(scene), np.zeros_like(found.q)
    cut = sections(evaluator, found.q, rest, rest, 0.0, "rod")
    np.testing.assert_allclose(cut.moment, 10 * 9.81 / 2 * cut.s * (1 - cut.s), atol=1e-6)
    np.testing.assert_allclose(cut.shear, -10 * 9.81 * (0.5 - cut.s), atol=1e-6)
    with pytest.raises(InputError, match="flexible rod"):
        sections(evaluator, found.q, rest, rest, 0.0, "OB")


def test_reactions_and_modes_number_the_bodies_as_the_motion_does() -> None:
    """Bodies of which some state a position and some do not: the order of the coordinates is that of the statements."""
    link = {"kind": "rigid-body", "mass": 1.5, "inertia": 0.2, "centre_of_mass": [0.4, 0.1],
            "named_points": {"end": [0.8, 0.0]}}  # fmt: skip
    parts: dict[str, Any] = {
        "name": "ordered",
        "bodies": {"A": link, "B": link, "P": {"kind": "point-mass", "mass": 0.3}},
        "joints": {
            "O": {"kind": "revolute", "first": {"body": "ground", "point": [0, 0]}, "second": {"body": "A"}},
            "S": {"kind": "slider", "first": {"body": "A", "point": "end"}, "second": {"body": "B"}, "direction": 0.3},
            "T": {"kind": "distance", "first": {"body": "ground", "point": [2.0, 0.0]}, "second": {"body": "P"}},
        },
        "loads": {"K": {"kind": "spring", "first": {"body": "A", "point": "end"}, "second": {"body": "B"},
                        "stiffness": 500.0, "length": 0.1},
                  "Q": {"kind": "spring", "first": {"body": "B", "point": "end"}, "second": {"body": "P"},
                        "stiffness": 200.0, "length": 0.1}},
        "markers": {"b": {"body": "B", "point": "end"}, "p": {"body": "P"}},
        "initial": {"A": {"angle": -1.2}, "P": {"position": [2.0, -0.8]}},
        "solver": {"integrator": "rk4", "step": 1e-3},
    }  # fmt: skip
    scene = Scene.parse(parts)
    (found,) = reactions(scene, [0.2])
    assert found.ok
    assert modes(scene).balanced


def test_no_forces_are_told_of_a_motion_that_is_rejected() -> None:
    """They were those of where the run broke off, or of steps that had lost its energy."""
    scene = load_scene("single-pendulum")
    with pytest.raises(ComputationError, match="led to"):
        reactions(scene.with_values({"solver.max_steps": 100}), [0.5, 50.0])
    with pytest.raises(ComputationError, match="energy"):
        reactions(scene.with_values({"solver.integrator": "leapfrog", "solver.step": 0.05}), [5.0])


@pytest.mark.parametrize("time", [float("nan"), float("inf"), -1.0])
def test_a_machine_rests_at_a_time(time: float) -> None:
    with pytest.raises(InputError, match="time: needs"):
        statics(load_scene("single-pendulum"), time)
