"""Exudyn in space: its joints, loads and cables against the native solver, at its own order of convergence."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.engines.compare import compare
from shoal.errors import InputError
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene, load_scene
from shoal.trajectory import Array, Status
from shoal_validation.spatial.machines import PUBLISHED, bricard, cable, flexible_pendulum

pytest.importorskip("exudyn")

FINE = {"integrator": "dop853", "relative_tolerance": 1e-11, "absolute_tolerance": 1e-12}
HELD = {"body": "ground", "point": [0.0, 0.0, 0.0]}
AXIS, OTHER = [0.3, 0.5, -0.7], [1.0, 0.0, 2.0]
LINK = {"kind": "rigid-body", "mass": 1.5, "inertia": [0.05, 0.2, 0.22], "centre_of_mass": [0.4, 0.1, 0.05],
        "named_points": {"end": [0.8, 0.0, 0.1]}}  # fmt: skip


def end(number: int) -> dict[str, Any]:
    return {"body": f"B{number}", "point": "end"}


def begin(number: int) -> dict[str, Any]:
    return {"body": f"B{number}"}


def chain(*joints: dict[str, Any], **more: Any) -> Scene:
    """Equal links from the ground on, one a joint, turned at random."""
    rng = np.random.default_rng(3)
    names = [f"B{k}" for k in range(len(joints))]
    return Scene.parse({
        "name": "chain", "dimensions": 3, "gravity": [0.3, -1, -9.81], "solver": FINE,
        "bodies": dict.fromkeys(names, LINK),
        "joints": {f"J{k}": {"first": end(k - 1) if k else HELD, "second": begin(k), **one}
                   for k, one in enumerate(joints)} | more.pop("closing", {}),
        "markers": {name: {"body": name, "point": "end"} for name in names},
        "initial": {name: {"rotation": rng.normal(size=3).tolist()} for name in names}, **more,
    })  # fmt: skip


def gaps(machine: Scene, times: Array, step: float) -> list[float]:
    """Distances of Exudyn's markers from the native ones [m], with a step and with half of it."""
    ours = simulate(machine, times)
    assert ours.ok, ours.message
    found = []
    for one in (step, step / 2):
        theirs = get_engine("exudyn").simulate(machine.with_values({"solver.step": one}), times)
        assert theirs.ok, theirs.message
        assert np.max(np.abs(np.sin(theirs.angles - ours.angles))) < 1e-3
        found.append(ours.distance(theirs))
    return found


KINDS: dict[str, list[dict[str, Any]]] = {
    "revolute": [{"axis": AXIS, "friction": 0.2, "coulomb": 0.1}],
    "universal": [{"kind": "universal", "axis": [1, 0, 0], "second_axis": [0, 1, 1]}],
    "slider": [{"kind": "slider", "axis": AXIS, "friction": 0.2}],
    "locked slider": [{"kind": "spherical"}, {"kind": "slider", "direction": 0.4, "rotation": "locked"}],
    "cylindrical": [{"kind": "cylindrical", "axis": AXIS}, {"kind": "spherical"}],
    "planar": [{"kind": "planar", "axis": AXIS}, {"kind": "revolute", "axis": OTHER}],
    "free planar": [{"kind": "planar", "axis": AXIS, "rotation": "free"}],
    "locked planar": [{"kind": "revolute", "axis": OTHER}, {"kind": "planar", "axis": AXIS, "rotation": "locked"}],
    "weld": [{"kind": "spherical"}, {"kind": "weld"}, {"kind": "revolute", "axis": AXIS}],
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.by_day(2)
def test_every_joint_moves_as_in_the_native_solver(kind: str) -> None:
    far, near = gaps(chain(*KINDS[kind]), np.array([0.1, 0.2]), 2e-3)
    assert near < 1e-5
    assert near < far / 3.5 or far < 1e-8


def between(kind: str, **more: Any) -> dict[str, Any]:
    return {"L": {"kind": kind, "first": begin(0), "second": begin(1), **more}}


LOADS: dict[str, dict[str, Any]] = {
    "spring": {"L": {"kind": "spring", "first": HELD, "second": end(1), "stiffness": 20.0, "damping": 1.0}},
    "torsion": between("torsion-spring", stiffness=20.0, damping=0.1, cubic=2.0, angle=0.2, axis=OTHER),
    "follower": {"L": {"kind": "force", "at": end(1), "force": [3, 4, 5], "follows": True}},
    "scaled force": {"L": {"kind": "force", "at": end(1), "force": [3, 4, 5], "scale": "sin(3*t)"}},
    "inner torque": {"L": {"kind": "torque", "at": end(1), "torque": "2*cos(t)", "axis": OTHER, "reaction": begin(0)}},
    "torque": {"L": {"kind": "torque", "at": end(1), "torque": 2.0, "axis": OTHER}},
}


@pytest.mark.parametrize("load", LOADS)
@pytest.mark.by_day(2)
def test_every_load_acts_as_in_the_native_solver(load: str) -> None:
    """Linked by revolute joints; the torsion spring is stiff, and its error at this step is what it is."""
    machine = chain({"axis": AXIS}, {"axis": OTHER}, loads=LOADS[load])
    far, near = gaps(machine, np.array([0.1, 0.2]), 2e-3)
    assert near < 2e-5
    assert near < far / 3.5


@pytest.mark.slow
def test_a_driven_angle_and_a_moving_ground_point_lead_a_machine() -> None:
    """The body's energy is not followed, the positions are."""
    base = {"body": "ground", "point": "P"}
    machine = Scene.parse({
        "name": "driven", "dimensions": 3, "gravity": [0, 0, -9.81], "solver": FINE,
        "bodies": {"B0": LINK, "B1": LINK}, "markers": {"e": end(1)},
        "ground_points": {"P": {"x": "0.1*sin(3*t)", "z": "0.05*t"}},
        "joints": {
            "R": {"first": base, "second": begin(0), "axis": AXIS},
            "D": {"kind": "driven-angle", "first": HELD, "second": begin(0), "angle": "0.5*t*t", "axis": AXIS},
            "S": {"kind": "spherical", "first": end(0), "second": begin(1)},
        },
    })  # fmt: skip
    far, near = gaps(machine, np.array([0.2, 0.4]), 2e-3)
    assert near < 1e-5
    assert near < far / 3.5


def test_a_spherical_pendulum_and_a_comparison_of_it() -> None:
    start = {"position": [math.sin(math.pi / 3), 0, -0.5], "velocity": [0, 2 * math.sin(math.pi / 3), 0]}
    pendulum = Scene.parse({
        "name": "pendulum", "dimensions": 3, "gravity": [0, 0, -9.81],
        "bodies": {"P": {"kind": "point-mass", "mass": 1}},
        "joints": {"S": {"kind": "distance", "first": HELD, "second": {"body": "P"}}},
        "markers": {"P": {"body": "P"}}, "initial": {"P": start}, "solver": {"step": 5e-4},
    })  # fmt: skip
    found = compare(pendulum, ["gauss", "exudyn"], [1.0])
    assert found.ok
    closed = [-0.738316659552752, -0.431492043650700, -0.518365823037175]
    assert found.trajectories["gauss"].marker("P")[-1] == pytest.approx(closed, abs=1e-9)
    assert found.trajectories["exudyn"].marker("P")[-1] == pytest.approx(closed, abs=1e-6)


def test_bricards_redundant_loop_is_stepped_over_and_checked() -> None:
    """Dependent rows: the dense solver that ignores them, constraints on the positions; order two to the reference."""
    away = []
    for step in (2e-3, 1e-3):
        found = get_engine("exudyn").simulate(bricard().with_values({"solver.step": step}), [1.0])
        assert found.ok, found.message
        assert found.model["dependent_constraints"] == 1
        away.append(float(np.linalg.norm(found.marker("P3")[-1] - PUBLISHED)))
    assert away[1] < 1e-6
    assert away[1] < away[0] / 3.5


def limit(machine: Scene, times: Array, step: float) -> Array:
    """Exudyn's motion without its error of second order, by Richardson's extrapolation."""
    runs = [
        get_engine("exudyn").simulate(machine.with_values({"solver.step": h, "solver.integrator": "auto"}), times)
        for h in (step, step / 2)
    ]
    assert all(run.ok for run in runs)
    return np.asarray((4 * runs[1].points - runs[0].points) / 3)


@pytest.mark.slow
def test_the_flexible_spherical_pendulum_is_exudyns_on_equal_meshes() -> None:
    times = np.array([0.02, 0.04])
    ours = simulate(flexible_pendulum(), times)
    assert np.max(np.abs(limit(flexible_pendulum(), times, 5e-5) - ours.points)) < 1e-8


@pytest.mark.slow
def test_cables_are_clamped_and_hinged_alike() -> None:
    """A clamped boom, a body welded to its tip, and a cable hinged to that at a right angle to the axis."""
    head = {"kind": "rigid-body", "mass": 2.0, "inertia": [0.1, 0.12, 0.15], "named_points": {"e": [0.2, 0.1]}}
    crane = flexible_pendulum(
        bodies={"OA": cable(1.0, 2, 2e8), "H": head, "AB": cable(0.5, 1, 2e8)},
        joints={"foot": {"kind": "weld", "first": HELD, "second": {"body": "OA"}},
                "W": {"kind": "weld", "first": {"body": "OA", "point": "end"}, "second": {"body": "H"}},
                "J": {"first": {"body": "H", "point": "e"}, "second": {"body": "AB"}, "axis": [0, 0, 1]}},
        loads={"wind": {"kind": "distributed-force", "body": "OA", "force": [3.0, -2.0, 1.0]},
               "push": {"kind": "force", "at": {"body": "AB", "point": "end"}, "force": [5.0, 1.0, 2.0]}},
        initial={"OA": {"rotation": [0.3, 0.5, 0.2]}, "H": {"angle": 0.2}, "AB": {"angle": -1.0}},
    )  # fmt: skip
    times = np.array([0.02, 0.04])
    assert np.max(np.abs(limit(crane, times, 5e-5) - simulate(crane, times).points)) < 3e-8


@pytest.mark.slow
def test_the_end_of_a_cable_slides_in_a_plane_and_on_a_line() -> None:
    """Both ends of a cable that falls: one on a line, the other in a plane."""
    start = np.array([math.cos(0.4), math.sin(0.4), 0.0])
    fallen = flexible_pendulum(
        bodies={"OA": cable(1.0, 3, 2e8)}, markers={"A": {"body": "OA", "point": "end"}, "O": {"body": "OA"}},
        joints={"L": {"kind": "slider", "first": HELD, "second": {"body": "OA"}, "axis": [1, 0, 1]},
                "P": {"kind": "planar", "first": {"body": "ground", "point": start.tolist()}, "rotation": "free",
                      "second": {"body": "OA", "point": "end"}, "axis": [1, 2, -1]}},
        initial={"OA": {"angle": 0.4}},
    )  # fmt: skip
    times = np.array([0.02, 0.04])
    assert np.max(np.abs(limit(fallen, times, 5e-5) - simulate(fallen, times).points)) < 3e-8


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"bodies": {"OA": cable(1.0, 2, 2e8, retardation=1e-3), "AB": cable(2.0, 2, 2e7)}},
         "OA.retardation: engine exudyn"),
        ({"joints": {"S": {"kind": "spherical", "first": HELD, "second": {"body": "OA"}},
                     "A": {"kind": "weld", "first": {"body": "OA", "point": "end"}, "second": {"body": "AB"}}},
          "initial": {}},
         "welds no two cables"),
        ({"bodies": {"OA": cable(1.0, 2, 2e8), "AB": cable(2.0, 2, 2e7, element="ancf-quintic")}},
         "cannot do ancf-quintic"),
    ],
)  # fmt: skip
def test_what_exudyn_cannot_do_in_space_is_refused(change: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        get_engine("exudyn").simulate(flexible_pendulum(**change), [0.01])


HINGE = {"kind": "revolute", "axis": [0.0, 1.0, 0.0]}
TORQUE = {"kind": "torque", "at": {"body": "R", "point": "end"}, "torque": "0.05*sin(20*t)", "axis": [1.0, 0.0, 0.0]}
WIND = {"kind": "distributed-force", "body": "R", "force": [0.0, 0.3, 0.2]}
HEAD = {"kind": "rigid-body", "mass": 0.02, "inertia": [2e-5, 3e-5, 4e-5], "centre_of_mass": [0.01, 0.05, 0.02],
        "named_points": {"c": [0.1, 0.24, 0.06]}}  # fmt: skip
TIP = {"kind": "weld", "first": {"body": "R", "point": "end"}, "second": {"body": "H"}}
CURVED = {"curvature": [1.0], "side_curvature": [1.0], "twist": [3.0]}


def beside_beams(rod: dict[str, Any], duration: float, foot: dict[str, Any] | None = None, **more: Any) -> float:
    """How far a slender director rod ends from Exudyn's beams [m], both extrapolated from two meshes.

    Shear is worth some 1e-5 of the motion.
    """
    shape = {"kind": "rod", "length": 0.8, "height": 0.004, "width": 0.006, "density": 2700.0, "youngs_modulus": 2e10,
             "elements": 8}  # fmt: skip
    end = {"body": "H", "point": "c"} if "H" in more.get("bodies", {}) else {"body": "R", "point": "end"}
    machine = Scene.parse(
        {"name": "rod", "dimensions": 3, "gravity": [0.0, 0.0, -9.81], "markers": {"e": end},
         "initial": {"R": {"rotation": [0.3, 0.2, -0.4]}}, "solver": {"duration": duration, "samples": 6}, **more,
         "bodies": {"R": shape | {"element": "director-rod"} | rod, **more.get("bodies", {})},
         "joints": {"W": (foot or {"kind": "weld"}) | {"first": HELD, "second": {"body": "R"}},
                    **more.get("joints", {})}}
    )  # fmt: skip
    limits = []
    for name in ("exudyn-ge", "gauss"):
        coarse, fine = (
            get_engine(name).simulate(machine.with_values({"bodies.R.elements": count})) for count in (8, 16)
        )
        assert coarse.ok, coarse.message
        assert fine.ok, fine.message
        limits.append((4 * fine.points - coarse.points) / 3)
    return float(np.max(np.abs(limits[0] - limits[1])))


@pytest.mark.slow
def test_geometrically_exact_beams_bend_and_twist_as_director_rods_do() -> None:
    """A curved and twisted rod with a body off its axis."""
    assert beside_beams(CURVED, 0.02, bodies={"H": HEAD}, joints={"T": TIP}) < 2e-5


@pytest.mark.slow
@pytest.mark.parametrize(
    "case",
    [
        {"rod": {"curvature": [1.0]}},
        {"rod": {"side_curvature": [1.0, 2.0]}},
        {"rod": {"twist": [4.0]}},
        {"rod": CURVED},
        {"foot": HINGE, "initial": {"R": {"rotation": [0.0, 0.0, 0.0], "spin": [0.0, 2.0, 0.0]}}},
        {"loads": {"M": TORQUE, "W": WIND}},
        {"rod": CURVED, "bodies": {"H": HEAD}, "joints": {"T": TIP}},
    ],
    ids=["curved", "to-the-side", "twisted", "helix", "hinged", "loaded", "head"],
)
def test_geometrically_exact_beams_move_as_director_rods_do(case: dict[str, Any]) -> None:
    assert beside_beams(**{"rod": {}, "duration": 0.3, **case}) < 4e-5


def test_geometrically_exact_beams_hold_what_they_can() -> None:
    with pytest.raises(InputError, match=r"R.retardation: engine exudyn-ge cannot do damped rods in space; use gauss"):
        beside_beams({"retardation": 1e-3}, 0.01)


def test_beams_whose_run_ends_early_say_so() -> None:
    """What Exudyn leaves of the rest of the run has no frames."""
    pendulum = load_scene("flexible-spherical-double-pendulum").with_values({"solver.step": 0.05})
    run = get_engine("exudyn-ge").simulate(pendulum, [0.05, 0.5])
    assert run.status == (Status.FAILED,)
    assert run.codes == ["engine-stopped"]
