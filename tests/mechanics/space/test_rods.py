"""Flexible rods in space, against the plane and against Exudyn's cables and a quintic element of another author."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from shoal.errors import InputError
from shoal.mechanics.analysis.modes import modes
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene, load_scene
from shoal_validation.spatial.machines import cable, flexible_pendulum

HELD = {"body": "ground", "point": [0, 0, 0]}


def pendulum(**more: Any) -> Scene:
    """Two rods of 1 m and 2 m on spherical joints, spun about the vertical, on a fine mesh."""
    return flexible_pendulum(**{"bodies": {"OA": cable(1.0, 32, 2e8), "AB": cable(2.0, 64, 2e7)}, **more})


def test_a_flexible_spherical_double_pendulum_ends_where_exudyns_does() -> None:
    """32 and 64 cables of Exudyn and 8 and 16 quintic elements agree on these digits, +-1e-6."""
    found = simulate(pendulum(), np.array([0.5]))
    assert found.ok
    assert found.marker("A")[-1] == pytest.approx([0.677293, -0.321390, -0.661664], abs=2e-6)
    assert found.marker("B")[-1] == pytest.approx([1.920270, 0.149686, -2.134790], abs=2e-6)


def both(data: dict[str, Any], end: float) -> None:
    """Compare a planar scene in the plane and in space."""
    times = np.linspace(0.0, end, 5)
    plane, space = (simulate(Scene.parse({**data, "dimensions": d}), times) for d in (2, 3))
    assert plane.ok
    assert space.ok, space.message
    assert np.max(np.abs(space.points[:, :, :2] - plane.points)) < 1e-9
    assert np.max(np.abs(space.points[:, :, 2])) < 1e-12
    assert np.max(np.abs(space.angles - plane.angles)) < 1e-9


def test_the_flexible_double_pendulum_moves_in_space_as_in_the_plane() -> None:
    both(load_scene("flexible-double-pendulum").model_dump(mode="json", exclude_unset=True), 0.2)


@pytest.mark.slow
def test_welded_damped_tapered_and_hinged_rods_move_in_space_as_in_the_plane() -> None:
    tip = {
        "kind": "rigid-body",
        "mass": 2.0,
        "inertia": 0.1,
        "centre_of_mass": [0.1, 0.05],
        "named_points": {"e": [0.2, 0.1]},
    }
    both({
        "name": "crane",
        "bodies": {"boom": cable(1.0, 3, 2e8, retardation=1e-3), "head": tip,
                   "jib": cable(0.5, 2, 2e7, end_height=0.02), "arm": cable(0.6, 2, 2e8)},
        "joints": {
            "foot": {"kind": "weld", "first": {"body": "ground", "point": [0, 0]}, "second": {"body": "boom"}},
            "W": {"kind": "weld", "first": {"body": "boom", "point": "end"}, "second": {"body": "head"}},
            "J": {"kind": "revolute", "first": {"body": "head", "point": "e"}, "second": {"body": "jib"},
                  "friction": 0.3},
            "R": {"kind": "revolute", "first": {"body": "jib", "point": "end"}, "second": {"body": "arm"}},
        },
        "loads": {"wind": {"kind": "distributed-force", "body": "boom", "force": [3.0, -2.0]},
                  "push": {"kind": "force", "at": {"body": "jib", "point": "end"}, "force": [5.0, 1.0]}},
        "markers": {"h": {"body": "head", "point": "e"}, "j": {"body": "jib", "point": "end"},
                    "m": {"body": "boom", "point": [0.37, 0.0]}, "a": {"body": "arm", "point": "end"}},
        "initial": {"boom": {"angle": 0.7}, "head": {"angle": 0.2}, "jib": {"angle": -1.0}, "arm": {"angle": -1.5}},
        "solver": {"integrator": "leapfrog", "step": 2e-5},
    }, 0.1)  # fmt: skip


def test_a_rod_swings_in_any_plane_as_in_one() -> None:
    """The same clamped rod under the same gravity, turned as a whole: the motion turns with it."""
    swings_alike(cable(1.0, 4, 2e8), 0.2, {"integrator": "leapfrog", "step": 5e-5})


@pytest.mark.parametrize("element", ["ancf-cable", "ancf-quintic"])
@pytest.mark.by_day(1)
def test_a_damped_rod_bends_from_straight_in_any_plane_as_in_one(element: str) -> None:
    """The plane of round-off was damped alone, which blew up implicit steps (Kelvin and Voigt's material)."""
    wire = cable(1.0, 3, 1e10, element=element, retardation=2e-3, height=1.5e-3, width=1.5e-3)
    swings_alike(wire, 0.05, {"integrator": "generalized-alpha", "step": 1e-3})


@pytest.mark.parametrize("element", ["ancf-cable", "ancf-quintic"])
def test_a_straight_rod_damps_small_motions_in_every_plane(element: str) -> None:
    """Kelvin and Voigt: a mode's damping ratio is half its angular frequency times the retardation; it was 0."""
    body = {"B": cable(1.0, 4, 2e8, element=element, retardation=1e-3)}
    weld = {"kind": "weld", "first": HELD, "second": {"body": "B"}}
    scene = {"name": "reed", "dimensions": 3, "gravity": [0, 0, 0], "bodies": body, "joints": {"W": weld},
             "markers": {"e": {"body": "B", "point": "end"}}}  # fmt: skip
    for mode in modes(Scene.parse(scene), count=4).modes:
        assert mode.damping_ratio == pytest.approx(0.5e-3 * mode.angular_frequency, rel=1e-6)


def swings_alike(body: dict[str, Any], duration: float, solver: dict[str, Any]) -> None:
    """Compare the end of a clamped rod that falls with that of the same, turned as a whole."""
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_rotvec([0.4, -1.1, 0.7])

    def end(rotation: Rotation) -> Any:
        scene = Scene.parse({
            "name": "cantilever", "dimensions": 3, "gravity": rotation.apply([0, -9.81, 0]).tolist(),
            "bodies": {"B": body},
            "joints": {"W": {"kind": "weld", "first": {"body": "ground", "point": [0, 0, 0]}, "second": {"body": "B"}}},
            "markers": {"e": {"body": "B", "point": "end"}},
            "initial": {"B": {"rotation": rotation.as_rotvec().tolist()}},
            "solver": solver,
        })  # fmt: skip
        found = simulate(scene, np.array([duration]))
        assert found.ok, found.message
        return found.marker("e")[-1]

    assert end(turn) == pytest.approx(turn.apply(end(Rotation.identity())), abs=1e-9)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"bodies": {"OA": cable(1.0, 2, 2e8, width=0.02), "AB": cable(2.0, 2, 2e7)}}, "width must be its height"),
        ({"bodies": {"OA": cable(1.0, 2, 2e8, curvature=[0.1]), "AB": cable(2.0, 2, 2e7)}},
         "curved rod is a director-rod"),
        (
            {"joints": {"O": {"kind": "revolute", "first": HELD, "second": {"body": "OA"},
                              "axis": [1, 0, 1]},
                        "A": {"kind": "spherical", "first": {"body": "OA", "point": "end"}, "second": {"body": "AB"}}}},
            "neither along the rod OA nor at a right angle",
        ),
        ({"loads": {"T": {"kind": "torque", "at": {"body": "OA"}, "torque": 1.0}}}, "acts on rigid bodies"),
    ],
)  # fmt: skip
def test_what_no_cable_can_do_is_refused(change: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        simulate(pendulum(**change), np.array([0.1]))


def test_a_rod_that_joints_would_bend_at_the_start_is_refused() -> None:
    """Hinged at both ends to the ground, a little farther apart than it is long."""
    ends = {
        name: {
            "kind": "spherical",
            "first": {"body": "ground", "point": [x, 0, 0]},
            "second": {"body": "OA", "point": at},
        }
        for name, x, at in (("O", 0.0, "start"), ("E", 1.01, "end"))
    }
    held = pendulum(
        bodies={"OA": cable(1.0, 2, 2e8)}, joints=ends, markers={"m": {"body": "OA", "point": "centre"}}, initial={}
    )
    with pytest.raises(InputError, match=r"initial\.OA: .* unstrained rod would"):
        simulate(held, np.array([0.1]))


@pytest.mark.slow
def test_lanes_of_rods_in_space_equal_singles() -> None:
    """Spins and lengths side by side; the kernels for lanes take a while to compile."""
    machine = pendulum().with_values({"bodies.OA.elements": 2, "bodies.AB.elements": 4, "solver.step": 1e-4})
    values = {
        "initial.OA.spin.1": np.array([2.0, 1.0, 0.5, 0.0, 1.5]),
        "bodies.AB.length": np.array([2.0, 1.9, 2.1, 2.0, 2.0]),
    }
    found = simulate(machine, np.array([0.3]), values)
    assert found.ok
    for lane in range(5):
        alone = simulate(machine.with_values({path: x[lane] for path, x in values.items()}), np.array([0.3]))
        assert found.points[..., lane] == pytest.approx(alone.points[..., 0], abs=1e-12)
