"""Slow motions beside stiff ones, damped roots, and what small motions leave out, against closed forms."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from shoal.cli import main
from shoal.errors import ComputationError
from shoal.mechanics.analysis.damped import roots
from shoal.mechanics.analysis.findings import EquilibriumStatus
from shoal.mechanics.analysis.mesh_error import of_modes
from shoal.mechanics.analysis.modes import modes
from shoal.mechanics.analysis.small_motions import ROUND, BoundedMatrix, hides, spectrum
from shoal.mechanics.analysis.statics import statics
from shoal.scene import Scene, load_scene

GROUND = {"body": "ground", "point": [0.0, 0.0]}
DOWN, UP = -np.pi / 2, np.pi / 2
STEEL = {"kind": "rod", "density": 7800.0, "youngs_modulus": 2.1e11, "element": "ancf-cable", "elements": 16}
G = 9.81


def _pendulum(**more: Any) -> Scene:
    return Scene.parse(
        {
            "name": "pendulum",
            "bodies": {"A": STEEL | {"length": 1.0, "height": 0.01, "width": 0.01} | more},
            "joints": {"O": {"first": GROUND, "second": {"body": "A"}}},
            "markers": {"T": {"body": "A", "point": "end"}},
            "initial": {"A": {"angle": DOWN}},
        }
    )


def _beside(angle: float) -> Scene:
    """A pendulum beside a stiff rod: 1 kg at 1 m with an inertia of 0.001 kg m^2."""
    at = {"body": "ground", "point": [1.0, 0.0]}
    return Scene.parse(
        {
            "name": "beside",
            "bodies": {
                "A": STEEL | {"length": 0.1, "height": 0.005, "width": 0.005},
                "B": {"kind": "rigid-body", "mass": 1.0, "inertia": 0.001, "centre_of_mass": [1.0, 0.0]},
            },
            "joints": {
                "O": {"kind": "weld", "first": GROUND, "second": {"body": "A"}},
                "P": {"first": at, "second": {"body": "B"}},
            },
            "markers": {"B": {"body": "B", "point": [1.0, 0.0]}},
            "initial": {"A": {"angle": DOWN}, "B": {"angle": angle, "position": [1.0, 0.0]}},
        }
    )


def _block(stiffness: float, damping: float, **joint: Any) -> Scene:
    spring = {"kind": "spring", "first": {"body": "ground", "point": [-1.0, 0.0]}, "second": {"body": "A"},
              "stiffness": stiffness, "damping": damping, "length": 1.0}  # fmt: skip
    return Scene.parse(
        {
            "name": "block",
            "gravity": [0.0, -G],
            "bodies": {"A": {"kind": "point-mass", "mass": 1.0}},
            "joints": {"O": {"kind": "slider", "first": GROUND, "second": {"body": "A"}} | joint},
            "loads": {"s": spring},
            "markers": {"A": {"body": "A"}},
            "initial": {"A": {"position": [0.0, 0.0]}},
        }
    )


def _beck(load: float, retardation: float) -> Scene:
    """Beck's column under a follower force of `load` EI/L^2 at its tip."""
    rod = {"kind": "rod", "length": 1.0, "height": 0.01, "width": 0.01, "density": 2700.0, "youngs_modulus": 7e10,
           "element": "ancf-quintic", "elements": 4, "retardation": retardation}  # fmt: skip
    force = -load * 7e10 * 0.01**4 / 12
    return Scene.parse(
        {
            "name": "beck",
            "gravity": [0.0, 0.0],
            "bodies": {"A": rod},
            "joints": {"a": {"kind": "weld", "first": GROUND, "second": {"body": "A"}}},
            "loads": {
                "p": {"kind": "force", "at": {"body": "A", "point": "end"}, "force": [force, 0.0], "follows": True}
            },
            "markers": {"T": {"body": "A", "point": "end"}},
        }
    )


@pytest.mark.parametrize("elements", [4, 16, 32])
def test_a_pendulum_whose_rod_is_damped_still_swings(elements: int) -> None:
    (mode,) = modes(_pendulum(retardation=1e-3, elements=elements), count=1).modes
    assert mode.angular_frequency == pytest.approx(np.sqrt(1.5 * G), rel=1e-4)
    assert mode.kind == "oscillating"
    assert 0 < mode.damping_ratio < 1e-6


@pytest.mark.parametrize("damping", [1e3, 1e5, 1e7])
def test_an_overdamped_motion_comes_back_slowly(damping: float) -> None:
    slow, fast = modes(_block(1.0, damping)).modes
    assert [slow.kind, fast.kind] == ["creeping", "creeping"]
    assert slow.eigenvalue.real == pytest.approx(-2 / (damping + np.sqrt(damping**2 - 4)), rel=1e-12)
    assert fast.eigenvalue.real == pytest.approx(-damping, rel=1e-5)


def test_a_pendulum_beside_a_stiff_rod_is_held() -> None:
    found = statics(_beside(DOWN))
    assert found.ok, found.message
    (mode,) = modes(_beside(DOWN), count=1).modes
    assert mode.angular_frequency == pytest.approx(np.sqrt(G / 1.001), rel=1e-9)


def test_a_pendulum_standing_beside_a_stiff_rod_is_unstable() -> None:
    assert statics(_beside(UP), leave_unstable=False).status is EquilibriumStatus.UNSTABLE
    found = modes(_beside(UP), about="start", count=1)
    (mode,) = found.modes
    assert mode.kind == "unstable"
    assert found.findings[0].numbers["rate"] == pytest.approx(np.sqrt(9.81), rel=1e-3)
    assert mode.eigenvalue.real == pytest.approx(np.sqrt(G / 1.001), rel=1e-9)


def test_squared_frequencies_are_known_each_to_its_own_round_off() -> None:
    # Eigenvalues of 1e-9 and 3e-9 (of a block of its own) beside 1e13, at which round-off of the largest is 1e-3.
    low = np.array([[2e-9, 1e-9], [1e-9, 2e-9]])
    stiff = 1e13 * np.array([[2.0, 1.0, 0.5], [1.0, 3.0, 1.0], [0.5, 1.0, 4.0]])
    matrix = np.zeros((5, 5))
    matrix[:2, :2], matrix[2:, 2:] = low, stiff
    mixed = np.linalg.qr(np.random.default_rng(1).normal(size=(5, 5)))[0]
    found = spectrum(BoundedMatrix(matrix, ROUND * np.abs(matrix)), mixed)
    np.testing.assert_allclose(found.values[:2], [1e-9, 3e-9], rtol=1e-4)
    assert np.all(found.levels[:2] < 1e-12)
    np.testing.assert_allclose(found.values[2:], np.linalg.eigvalsh(stiff), rtol=1e-12)


def test_round_off_that_may_hide_a_motion_is_told_from_a_free_one() -> None:
    assert not hides(1e-6, np.array([0.0, 1e6]), 9.81)
    assert hides(1.0, np.array([0.0, 1e6]), 9.81)
    assert not hides(1.0, np.array([0.0, 1e6]), 0.0)


@pytest.mark.parametrize("damper", [0.0, 1e-3, 5.0])
def test_free_motions_with_and_without_a_damper(damper: float) -> None:
    # Unit masses 0, 1 on a spring of 1e8 and 2 by itself, on a damper.
    stiffness = 1e8 * np.array([[1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 0.0]])
    damping = np.diag([0.0, 0.0, damper])
    tangent, rubbing = (BoundedMatrix(part, ROUND * np.abs(part)) for part in (stiffness, damping))
    found = roots(tangent, rubbing, spectrum(tangent, np.eye(3)), follows=False)
    expected = [0.0, 0.0, *([-damper] if damper else []), np.sqrt(2e8) * 1j]
    np.testing.assert_allclose(found.values, expected, rtol=1e-12)


@pytest.mark.parametrize(
    ("load", "retardation", "ok"),
    [(10.5, 1e-6, True), (11.5, 1e-6, False), (15.0, 1e-4, False), (19.9, 0.0, True), (20.2, 0.0, False)],
)
@pytest.mark.by_day(1)
def test_internal_damping_lowers_the_load_of_becks_column(load: float, retardation: float, ok: bool) -> None:
    # 20.05 EI/L^2 without damping; 10.9 with vanishing internal damping (Bolotin and Zhinzher 1969).
    scene = _beck(load, retardation)
    found = statics(scene)
    assert found.ok is ok, found.message
    assert found.stable is ok
    assert modes(scene, count=2).ok is ok
    assert any("rate" in one.numbers for one in found.findings) == bool(retardation and not ok)


def test_no_modes_where_two_branches_cross() -> None:
    with pytest.raises(ComputationError, match="singular place"):
        modes(load_scene("equal-slider-crank"))
    # Beside it, and where a machine lacks rank everywhere, there are.
    assert modes(load_scene("bricard")).ok


def test_dry_friction_that_is_left_out_is_told() -> None:
    found = statics(_block(1.0, 0.0, coulomb=5.0, mu=0.1))
    assert found.ok
    assert "effect-neglected" in found.codes
    assert "effect-neglected" in modes(_block(1.0, 0.0, coulomb=5.0)).codes
    assert not statics(_block(1.0, 0.0)).message


def _rotor(angle: str) -> Scene:
    hub = {"body": "hub"}
    return Scene.parse(
        {
            "name": "rotor",
            "gravity": [0.0, -G],
            "bodies": {
                "hub": {"kind": "rigid-body", "mass": 1.0, "inertia": 0.1},
                "b": {"kind": "rod", "length": 1.0, "height": 0.01, "width": 0.01, "density": 2700.0},
            },
            "joints": {
                "h": {"first": GROUND, "second": hub},
                "d": {"kind": "driven-angle", "first": GROUND, "second": hub, "angle": {"expression": angle}},
                "p": {"first": hub | {"point": [0.5, 0.0]}, "second": {"body": "b"}},
            },
            "markers": {"T": {"body": "b", "point": "end"}},
            "initial": {"hub": {"angle": 0.0}, "b": {"angle": 0.0}},
        }
    )


@pytest.mark.parametrize(("angle", "status"), [("10*t", "moving"), ("t**2", "ok"), ("0*t", "ok")])
def test_modes_of_a_machine_that_is_driven_are_not_those_at_rest(angle: str, status: str) -> None:
    found = modes(_rotor(angle))
    assert found.to_json()["status"] == status
    assert ("motion-left-out" in found.codes) == (status == "moving")


def test_a_start_that_moves_has_no_modes_at_rest() -> None:
    data = _pendulum().model_dump(mode="json")
    assert modes(Scene.parse(data), about="start").ok
    data["initial"]["A"]["rate"] = 5.0
    found = modes(Scene.parse(data), about="start")
    assert found.status == "moving"
    assert found.codes[0] == "motion-left-out"


def test_modes_that_a_mesh_does_not_know_are_named(tmp_path: Any) -> None:
    scene = _pendulum(elements=1)
    found = of_modes(modes(scene, count=4), scene)
    assert found.status == "coarse-mesh"
    coarse = [number for number, error in enumerate(found.mesh_errors, 1) if error > 0.5]
    assert coarse
    assert 1 not in coarse
    assert found.findings[0].numbers == {"first": coarse[0], "count": len(coarse)}
    path = tmp_path / "pendulum.yaml"
    path.write_text(json.dumps(scene.model_dump(mode="json")))
    assert CliRunner().invoke(main, ["modes", str(path), "--count", "1"]).exit_code == 0
    assert CliRunner().invoke(main, ["modes", str(path), "--count", "4"]).exit_code == 3
