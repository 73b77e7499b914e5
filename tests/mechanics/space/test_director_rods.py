"""Director rods in scenes: closed forms of torsion, curved, twisted and buckling rods, and published figures."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from shoal.errors import InputError
from shoal.mechanics.analysis.modes import modes
from shoal.mechanics.analysis.statics import statics
from shoal.mechanics.elements.unstrained import unstrained
from shoal.mechanics.simulate import simulate
from shoal.scene import Rod, Scene
from shoal.scene.sections import Rectangle

E, NU, H, W, RHO = 7e10, 0.3, 0.04, 0.02, 2700.0
STRONG, WEAK = E * W * H**3 / 12, E * H * W**3 / 12
TORSION = E / (2 * (1 + NU)) * float(Rectangle(H, W).torsion)
GROUND = {"body": "ground", "point": [0, 0, 0]}


def rod(elements: int, **more: Any) -> dict[str, Any]:
    return {"kind": "rod", "length": 1.0, "height": H, "width": W, "density": RHO, "youngs_modulus": E,
            "poisson_ratio": NU, "element": "director-rod", "elements": elements} | more  # fmt: skip


def cantilever(elements: int, *, force: Any = (0, 0, 0), torque: Any = None, **more: Any) -> Scene:
    end = {"body": "B", "point": "end"}
    loads: dict[str, Any] = {"P": {"kind": "force", "at": end, "force": list(force)}}
    if torque is not None:
        size = float(np.linalg.norm(torque))
        loads["M"] = {"kind": "torque", "at": end, "axis": list(torque), "torque": size}
    return Scene.parse({
        "name": "cantilever", "dimensions": 3, "gravity": [0, 0, 0], "bodies": {"B": rod(elements, **more)},
        "joints": {"W": {"kind": "weld", "first": GROUND, "second": {"body": "B"}}},
        "loads": loads, "markers": {"e": end},
    })  # fmt: skip


def test_the_princeton_beam_bends_as_published() -> None:
    """8.896 N at 45 degrees to its section: chord 8.97920 mm and flap 109.11312 mm by shooting, without stretching.

    The published torsion constant is 0.198 of the polar moment.
    """
    h, w = 12.3777e-3, 3.2024e-3
    force = 8.896 * np.array([0, 1, 1]) / math.sqrt(2)
    polar = (h * w**3 + w * h**3) / 12
    section = {"height": h, "width": w, "youngs_modulus": 71.7e9, "poisson_ratio": 0.31}
    found = statics(cantilever(32, force=force, length=0.508, torsion_constant=0.198 * polar, **section))
    assert found.ok
    assert found.marker("e")[1:] == pytest.approx([8.97920e-3, 109.11312e-3], abs=1e-5)


@pytest.mark.slow
def test_a_moment_fixed_in_space_winds_a_rod_into_a_helix_with_the_fourth_order() -> None:
    """EI = GJ = 1 N m^2, moment (1, 2, 3) N m, the end in closed form; without a potential such a moment flutters."""
    closed = np.array([-0.0687126610, 0.5555528458, -0.0141310102])
    side = {"height": 0.01, "width": 0.01, "youngs_modulus": 12e8, "poisson_ratio": 0.0}
    errors = []
    for elements in (8, 16):
        found = statics(cantilever(elements, torque=(1, 2, 3), torsion_constant=2e-8 / 12, **side))
        assert found.balanced
        assert "follower-forces-drive" in found.codes
        errors.append(np.abs(found.marker("e") - closed).max())
    assert errors[-1] < 3e-5
    assert np.log2(errors[0] / errors[1]) > 3.5


def test_a_clamped_rod_vibrates_about_both_axes_and_in_torsion() -> None:
    """Frequencies of Euler and Bernoulli, that of a shaft in torsion, and Kelvin-Voigt damping, omega/2 times eta."""
    found = modes(cantilever(16, retardation=1e-5, height=0.2, width=0.1), count=6).modes
    area, weak, strong = 0.02, 0.2 * 0.1**3 / 12, 0.1 * 0.2**3 / 12
    shear = E / (2 * (1 + NU)) * float(Rectangle(0.2, 0.1).torsion)
    torsional = 0.25 * math.sqrt(shear / (RHO * (weak + strong)))
    bending = [k**2 / (2 * math.pi) * math.sqrt(E * weak / (RHO * area)) for k in (1.8751041, 4.6940911)]
    frequencies = np.array([mode.frequency for mode in found])
    assert frequencies[0] == pytest.approx(bending[0], rel=1e-5)
    assert np.min(np.abs(frequencies / bending[1] - 1)) < 1e-4
    assert np.min(np.abs(frequencies / torsional - 1)) < 5e-4
    for mode in found:
        assert mode.damping_ratio == pytest.approx(0.5e-5 * mode.angular_frequency, rel=1e-5)


def test_a_curved_rod_bends_and_twists_out_of_its_plane() -> None:
    """A quarter of a circle, loaded at a right angle to its plane: P R^3 (pi/4 / EI + (3 pi/4 - 2) / GJ)."""
    radius, force = 2 / math.pi, 0.01
    closed = force * radius**3 * (math.pi / 4 / WEAK + (3 * math.pi / 4 - 2) / TORSION)
    ends = [statics(cantilever(n, force=(0, 0, force), curvature=[math.pi / 2])) for n in (8, 16)]
    assert all(end.ok for end in ends)
    assert ends[0].marker("e")[:2] == pytest.approx([radius, radius], rel=1e-9)
    errors = [end.marker("e")[2] / closed - 1 for end in ends]
    assert abs(errors[1]) < 6e-4
    assert errors[0] / errors[1] == pytest.approx(4.0, abs=0.2)


def test_a_twisted_rod_bends_to_the_side() -> None:
    """A right angle of twist over the length; the deflections are integrals of the turning section's compliance."""
    found = statics(cantilever(16, force=(0, 0.01, 0), twist=[math.pi / 2]))
    ahead = quad(lambda s: (1 - s) ** 2 * (math.cos(s * math.pi / 2) ** 2 / STRONG
                                           + math.sin(s * math.pi / 2) ** 2 / WEAK), 0, 1)[0]  # fmt: skip
    aside = quad(lambda s: (1 - s) ** 2 * math.sin(s * math.pi) / 2 * (1 / STRONG - 1 / WEAK), 0, 1)[0]
    assert found.marker("e")[1:] == pytest.approx([0.01 * ahead, 0.01 * aside], rel=1e-5)


@pytest.mark.slow
def test_a_narrow_rod_buckles_sideways() -> None:
    """Prandtl's load 4.0126 sqrt(EI GJ)/L^2, raised by the bending before (Timoshenko and Gere, Stability, 6.3)."""
    width = 0.004
    weak, strong = E * H * width**3 / 12, E * width * H**3 / 12
    twisting = E / (2 * (1 + NU)) * float(Rectangle(H, width).torsion)
    raised = 1 / math.sqrt((1 - weak / strong) * (1 - twisting / strong))
    load = 4.0126 * math.sqrt(weak * twisting) * raised
    below, above = (
        modes(cantilever(16, force=(0, -share * load, 0), width=width), count=1, leave_unstable=False)
        for share in (0.99, 1.01)
    )
    assert below.ok
    assert not above.ok
    left = statics(cantilever(8, force=(0, -1.03 * load, 0), width=width))
    assert left.ok
    assert abs(left.marker("e")[2]) > 0.05


def test_the_shape_at_rest_is_that_of_a_helix_and_of_the_plane() -> None:
    helix = Rod.model_validate(rod(4, curvature=[2.0], twist=[1.0]))
    place, axes = unstrained(helix, 0.7)
    total = math.sqrt(5.0)
    axis = np.array([1.0, 0.0, 2.0]) / total  # the screw of (twist, 0, curvature)
    x = np.array([1.0, 0.0, 0.0])
    along, across = axis * (axis @ x), x - axis * (axis @ x)
    angle = 0.7 * total
    closed = 0.7 * along + (across * math.sin(angle) + np.cross(axis, across) * (1 - math.cos(angle))) / total
    assert place[:, 0] == pytest.approx(closed, abs=1e-12)
    assert axes[:, :, 0].T @ axes[:, :, 0] == pytest.approx(np.eye(3), abs=1e-12)
    plane = Rod.model_validate(rod(4, curvature=[0.5, 3.0, -2.0]))
    place, axes = unstrained(plane, np.array([0.3, 1.0]))
    assert place[0] + 1j * place[1] == pytest.approx([plane.axis(0.3), plane.axis(1.0)], abs=1e-10)
    assert np.arctan2(axes[1, 0], axes[0, 0]) == pytest.approx([plane.turn(0.3), plane.turn(1.0)], abs=1e-10)


def chain(element: str, *, elements: int = 6, axis: Any = (0, 0, 1), **more: Any) -> Scene:
    """A double pendulum of two rods of square section on hinges."""
    bar = {"element": element, "height": 0.03, "width": 0.03, "youngs_modulus": 2e8, "density": 5540.0}
    return Scene.parse({
        "name": "chain", "dimensions": 3, "gravity": [0, -9.81, 0],
        "bodies": {"OA": rod(elements, **bar), "AB": rod(elements, **bar)},
        "joints": {
            "O": {"kind": "revolute", "first": GROUND, "second": {"body": "OA"}, "axis": list(axis)},
            "A": {"kind": "revolute", "first": {"body": "OA", "point": "end"}, "second": {"body": "AB"},
                  "axis": list(axis)},
        },
        "markers": {"B": {"body": "AB", "point": "end"}}, "initial": {"OA": {"angle": 0.5}, "AB": {"angle": 0.2}},
        "solver": {"integrator": "leapfrog", "step": 5e-5}, **more,
    })  # fmt: skip


def test_rods_that_share_the_axis_of_a_hinge_swing_as_cables_do() -> None:
    ends = []
    for element, elements in (("ancf-cable", 6), ("director-rod", 6)):
        found = simulate(chain(element, elements=elements), np.array([0.2]))
        assert found.ok
        ends.append(found.marker("B")[-1])
    assert ends[1] == pytest.approx(ends[0], abs=2e-4)
    assert abs(ends[1][2]) < 1e-12


def test_a_rod_on_a_turning_hub_and_with_a_welded_head_turns_as_a_whole() -> None:
    """The same machine, turned as a whole with its gravity: the motion turns with it."""
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_rotvec([0.4, -1.1, 0.7])

    def end(rotation: Rotation) -> Any:
        pose = {"rotation": rotation.as_rotvec().tolist()}
        axis = rotation.apply([0, 1.0, 0]).tolist()
        scene = Scene.parse({
            "name": "rotor", "dimensions": 3, "gravity": rotation.apply([0, -9.81, 0]).tolist(),
            "bodies": {
                "hub": {"kind": "rigid-body", "mass": 1.0, "inertia": [0.1, 0.2, 0.1]},
                "blade": rod(3, height=0.03, width=0.01, youngs_modulus=2e9, twist=[0.5], retardation=1e-6),
                "head": {"kind": "rigid-body", "mass": 0.3, "inertia": 1e-3, "centre_of_mass": [0.05, 0, 0.02]},
            },
            "joints": {
                "H": {"kind": "revolute", "first": GROUND, "second": {"body": "hub"}, "axis": axis},
                "R": {"kind": "weld", "first": {"body": "hub"}, "second": {"body": "blade"}},
                "T": {"kind": "weld", "first": {"body": "blade", "point": "end"}, "second": {"body": "head"}},
            },
            "loads": {"M": {"kind": "torque", "at": {"body": "hub"}, "axis": axis, "torque": 3.0}},
            "markers": {"e": {"body": "head", "point": "start"}},
            "initial": {"hub": pose, "blade": pose, "head": pose},
            "solver": {"integrator": "leapfrog", "step": 2e-5},
        })  # fmt: skip
        found = simulate(scene, np.array([0.3]))
        assert found.ok, found.message
        return found.marker("e")[-1]

    straight = end(Rotation.identity())
    assert np.hypot(straight[0] - 1.0, straight[2]) > 0.05
    assert end(turn) == pytest.approx(turn.apply(straight), abs=1e-9)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"dimensions": 2, "gravity": [0, -9.81]}, "director-rod is for scenes in space"),
        ({"loads": {"T": {"kind": "torque", "at": {"body": "OA", "point": [0.1, 0, 0]}, "torque": 1.0}}},
         "nodes of director rods"),
        ({"bodies": {"OA": rod(2, element="ancf-cable", twist=[1.0], width=H), "AB": rod(2)}}, "twist: ancf-cable has"),
    ],
)  # fmt: skip
def test_what_no_rod_can_do_is_refused(change: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        simulate(chain("director-rod", **change), np.array([0.01]))
