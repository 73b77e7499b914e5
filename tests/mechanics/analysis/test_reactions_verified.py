"""Errors of joint forces: a pendulum's in closed form, rods whose vibration the default steps do not follow, chaos."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import yaml
from click.testing import CliRunner
from shoal.cli import main
from shoal.mechanics.analysis.joint_reactions import JointReaction, Reactions, to_json
from shoal.mechanics.analysis.reactions import reactions
from shoal.mechanics.analysis.reactions_verified import SHARE, verified
from shoal.scene import Scene, load_scene
from shoal.trajectory import Array

TIMES = [0.05, 0.1]


def _rod(modulus: float, height: float) -> Scene:
    """A flexible pendulum that starts unstrained while it turns, so that it vibrates along its axis."""
    rod = {"kind": "rod", "length": 1.0, "height": height, "width": height, "density": 2500.0}
    return Scene.parse({
        "name": "rod", "bodies": {"b": {**rod, "youngs_modulus": modulus, "element": "ancf-cable", "elements": 4}},
        "joints": {"h": {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "b"}}},
        "markers": {"T": {"body": "b", "point": "end"}}, "initial": {"b": {"angle": 0.3, "rate": 2.0}},
    })  # fmt: skip


def _forces(found: list[Reactions]) -> Array:
    return np.array([[joint.force for joint in one.joints.values()] for one in found])


def test_the_pin_of_a_pendulum_bears_what_it_is_told_to_with_its_error() -> None:
    found = verified(load_scene("single-pendulum"), [0.0, 0.2, 0.5])
    for one in found:
        joint = one.joints["O"]
        assert one.ok
        # Released from the horizontal, the pull is three times the weight's part along the rod.
        out = np.array([joint.force[0], joint.force[1]]) / max(float(np.linalg.norm(joint.force)), 1e-300)
        assert np.linalg.norm(joint.force) == pytest.approx(3 * 9.81 * out[1], abs=1e-7)
        assert joint.force_error is not None
        assert joint.force_error < 1e-6
    assert found[0].joints["O"].force_error == pytest.approx(0.0, abs=1e-6)
    assert not any(one.message for one in found)


@pytest.mark.parametrize(("modulus", "height"), [(5e7, 0.02), (7e10, 0.01)], ids=["soft", "stiff"])
def test_forces_of_steps_too_long_for_a_rod_are_those_of_more_careful_runs(modulus: float, height: float) -> None:
    scene = _rod(modulus, height)
    tight = {"integrator": "dop853", "relative_tolerance": 1e-10, "absolute_tolerance": 1e-10}
    wanted = _forces(reactions(scene.with_values({f"solver.{name}": value for name, value in tight.items()}), TIMES))
    assert np.max(np.abs(_forces(reactions(scene, TIMES)) - wanted)) > SHARE * np.max(np.abs(wanted))
    found = verified(scene, TIMES)
    assert all(one.ok for one in found), found[0].message
    assert found[0].codes == ["forces-of-careful-run"]
    assert np.max(np.abs(_forces(found) - wanted)) < SHARE * np.max(np.abs(wanted))


def test_forces_that_no_two_runs_agree_about_are_inaccurate(monkeypatch: pytest.MonkeyPatch) -> None:
    wrong = iter(range(1, 9))

    def drifting(scene: Scene, times: list[float]) -> list[Any]:
        found, factor = reactions(scene, times), float(next(wrong))
        return [replace(one, joints={"O": scaled(one.joints["O"], factor)}) for one in found]

    def scaled(joint: JointReaction, factor: float) -> JointReaction:
        return replace(joint, force=tuple(factor * part for part in joint.force))

    monkeypatch.setattr("shoal.mechanics.analysis.reactions_verified.reactions", drifting)
    report = to_json(verified(load_scene("single-pendulum"), [0.2]))
    assert report["status"] == "inaccurate"
    assert [one["code"] for one in report["findings"]] == ["forces-inaccurate"]
    error = report["reactions"][0]["joints"]["O"]["force_error"]
    assert error >= SHARE * np.hypot(*report["reactions"][0]["joints"]["O"]["force"])


def test_joints_that_bear_nothing_are_not_judged_by_round_off() -> None:
    """A mass on a rail that swings along it, without weight."""
    mass, ground = {"body": "m"}, {"body": "ground", "point": [0.0, 0.0]}
    scene = Scene.parse({
        "name": "sled", "gravity": [0.0, 0.0], "bodies": {"m": {"kind": "point-mass", "mass": 1.0}},
        "joints": {"rail": {"kind": "slider", "first": ground, "second": mass}},
        "loads": {"s": {"kind": "spring", "first": {"body": "ground", "point": [-1.0, 0.0]}, "second": mass,
                        "stiffness": 50.0, "length": 1.0}},
        "markers": {"m": mass}, "initial": {"m": {"position": [0.2, 0.0]}},
    })  # fmt: skip
    (found,) = verified(scene, [0.3])
    assert found.ok
    np.testing.assert_allclose(found.joints["rail"].force, 0.0, atol=1e-9)


def test_the_command_tells_the_error_and_may_leave_it_out(tmp_path: Any) -> None:
    path = tmp_path / "rod.yaml"
    path.write_text(yaml.safe_dump(_rod(5e7, 0.02).model_dump(mode="json")))
    run = CliRunner().invoke(main, ["reactions", str(path), "--at", "0.1", "--json"])
    report = json.loads(run.stdout)
    assert report["status"] == "ok"
    assert "solver.integrator=dop853" in report["message"]
    assert 0.0 < report["reactions"][0]["errors"]["by_source"]["time"] < 0.2
    assert report["reactions"][0]["joints"]["h"]["force_error"] > 0.0
    shown = CliRunner().invoke(main, ["reactions", str(path), "--at", "0.1"]).stdout
    assert "error" in shown
    bare = CliRunner().invoke(main, ["reactions", str(path), "--at", "0.1", "--json", "--no-verify"])
    assert json.loads(bare.stdout)["reactions"][0]["joints"]["h"]["force_error"] is None


def test_forces_of_steps_that_all_are_the_longest_are_told_as_far_off_as_they_are() -> None:
    """A second run of the same steps agrees, however wrong both are. Truth: the run with its usual tolerance."""
    scene, usual = load_scene("single-pendulum"), {"solver.integrator": "dop853", "solver.duration": 5.0}
    loose = {"solver.max_step": 0.3, "solver.relative_tolerance": 0.1, "solver.absolute_tolerance": 0.1}
    (capped,), (true,) = (verified(scene.with_values(usual | more), [5.0]) for more in (loose, {}))
    off = float(np.linalg.norm(np.subtract(capped.joints["O"].force, true.joints["O"].force)))
    assert off > 1e-3
    assert capped.joints["O"].force_error == pytest.approx(off, rel=0.2)
