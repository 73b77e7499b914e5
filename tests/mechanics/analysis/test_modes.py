"""Small motions against the frequencies of textbooks."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.optimize import brentq
from shoal.errors import ComputationError
from shoal.mechanics.analysis.modes import modes
from shoal.scene import Scene, load_scene

GROUND = {"body": "ground", "point": [0.0, 0.0]}
ROD = {"kind": "rod", "length": 1.0, "height": 0.01, "width": 0.02, "density": 7850.0, "youngs_modulus": 2e11}
CANTILEVER = [brentq(lambda b: np.cos(b) * np.cosh(b) + 1, k * np.pi - 2.2, k * np.pi - 1) for k in (1, 2, 3)]
PINNED = [np.pi, 2 * np.pi, 3 * np.pi]


def _beam(element: str, elements: int, *, pinned: bool, **more: Any) -> Scene:
    joints: dict[str, Any] = {"O": {"kind": "weld", "first": GROUND, "second": {"body": "rod"}}}
    if pinned:
        end = {"body": "ground", "point": [1.0, 0.0]}
        joints = {
            "O": {"first": GROUND, "second": {"body": "rod"}},
            "A": {"kind": "slider", "first": end, "second": {"body": "rod", "point": "end"}},
        }
    return Scene.parse(
        {
            "name": "beam",
            "gravity": [0.0, 0.0],
            "bodies": {"rod": ROD | {"element": element, "elements": elements, **more}},
            "joints": joints,
            "markers": {"end": {"body": "rod", "point": "end"}},
        }
    )


@pytest.mark.parametrize("pinned", [False, True], ids=["cantilever", "pinned"])
@pytest.mark.parametrize(("element", "meshes", "order"), [("ancf-cable", (8, 16), 4), ("ancf-quintic", (4, 8), 8)])
def test_bernoulli_euler_frequencies_and_their_order(
    element: str, meshes: tuple[int, int], order: int, pinned: bool
) -> None:
    wave = 0.01 * np.sqrt(2e11 / 7850 / 12)
    exact = np.array(PINNED if pinned else CANTILEVER) ** 2 * wave / (2 * np.pi)
    errors = []
    for elements in meshes:
        found = modes(_beam(element, elements, pinned=pinned), count=3)
        assert found.ok
        errors.append(found.frequencies / exact - 1)
    assert np.all(np.abs(errors[1]) < {4: 1e-4, 8: 1e-7}[order])
    # Of the third mode: errors of the others are near the round-off of matrices with axial stiffness, 1e-10.
    slope = np.log2(abs(errors[0][2]) / abs(errors[1][2]))
    assert slope == pytest.approx(order, abs=0.4)


def test_ancf_full_vibrates_like_a_beam() -> None:
    found = modes(_beam("ancf-full", 16, pinned=False, law="enhanced"), count=2)
    wave = 0.01 * np.sqrt(2e11 / 7850 / 12)
    np.testing.assert_allclose(found.frequencies, np.array(CANTILEVER[:2]) ** 2 * wave / (2 * np.pi), rtol=5e-3)


def test_double_pendulum_of_rigid_rods() -> None:
    # Uniform rods of 1 kg, 1 m and 2 kg, 2 m about the hanging position, in absolute angles.
    mass = np.array([[1 / 3 + 2, 2.0], [2.0, 8 / 3]])
    stiffness = 9.81 * np.diag([0.5 + 2, 2.0])
    expected = np.sqrt(eigh(stiffness, mass, eigvals_only=True))
    scene = load_scene("rigid-double-pendulum")
    found = modes(scene)
    np.testing.assert_allclose([mode.angular_frequency for mode in found.modes], expected, rtol=1e-10)
    for mode in found.modes:
        assert mode.kind == "oscillating"
        assert mode.damping_ratio == 0.0
        # Small turns displace hanging points sideways by length times angle.
        np.testing.assert_allclose(mode.points[0, 0], mode.angles[0], atol=1e-9)
        np.testing.assert_allclose(mode.points[1, 0], mode.angles[0] + 2 * mode.angles[1], atol=1e-9)


def _torsion(damping: float, gravity: float, angle: float, stiffness: float = 30.0) -> Scene:
    spring = {"kind": "torsion-spring", "first": GROUND, "second": {"body": "disk"}, "stiffness": stiffness,
              "damping": damping}  # fmt: skip
    return Scene.parse(
        {
            "name": "disk",
            "gravity": [0.0, -gravity],
            "bodies": {"disk": {"kind": "rigid-body", "mass": 2.0, "inertia": 0.5, "centre_of_mass": [0.5, 0.0]}},
            "joints": {"O": {"first": GROUND, "second": {"body": "disk"}, "coulomb": 1.0}},
            "loads": {"spring": spring},
            "markers": {"c": {"body": "disk"}},
            "initial": {"disk": {"angle": angle}},
        }
    )


def test_torsion_spring_with_gravity_and_damping() -> None:
    inertia = 0.5 + 2 * 0.25
    (mode,) = modes(_torsion(0.0, 9.81, -np.pi / 2)).modes
    assert mode.angular_frequency**2 == pytest.approx((30 + 9.81) / inertia, rel=1e-11)
    (mode,) = modes(_torsion(0.8, 0.0, 0.3)).modes
    ratio = 0.8 / (2 * np.sqrt(30 * inertia))
    assert mode.damping_ratio == pytest.approx(ratio, rel=1e-9)
    assert mode.frequency == pytest.approx(np.sqrt(30 / inertia) / (2 * np.pi), rel=1e-9)
    assert mode.damped_frequency == pytest.approx(mode.frequency * np.sqrt(1 - ratio**2), rel=1e-9)


def test_overdamped_motion_creeps_back() -> None:
    found = modes(_torsion(20.0, 0.0, 0.0)).modes
    assert [mode.kind for mode in found] == ["creeping", "creeping"]
    np.testing.assert_allclose(sorted(m.eigenvalue.real for m in found), np.sort(np.roots([1, 20, 30])), rtol=1e-9)


def test_inverted_pendulum_grows_about_its_start() -> None:
    found = modes(_torsion(0.0, 9.81, np.pi / 2, stiffness=4.0), about="start")
    (mode,) = found.modes
    assert not found.ok
    assert mode.kind == "unstable"
    assert mode.eigenvalue.real == pytest.approx(np.sqrt(9.81 - 4), rel=1e-10)


def test_parallelogram_swings_like_one_pendulum() -> None:
    # Cranks of 1 and 3 kg and a coupler of 2 kg that only translates: (m1 + m2)/2 g + m g over (m1 + m2)/3 + m.
    scene = load_scene("parallelogram").with_values({"initial.left.angle": -1.2, "initial.right.angle": -1.2})
    (mode,) = modes(scene).modes
    assert mode.angular_frequency**2 == pytest.approx(9.81 * 4 / (4 / 3 + 2), rel=1e-9)


def test_a_free_rod_has_three_free_modes_and_those_of_a_free_beam() -> None:
    data = _beam("ancf-quintic", 4, pinned=False).model_dump(mode="json")
    data["joints"] = {}
    data["initial"] = {"rod": {"position": [0.0, 0.0]}}
    found = modes(Scene.parse(data), count=4, about="start")
    assert [mode.kind for mode in found.modes] == ["free", "free", "free", "oscillating"]
    beta = brentq(lambda b: np.cos(b) * np.cosh(b) - 1, 4, 5)
    expected = beta**2 * 0.01 * np.sqrt(2e11 / 7850 / 12)
    assert found.modes[3].angular_frequency == pytest.approx(expected, rel=1e-6)


def test_no_modes_about_what_falls() -> None:
    data = _beam("ancf-quintic", 2, pinned=False).model_dump(mode="json")
    data["joints"] = {}
    data["gravity"] = [0.0, -9.81]
    data["initial"] = {"rod": {"position": [0.0, 0.0]}}
    with pytest.raises(ComputationError, match="nothing holds rod"):
        modes(Scene.parse(data))
