"""Rods whose sections hold each other: closed forms of bent frames, the plane, bodies between, lanes, other engines."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from shoal.engines import get_engine
from shoal.errors import InputError
from shoal.mechanics.analysis.evaluate import Evaluator
from shoal.mechanics.analysis.modes import modes
from shoal.mechanics.analysis.reactions import reactions
from shoal.mechanics.analysis.statics import statics
from shoal.mechanics.assembly.build import build
from shoal.mechanics.numerics.tile import Array
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene
from shoal.scene.sections import Rectangle

E, NU, H, W = 7e10, 0.3, 0.04, 0.02
STRONG, WEAK = E * W * H**3 / 12, E * H * W**3 / 12
TORSION = E / (2 * (1 + NU)) * float(Rectangle(H, W).torsion)
OBLIQUE = (0.3, 0.8, -0.5)
SOFT = {"height": 0.03, "width": 0.02, "youngs_modulus": 2e8, "density": 5540.0}
FEW = np.array([0.1, 0.3])


def rod(elements: int, **more: Any) -> dict[str, Any]:
    return {"kind": "rod", "length": 1.0, "height": H, "width": W, "density": 2700.0, "youngs_modulus": E,
            "poisson_ratio": NU, "element": "director-rod", "elements": elements} | more  # fmt: skip


def frame(rotation: Any, *, joint: Any = None, between: bool = False, **parts: Any) -> Scene:
    """A rod along x, clamped, and another turned from it at its end; between: a tiny rigid body in the corner."""
    corner: dict[str, Any] = {"body": "A", "point": "end"}
    joint = {"kind": "weld"} | (joint or {})
    bodies = {"A": rod(4), "B": rod(4)} | parts.pop("bodies", {})
    joints = {"G": {"kind": "weld", "first": {"body": "ground", "point": [0, 0, 0]}, "second": {"body": "A"}}}
    if between:
        bodies["X"] = {"kind": "rigid-body", "mass": 1e-6, "inertia": 1e-9}
        joints["X"] = {"kind": "weld", "first": corner, "second": {"body": "X"}}
    joints["C"] = joint | {"first": {"body": "X"} if between else corner, "second": {"body": "B"}}
    return Scene.parse({
        "name": "frame", "dimensions": 3, "gravity": [0, 0, 0], "bodies": bodies, "joints": joints,
        "markers": {"e": {"body": "B", "point": "end"}, "c": corner}, "initial": {"B": {"rotation": list(rotation)}},
        "solver": {"integrator": "leapfrog", "step": 2e-5}, **parts,
    })  # fmt: skip


def pulled(rotation: Any, force: Any, **parts: Any) -> Scene:
    load = {"kind": "force", "at": {"body": "B", "point": "end"}, "force": list(force)}
    return frame(rotation, loads={"P": load}, **parts)


def swinging(rotation: Any, **parts: Any) -> Scene:
    bodies = {name: rod(4) | SOFT | parts.pop(name, {}) for name in ("A", "B")}
    return frame(rotation, bodies=bodies, gravity=[0, -3, -9.81], **parts)


def deflection(turn: Array, force: Array) -> Array:
    """Of the tip: the first rod bends and twists by the force and its torque, the second bends by the force."""
    bend = np.array([1 / (E * H * W), 1 / (3 * STRONG), 1 / (3 * WEAK)])
    torque = np.cross(turn[:, 0], force)
    moved = bend * force + np.array([0.0, torque[2] / (2 * STRONG), -torque[1] / (2 * WEAK)])
    turned = torque / np.array([TORSION, WEAK, STRONG])
    turned += np.array([0.0, -force[2] / (2 * WEAK), force[1] / (2 * STRONG)])
    return np.asarray(moved + np.cross(turned, turn[:, 0]) + turn @ (bend * (turn.T @ force)))


RIGHT = [[0, 0, math.pi / 2], [0, 0, 0], [math.pi / 2, 0, 0], [0, -math.pi / 2, 0], [0, 0, math.pi],
         (2 * math.pi / math.sqrt(27) * np.ones(3)).tolist()]  # fmt: skip


@pytest.mark.parametrize(
    ("rotation", "directors"),
    [
        *itertools.product(RIGHT, ("yy", "yz", "zz")),
        *(([*one], None) for one in (OBLIQUE, (0, 0, 0.7), (0, 1e-3, 0), (-1.0, 2.0, 0.4))),
    ],
)
@pytest.mark.by_day(3)
def test_a_frame_bends_and_twists_as_its_rods_do(rotation: Any, directors: str | None) -> None:
    """A cantilever of two rods in every position, small loads; sections hold each other by independent constraints."""
    force = 1e-5 * np.array([0.3, -0.5, 0.7])
    bodies = {name: rod(2, director=directors[k] if directors else None) for k, name in enumerate("AB")}
    scene = pulled(rotation, force, bodies=bodies)
    model = build(scene)
    slope = Evaluator(model).at(model.q0[:, 0]).jacobian.toarray()
    assert np.linalg.matrix_rank(slope) == len(slope)
    # Nodes move, turn and stretch; at the clamp the rod stretches only, in the corner each does for itself.
    assert model.unknowns - len(slope) == 3 * 7 + 8 + 1
    found = statics(scene)
    assert found.ok
    turn = Rotation.from_rotvec(rotation).as_matrix()
    closed = deflection(turn, force)
    moved = found.marker("e") - turn[:, 0] - np.array([1.0, 0.0, 0.0])
    assert np.abs(moved - closed).max() < 1e-6 * np.abs(closed).max()


def test_a_quarter_of_a_ring_and_a_rod_bend_and_twist_out_of_their_plane() -> None:
    """Castigliano: at the angle u from its end the arc bears P at arms of R sin u + cos u and R (1 - cos u) + sin u."""
    from scipy.integrate import quad

    radius, force = 2 / math.pi, 0.01
    bodies = {"A": rod(16, curvature=[math.pi / 2]), "B": rod(4)}
    found = statics(pulled([0, 0, math.pi / 2], (0, 0, force), bodies=bodies))
    assert found.ok
    bent = quad(lambda u: (radius * math.sin(u) + math.cos(u)) ** 2, 0, math.pi / 2)[0] * radius
    twisted = quad(lambda u: (radius * (1 - math.cos(u)) + math.sin(u)) ** 2, 0, math.pi / 2)[0] * radius
    closed = force * (bent / WEAK + twisted / TORSION + 1 / (3 * WEAK))
    assert found.marker("e")[:2] == pytest.approx([radius, radius + 1.0], rel=1e-6)
    assert found.marker("e")[2] == pytest.approx(closed, rel=1e-3)


@pytest.mark.parametrize(("angle", "close"), [(math.pi / 2, 1e-12), (0.7, 1e-9), (-2.0, 1e-9)])
@pytest.mark.parametrize("told", [False, True])
@pytest.mark.by_day(2)
def test_a_bent_pendulum_swings_in_space_as_in_the_plane(angle: float, close: float, told: bool) -> None:
    """With the same quadrature cables have the same theory; further axes of sections have a little inertia."""

    def tip(dimensions: int, element: str) -> Array:
        bar = rod(4, element=element) | SOFT | {"width": 0.03}
        bar = bar | ({"quadrature": "reduced"} if element == "ancf-cable" else {})
        start = {"A": {"angle": 0.3}} | ({} if told else {"B": {"angle": 0.3 + angle}})
        found = simulate(Scene.parse({
            "name": "bent", "dimensions": dimensions, "bodies": {"A": bar, "B": bar},
            "joints": {
                "O": {"kind": "revolute", "first": {"body": "ground", "point": [0, 0]}, "second": {"body": "A"}},
                "C": {"kind": "weld", "first": {"body": "A", "point": "end"}, "second": {"body": "B"}}
                | ({"angle": angle} if told else {}),
            },
            "markers": {"e": {"body": "B", "point": "end"}}, "initial": start,
            "solver": {"integrator": "leapfrog", "step": 2e-5},
        }), np.array([0.3]))  # fmt: skip
        assert found.ok
        return np.array([*found.marker("e")[-1], 0.0])[:3]

    assert tip(3, "director-rod") == pytest.approx(tip(2, "ancf-cable"), abs=close)


CABLE = {"element": "ancf-cable", "height": 0.03, "width": 0.03}
SQUARE = {"height": 0.03, "width": 0.03}


@pytest.mark.parametrize(
    ("rotation", "joint", "rods"),
    [
        (OBLIQUE, {}, ({}, {})),
        (OBLIQUE, {"kind": "revolute", "axis": [1, 2, -1]}, ({}, {})),
        (OBLIQUE, {"kind": "revolute", "axis": [0, 1, 0]}, ({}, {})),
        (OBLIQUE, {"kind": "universal", "axis": [1, 2, 0], "second_axis": [2, -1, 0.5]}, ({}, {})),
        (OBLIQUE, {}, (CABLE, SQUARE)),
        (OBLIQUE, {}, (SQUARE, CABLE)),
        ((0, 0, 0), {}, (SQUARE, CABLE)),
        ((0, -math.pi / 2, 0), {"kind": "revolute", "axis": [0, 0, 1]}, (CABLE, SQUARE)),
    ],
)
@pytest.mark.by_day(2)
def test_rods_hold_each_other_as_with_a_tiny_body_between(rotation: Any, joint: Any, rods: Any) -> None:
    A, B = rods
    with_none, with_one = (
        simulate(swinging(rotation, joint=joint, A=A, B=B, between=between), FEW) for between in (False, True)
    )
    assert with_none.ok and with_one.ok  # noqa: PT018
    assert with_none.marker("e") == pytest.approx(with_one.marker("e"), abs=1e-7)
    assert with_none.energy_drift[0] < 1e-8
    assert with_none.constraint_drift[0] < 1e-12


def test_an_oblique_hinge_of_a_rod_on_the_ground_is_that_of_a_tiny_body() -> None:
    ends = []
    for between in (False, True):
        bodies: dict[str, Any] = {"A": rod(4, **SOFT)}
        ground, first = {"body": "ground", "point": [0, 0, 0]}, {"body": "A"}
        joints: dict[str, Any] = {"O": {"kind": "revolute", "first": ground, "second": first, "axis": [1, 2, -1]}}
        if between:
            bodies["X"] = {"kind": "rigid-body", "mass": 1e-6, "inertia": 1e-9}
            joints["O"]["second"] = {"body": "X"}
            joints["X"] = {"kind": "weld", "first": {"body": "X"}, "second": first}
        scene = Scene.parse({
            "name": "oblique", "dimensions": 3, "gravity": [0, -3, -9.81], "bodies": bodies, "joints": joints,
            "markers": {"e": {"body": "A", "point": "end"}}, "solver": {"integrator": "leapfrog", "step": 2e-5},
        })  # fmt: skip
        ends.append(simulate(scene, FEW).marker("e"))
    assert ends[0] == pytest.approx(ends[1], abs=1e-7)


@pytest.mark.parametrize("rotation", [OBLIQUE, (0, 0, math.pi / 2), (0, 0, 0)])
def test_the_weld_of_two_rods_bears_what_the_second_needs(rotation: Any) -> None:
    force = np.array([0.03, -0.05, 0.07])
    scene = pulled(rotation, force)
    rest = statics(scene)
    (found,) = reactions(scene.with_values({"initial.from": "statics"}), [0.0])
    assert found.ok
    assert found.redundancy == 0
    assert found.joints["C"].unique
    assert found.joints["C"].force == pytest.approx(-force, abs=1e-6)
    assert found.joints["C"].torque == pytest.approx(-np.cross(rest.marker("e") - rest.marker("c"), force), abs=1e-8)


def test_two_rods_welded_in_line_vibrate_as_one() -> None:
    """The director of both is the same, so that one of them gets the third axis of its section as a vector."""
    both = modes(frame((0, 0, 0)), count=6)
    data = frame((0, 0, 0)).model_dump(mode="json", exclude_unset=True)
    data |= {"bodies": {"A": rod(8, length=2.0)}, "markers": {"e": {"body": "A", "point": "end"}}, "initial": {}}
    del data["joints"]["C"]
    one = modes(Scene.parse(data), count=6)
    assert both.ok and one.ok  # noqa: PT018
    assert both.frequencies == pytest.approx(one.frequencies, rel=1e-6)


@pytest.mark.slow
def test_frames_of_all_angles_run_in_lanes_and_go_on() -> None:
    engine, scene = get_engine("gauss"), swinging(OBLIQUE)
    values = {"bodies.B.youngs_modulus": np.array([1e8, 2e8, 3e8]), "initial.B.rotation.0": np.array([0.3, 0.4, 1.5])}
    lanes = engine.simulate_many(scene, values, FEW)
    assert lanes.ok
    for k in range(3):
        alone = engine.simulate(scene.with_values({name: float(one[k]) for name, one in values.items()}), FEW)
        assert lanes.points[..., k] == pytest.approx(alone.points[..., 0], abs=1e-12)
    half, whole = engine.simulate(scene, [0.0, 0.1]), engine.simulate(scene, FEW)
    again = engine.simulate(scene.with_values({"initial.from": half.end}), [0.0, 0.2])
    assert again.points[-1] == pytest.approx(whole.points[-1], abs=1e-9)


@pytest.mark.parametrize("thick", [1e-3, 2e-5])
def test_threads_hold_each_other_too(thick: float) -> None:
    """Directors of a thread are light: its constraints must not seem dependent."""
    thin = {"height": thick, "width": thick, "youngs_modulus": 2e9}
    scene = frame((0, 0.2, 0.7), bodies={name: rod(2, **thin) for name in "AB"}, gravity=[0, -1, -2])
    found = simulate(scene, np.array([0.2]))
    assert found.ok
    assert found.constraint_drift[0] < 1e-7


@pytest.mark.slow
def test_a_frame_swings_as_with_exact_beams_of_exudyn() -> None:
    """Its beams are of second order: with twice the elements the difference is a third and less."""
    pytest.importorskip("exudyn")
    away = []
    for elements in (4, 8):
        thin = {"height": 0.015, "width": 0.01, "youngs_modulus": 2e9, "elements": elements}
        scene = swinging(OBLIQUE, A=thin, B=thin)
        ours = simulate(scene, FEW)
        theirs = get_engine("exudyn-ge").simulate(scene.with_values({"solver.step": 1e-3}), FEW)
        assert ours.ok and theirs.ok  # noqa: PT018
        away.append(float(np.abs(ours.marker("e") - theirs.marker("e")).max()))
    assert away[1] < 5e-4
    assert away[0] > 3 * away[1]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"A": CABLE, "B": CABLE}, r"joints.C: welds the cables A and B at 5\d(\.\d)? degrees.*element: director-rod"),
        ({"A": CABLE, "B": SQUARE, "joint": {"kind": "revolute", "axis": [1, 2, -1]}},
         r"joints.C.axis: \(1, 2, -1\) is neither along the rod A nor at a right angle"),
        ({"A": CABLE, "B": SQUARE, "joint": {"kind": "universal", "axis": [1, 2, 0], "second_axis": [2, -1, 0.5]}},
         "joints.C: holds a section of A, and ancf-cable has none"),
    ],
)  # fmt: skip
def test_what_a_cable_cannot_hold_is_refused(change: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        simulate(swinging(OBLIQUE, **change), FEW)


def test_a_weld_between_the_nodes_of_a_rod_is_refused() -> None:
    data = swinging(OBLIQUE).model_dump(mode="json", exclude_unset=True)
    data["joints"]["C"]["first"]["point"] = [0.3, 0, 0]
    message = "joints.C: holds the section of the director-rod A at 0.3 m, where it has no node; use a point at a mult"
    with pytest.raises(InputError, match=message):
        simulate(Scene.parse(data), FEW)


@pytest.mark.parametrize("kind", ["parallel", "perpendicular"])
def test_directions_of_two_cables_are_held_in_space_as_in_the_plane(kind: str) -> None:
    def ends(dimensions: int) -> Array:
        bars = {name: rod(3, element="ancf-cable") | SOFT | {"width": 0.03, "length": 1.0 + 0.5 * k}
                for k, name in enumerate("AB")}  # fmt: skip
        hinges = {name: {"kind": "revolute", "first": {"body": "ground", "point": [0.7 * k, 0]},
                         "second": {"body": name}} for k, name in enumerate("AB")}  # fmt: skip
        found = simulate(Scene.parse({
            "name": "two", "dimensions": dimensions, "bodies": bars,
            "joints": hinges | {"C": {"kind": kind, "first": {"body": "A"}, "second": {"body": "B"}}},
            "markers": {name: {"body": name, "point": "end"} for name in "AB"},
            "initial": {"A": {"angle": 0.3}, "B": {"angle": 0.3 - (kind == "perpendicular") * math.pi / 2}},
            "solver": {"integrator": "leapfrog", "step": 2e-5},
        }), np.array([0.3]))  # fmt: skip
        assert found.ok
        return np.array([found.marker(name)[-1, :2] for name in "AB"])

    assert ends(3) == pytest.approx(ends(2), abs=1e-9)
