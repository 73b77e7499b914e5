"""Which values of a start in space give way when a length changes, against the same machine in the plane."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from shoal.errors import InputError
from shoal.mechanics.assembly.build import build
from shoal.mechanics.assembly.space import start
from shoal.mechanics.frames import RigidFrame
from shoal.mechanics.simulate import simulate
from shoal.mechanics.start.closure import Closure
from shoal.mechanics.start.start import body_states
from shoal.scene import Scene
from shoal.trajectory import Status

CRANK, ROD, ANGLE, RATE = 0.3, 1.0, 0.6, 7.0


def slider_crank(dimensions: int) -> Scene:
    """Its crank is stated first, so that the rod follows."""
    turned = -math.asin(CRANK * math.sin(ANGLE) / ROD)
    ground = {"body": "ground", "point": [0.0] * dimensions}
    bar: dict[str, Any] = {"kind": "rod", "height": 0.02, "width": 0.02, "density": 7800.0}
    space = dimensions == 3
    return Scene.parse({
        "name": "slider-crank", "dimensions": dimensions, "gravity": [0.0, -9.81],
        "bodies": {"crank": {**bar, "length": CRANK}, "rod": {**bar, "length": ROD}},
        "joints": {
            "O": {"first": ground, "second": {"body": "crank"}},
            "P": {"kind": "spherical" if space else "revolute", "first": {"body": "crank", "point": "end"},
                  "second": {"body": "rod"}},
            "S": {"kind": "slider", "first": ground, "second": {"body": "rod", "point": "end"},
                  **({"axis": "x"} if space else {})},
        },
        "markers": {"P": {"body": "crank", "point": "end"}, "S": {"body": "rod", "point": "end"}},
        "initial": {
            "crank": {"rotation": [0, 0, ANGLE], "spin": [0, 0, RATE]} if space else {"angle": ANGLE, "rate": RATE},
            "rod": {"rotation": [0, 0, turned]} if space else {"angle": turned},
        },
        "solver": {"integrator": "dop853"},
    })  # fmt: skip


def test_after_a_length_changes_a_loop_keeps_its_first_values_as_in_the_plane() -> None:
    lengths = np.array([0.25, 0.3, 0.33])
    times = np.linspace(0.0, 0.5, 6)
    plane, space = (simulate(slider_crank(d), times, {"bodies.crank.length": lengths}) for d in (2, 3))
    assert plane.ok
    assert space.ok
    for lane, length in enumerate(lengths):
        assert space.marker("P", lane)[0, :2] == pytest.approx(length * np.array([math.cos(ANGLE), math.sin(ANGLE)]))
        for name in ("P", "S"):
            assert space.marker(name, lane)[:, :2] == pytest.approx(plane.marker(name, lane), abs=1e-9)
    alone = simulate(slider_crank(3).with_values({"bodies.crank.length": 0.33}), times)
    assert alone.marker("S") == pytest.approx(space.marker("S", 2), abs=1e-12)


LINK = {"kind": "rigid-body", "mass": 1.5, "inertia": [0.2, 0.25, 0.3], "named_points": {"end": [0.8, 0.1, 0.0]}}
GEARS = Scene.parse({
    "name": "gears", "dimensions": 3, "gravity": [0.0, 0.0, -9.81],
    "bodies": {"A": LINK, "B": LINK, "C": LINK},
    "joints": {
        "a": {"first": {"body": "ground", "point": [0, 0, 0]}, "second": {"body": "A"}},
        "b": {"first": {"body": "ground", "point": [1, 0, 0]}, "second": {"body": "B"}, "axis": "x"},
        "gear": {"kind": "gear", "first": {"body": "A"}, "second": {"body": "B"}, "ratio": "-1/2", "second_axis": "x"},
        "c": {"kind": "universal", "first": {"body": "B", "point": "end"}, "second": {"body": "C"}, "axis": [1, 0, 0],
              "second_axis": [0, 1, 0]},
    },
    "markers": {"C": {"body": "C", "point": "end"}},
    "initial": {"B": {"position": [1, 0, 0]}},
    "solver": {"integrator": "dop853"},
})  # fmt: skip


@pytest.mark.parametrize(("path", "values"), [
    ("joints.gear.axis.2", [1.0, 1.1]),
    ("joints.c.second.point", None),
    ("bodies.B.named_points.end.1", [0.1, 0.15]),
    ("bodies.C.centre_of_mass.0", [0.0, 0.2]),
])  # fmt: skip
def test_what_is_varied_moves_as_a_machine_that_states_it(path: str, values: Any) -> None:
    scene, times = GEARS, np.array([0.3, 1.0])
    if values is None:
        scene, path, values = GEARS.with_values({path: [0.1, 0.2, 0.0]}), f"{path}.0", [0.1, 0.3]
    varied = simulate(scene, times, {path: np.array(values)})
    for lane, value in enumerate(values):
        assert varied.marker("C", lane) == pytest.approx(
            simulate(scene.with_values({path: value}), times).marker("C"), abs=1e-9
        )


@pytest.mark.parametrize("path", ["joints.S.friction", "joints.S.coulomb_speed", "bodies.B.named_points.end.0"])
def test_what_slides_keeps_its_speed_when_its_joint_changes(path: str) -> None:
    """Down an incline at 0.6 rad, faster than friction holds."""
    along = np.array([math.cos(0.6), 0.0, -math.sin(0.6)])
    slope = along.tolist()
    scene = Scene.parse({
        "name": "slide", "dimensions": 3, "gravity": [0.0, 0.0, -9.81], "bodies": {"B": LINK},
        "joints": {"S": {"kind": "slider", "first": {"body": "ground", "point": [0, 0, 0]}, "second": {"body": "B"},
                         "axis": slope, "rotation": "locked", "coulomb": 1.0, "friction": 1e-9}},
        "markers": {"B": {"body": "B"}}, "initial": {"B": {"velocity": slope}}, "solver": {"integrator": "dop853"},
    })  # fmt: skip
    changed = scene.with_values({path: {"joints.S.friction": 2e-9}.get(path, 0.005)})
    pull = 9.81 * math.sin(0.6) - 1.0 / 1.5
    for one in (scene, changed):
        assert simulate(one, np.array([1.0])).marker("B")[0] @ along == pytest.approx(1.0 + 0.5 * pull, abs=1e-7)


@pytest.mark.parametrize("driven", [True, False])
def test_a_rod_on_a_turning_hub_starts_as_a_rigid_body_as_in_the_plane(driven: bool) -> None:
    """And stretches by rho w^2 L^3 / 3 E once its vibration along the axis is damped out."""
    rate, times = 30.0, np.linspace(0.0, 0.04, 5)
    rod = {"kind": "rod", "length": 1.0, "height": 0.02, "width": 0.02, "density": 1000.0, "youngs_modulus": 2e9,
           "element": "ancf-cable", "elements": 4, "retardation": 2e-3}  # fmt: skip
    tips = []
    for dimensions in (2, 3):
        ground = {"body": "ground", "point": [0.0] * dimensions}
        hub = {
            "joints": {"D": {"kind": "driven-angle", "first": ground, "second": {"body": "H"}, "angle": f"{rate}*t"}}
        }
        spin = {"H": {"rate": rate} if dimensions == 2 else {"spin": [0, 0, rate]}}
        scene = Scene.parse({
            "name": "hub", "dimensions": dimensions, "gravity": [0.0] * dimensions,
            "bodies": {"H": {"kind": "rigid-body", "mass": 1.0, "inertia": 0.1}, "R": rod},
            "joints": {"O": {"first": ground, "second": {"body": "H"}},
                       "W": {"kind": "weld", "first": {"body": "H"}, "second": {"body": "R"}},
                       **(hub["joints"] if driven else {})},
            "markers": {"E": {"body": "R", "point": "end"}}, "initial": {} if driven else spin,
            "solver": {"integrator": "generalized-alpha", "step": 1e-4},
        })  # fmt: skip
        found = simulate(scene, times)
        assert found.ok, found.message
        tips.append(found.marker("E")[:, :2])
    assert tips[1] == pytest.approx(tips[0], abs=1e-6)
    assert np.linalg.norm(tips[1][-1]) - 1.0 == pytest.approx(1000.0 * rate**2 / (3 * 2e9), rel=0.05)


@pytest.mark.parametrize("turns", [0, 1])
@pytest.mark.parametrize("short", [True, False])
def test_what_a_start_in_space_changes_is_told_as_it_is_stated(short: bool, turns: int) -> None:
    """A bar that a rod of length d holds at the angle arccos((1 + 4 - d^2) / 4); whole turns of the bar are nothing."""
    ground = {"body": "ground", "point": [0.0, 0.0, 0.0]}
    bar = {"kind": "rigid-body", "mass": 1.0, "inertia": [0.1, 0.1, 0.1], "named_points": {"end": [1.0, 0.0, 0.0]}}
    stated, asked = 2 * math.pi * turns + math.acos((5 - 1.5**2) / 4), math.acos((5 - 1.4**2) / 4)
    turned = {"angle": stated, "rate": 5.0} if short else {"rotation": [0, 0, stated], "spin": [0, 0, 5.0]}
    scene = Scene.parse({
        "name": "held", "dimensions": 3, "bodies": {"a": bar},
        "joints": {
            "O": {"first": ground, "second": {"body": "a"}},
            "d": {"kind": "distance", "first": {"body": "ground", "point": [2.0, 0.0, 0.0]},
                  "second": {"body": "a", "point": "end"}, "length": 1.5},
        },
        "markers": {"e": {"body": "a", "point": "end"}}, "initial": {"a": turned},
    })  # fmt: skip
    told = simulate(scene.with_values({"joints.d.length": 1.4}), np.array([0.001])).model
    pose, speed = ("angle", "rate") if short else ("rotation", "spin")
    assert set(told["initial_changes"]["a"]) == {pose, speed}
    changed = told["initial_changes"]["a"][pose]
    assert changed["stated"] == turned[pose]
    assert np.atleast_1d(changed["used"])[-1] == pytest.approx(2 * math.pi * turns + asked, abs=1e-9)
    assert told["initial_correction"] == pytest.approx(stated - 2 * math.pi * turns - asked, abs=1e-9)
    assert told["initial_rate_correction"] == pytest.approx(5.0, abs=1e-9)
    held = scene.with_values({"initial.a.rate" if short else "initial.a.spin": 0.0 if short else [0, 0, 0]})
    assert simulate(held, np.array([0.001])).model["initial_changes"] == {}


def test_a_loop_that_no_poses_close_is_given_up_early(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two rods of 1 m between balls 3 m apart."""
    rod = {"kind": "rod", "length": 1.0, "height": 0.02, "width": 0.02, "density": 2700.0}
    ball = {"kind": "spherical"}
    scene = {
        "name": "too short",
        "dimensions": 3,
        "bodies": {"a": rod, "b": rod},
        "joints": {
            "O": {**ball, "first": {"body": "ground", "point": [0.0, 0.0, 0.0]}, "second": {"body": "a"}},
            "A": {**ball, "first": {"body": "a", "point": "end"}, "second": {"body": "b"}},
            "B": {
                **ball,
                "first": {"body": "b", "point": "end"},
                "second": {"body": "ground", "point": [3.0, 0.0, 0.0]},
            },
        },
        "markers": {"A": {"body": "a", "point": "end"}},
        "solver": {"duration": 1.0},
    }
    looked, rows = list[int](), Closure.rows
    monkeypatch.setattr(Closure, "rows", lambda self, u: looked.append(1) or rows(self, u))
    with pytest.raises(InputError, match=r"joints\.[OAB]: cannot be assembled; its places stay .* m apart at best"):
        start.place_started(Scene.parse(scene, "too short"))
    assert len(looked) < 300


def rounded_pendulum(rng: np.random.Generator, digits: int) -> Scene:
    """A chain of two masses on bars of known length, whose stated places have so many digits."""
    places = np.cumsum([rng.normal(size=3) for _ in range(2)], axis=0)
    lengths = [float(np.linalg.norm(places[0])), float(np.linalg.norm(places[1] - places[0]))]
    velocities = [np.cross(rng.normal(size=3), places[0])] * 2
    stated = [[float(f"{x:.{digits}g}") for x in place] for place in places]
    ends = [{"body": "ground", "point": [0, 0, 0]}, {"body": "M0"}, {"body": "M1"}]
    return Scene.parse({
        "name": "rounded", "dimensions": 3, "gravity": [0, 0, -9.81],
        "bodies": {f"M{k}": {"kind": "point-mass", "mass": 1.0 + k} for k in range(2)},
        "joints": {f"L{k}": {"kind": "distance", "first": ends[k], "second": ends[k + 1], "length": lengths[k]}
                   for k in range(2)},
        "markers": {"T": {"body": "M1"}},
        "initial": {f"M{k}": {"position": stated[k], "velocity": np.round(velocities[k], digits).tolist()}
                    for k in range(2)},
    })  # fmt: skip


@pytest.mark.slow
def test_lanes_start_where_a_scene_by_itself_does_however_its_start_is_rounded() -> None:
    """Places of a file miss the joints by their last digit; what a single run corrects lanes correct too."""
    times = np.array([0.0, 0.05])
    for seed in range(16):
        rng = np.random.default_rng(seed)
        scene = rounded_pendulum(rng, digits=int(rng.integers(2, 14)))
        stated = float(scene.initial["M0"].position[0])  # type: ignore[index]
        values = np.array([stated, stated + 1e-9, stated * (1.0 + 1e-6)])
        lanes = simulate(scene, times, {"initial.M0.position.0": values})
        for lane, value in enumerate(values):
            try:
                alone = simulate(scene.with_values({"initial.M0.position.0": float(value)}), times)
            except InputError:
                assert lanes.status[lane] is not Status.OK
                continue
            assert lanes.status[lane] is alone.status[0], (seed, lanes.message)
            np.testing.assert_allclose(lanes.points[..., lane], alone.points[..., 0], atol=1e-9)


@pytest.mark.parametrize("spin", [0.0, 2.0])
def test_a_planar_loop_whose_pivots_are_not_in_one_plane_is_refused(spin: float) -> None:
    """No motion changes the offset along the axes, so that no constraint on shared coordinates has it."""
    rod = {"kind": "rod", "height": 0.02, "width": 0.02, "density": 2700.0}
    ends = [("ground", [0, 0, 0], "a", "start"), ("a", "end", "b", "start"), ("b", "end", "c", "end")]
    ends.append(("ground", [1, 0, 0.1], "c", "start"))
    scene = {
        "name": "out of plane", "dimensions": 3,
        "bodies": {"a": {**rod, "length": 0.5}, "b": {**rod, "length": 1.0}, "c": {**rod, "length": 0.5}},
        "joints": {f"J{k}": {"first": {"body": a, "point": p}, "second": {"body": b, "point": q}}
                   for k, (a, p, b, q) in enumerate(ends)},
        "markers": {"b": {"body": "b"}},
        "initial": {"a": {"angle": 0.7, "rate": spin}, "b": {"angle": 0.0}, "c": {"angle": 0.7}},
    }  # fmt: skip
    with pytest.raises(InputError, match=r"joints\.J\d: cannot be assembled; its places stay 0\.1 m apart at best"):
        start.place_started(Scene.parse(scene))
    scene["joints"]["J3"]["first"]["point"] = [1, 0, 0]  # type: ignore[index]
    assert not np.any(start.place_started(Scene.parse(scene)).failed)


def driven_machine(dimensions: int, drawn: np.random.Generator, closing: float | None) -> Scene:
    """A driven crank with a free arm; closing: the rate [m/s] of a distance from its end to a third bar, if any."""
    angles, lengths = drawn.uniform(-1, 1, 3) + np.array([0.3, 0.6, 1.3]), drawn.uniform(0.7, 1.3, 3)
    masses, inertias = drawn.uniform(0.5, 2, 3), drawn.uniform(0.05, 0.4, 3)
    drive = f"{float(angles[0])!r} + {drawn.uniform(-3, 3)!r}*t"
    space = dimensions == 3

    def place(x: float, y: float) -> list[float]:
        return [x, y, 0.0][:dimensions]

    def bar(k: int) -> dict[str, Any]:
        inertia = [0.5 * inertias[k], 0.9 * inertias[k], inertias[k]] if space else inertias[k]
        named = {"end": place(lengths[k], 0.0)}
        return {"kind": "rigid-body", "mass": masses[k], "inertia": inertia, "named_points": named,
                "centre_of_mass": place(lengths[k] / 2, 0.0)}  # fmt: skip

    ends = lengths[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    apart = float(np.linalg.norm(ends[0] + ends[1] - ends[2] - [1.2, 0.1]))
    origin, pivot = ({"body": "ground", "point": place(*at)} for at in ((0.0, 0.0), (1.2, 0.1)))
    bodies = {name: bar(k) for k, name in enumerate("xyz"[: 2 if closing is None else 3])}
    joints: dict[str, Any] = {
        "A": {"first": origin, "second": {"body": "x"}},
        "B": {"first": {"body": "x", "point": "end"}, "second": {"body": "y"}},
        "D": {
            "kind": "driven-angle",
            "first": origin,
            "second": {"body": "x"},
            "angle": drive,
        },
    }
    if closing is not None:
        sides = {"first": {"body": "y", "point": "end"}, "second": {"body": "z", "point": "end"}}
        joints["C"] = {"first": pivot, "second": {"body": "z"}}
        joints["E"] = {"kind": "distance", **sides, "length": f"{apart!r} + {closing!r}*t"}
    start = {name: {"rotation": [0, 0, a]} if space else {"angle": a} for name, a in zip(bodies, angles, strict=False)}
    return Scene.parse({
        "name": "driven", "dimensions": dimensions, "gravity": place(0.0, -9.81), "bodies": bodies, "joints": joints,
        "initial": start, "markers": {name: {"body": name, "point": "end"} for name in bodies},
        "solver": {"duration": 0.1},
    })  # fmt: skip


@pytest.mark.parametrize("closing", [None, 0.0, 1.5])
@pytest.mark.parametrize("seed", range(3))
def test_rates_that_a_drive_leaves_open_are_those_of_the_plane(seed: int, closing: float | None) -> None:
    """Both differ least, in kinetic energy, from bodies that do not turn but as a drive turns them."""
    machines = (driven_machine(d, np.random.default_rng(seed), closing) for d in (2, 3))
    plane, space = (simulate(machine, np.array([0.05, 0.1])) for machine in machines)
    assert plane.ok
    assert space.ok
    assert space.points[:, :, :2] == pytest.approx(plane.points, abs=1e-11)


def four_bar_in_space() -> Scene:
    """A crank and a rocker about axes that cross, and a coupler between two ball joints."""
    bar = {"kind": "rod", "height": 0.02, "width": 0.02, "density": 2700.0, "rotary_inertia": True}
    return Scene.parse({
        "name": "four-bar-in-space", "dimensions": 3,
        "bodies": {name: {**bar, "length": length} for name, length in
                   (("crank", 0.3), ("coupler", 1.0), ("rocker", 0.8))},
        "joints": {
            "A": {"kind": "revolute", "first": {"body": "ground", "point": [0, 0, 0]}, "second": {"body": "crank"},
                  "axis": [0, 0, 1]},
            "B": {"kind": "spherical", "first": {"body": "crank", "point": "end"}, "second": {"body": "coupler"}},
            "C": {"kind": "spherical", "first": {"body": "coupler", "point": "end"},
                  "second": {"body": "rocker", "point": "end"}},
            "D": {"kind": "revolute", "first": {"body": "ground", "point": [1, 0.2, 0]}, "second": {"body": "rocker"},
                  "axis": [0, 1, 0]},
        },
        "markers": {"C": {"body": "coupler", "point": "end"}},
        "initial": {"crank": {"angle": 0.5, "spin": [0, 0, 3.0]}},
        "solver": {"integrator": "rk4", "step": 1e-3},
    })  # fmt: skip


def test_rates_of_many_lanes_are_those_of_a_few_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = four_bar_in_space()
    lengths = np.array([*np.linspace(0.9, 1.1, 4), 2.5, *np.linspace(0.9, 1.1, 3)])
    lanes = scene.with_lanes({"bodies.coupler.length": lengths, "bodies.crank.density": np.linspace(1e3, 9e3, 8)})
    model = build(lanes, 8)
    assert np.flatnonzero(model.failed).tolist() == [4]
    spin = body_states(model.frames, model.scene, model.q0, model.v0)["crank"].spin
    np.testing.assert_allclose(np.transpose(spin)[~model.failed], [[0.0, 0.0, 3.0]] * 7, atol=1e-9)
    monkeypatch.setattr(start, "AT_ONCE", 3)
    np.testing.assert_allclose(build(lanes, 8).v0, model.v0, atol=1e-12)


def test_a_guessed_rate_is_kept_in_those_lanes_whose_joints_allow_it() -> None:
    """In the second the ends of the coupler move otherwise; it still turns about the line through them as guessed."""
    scene = four_bar_in_space()
    alone = build(scene)
    begun = body_states(alone.frames, alone.scene, alone.q0[:, 0], alone.v0[:, 0])
    rocking, turning = (np.array(begun[name].spin) for name in ("rocker", "coupler"))
    frame = alone.frames["coupler"]
    assert isinstance(frame, RigidFrame)
    along = 5.0 * frame.directors[0].at(alone.q0[:, 0])
    guessed = scene.with_values({"initial.rocker.spin": tuple(rocking), "initial.coupler.spin": tuple(turning + along)})
    model = build(guessed.with_lanes({"initial.rocker.spin.1": rocking[1] * np.array([1.0, 2.0])}), 2)
    found = body_states(model.frames, model.scene, model.q0, model.v0)["coupler"].spin
    np.testing.assert_allclose(np.transpose(found), [turning + along, 2.0 * turning + along], atol=1e-9)
    assert not np.any(model.failed)
