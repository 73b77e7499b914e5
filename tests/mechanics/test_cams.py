"""Contacts with cams against a reference problem, closed forms of eccentric circles, and contacts of circles."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.errors import InputError
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene
from shoal.trajectory import Trajectory

pytestmark = pytest.mark.compiles("kernels of contacts, which few machines need")
G = 9.81
FULL = 2 * np.pi


def table(radius: Any, count: int) -> list[list[float]]:
    """Return points of an outline from its radius as a function of the angle."""
    return [[float(angle), float(radius(angle))] for angle in FULL * np.arange(count) / count]


def followed(outline: Any, roller: float, duration: float, speed: float = 60.0, **more: Any) -> Scene:
    """A follower on a spring and a vertical line through the axle of a cam that a motor turns."""
    law = {"restitution": 0.4, **more.pop("law", {})}
    start = more.pop("start")
    joints = {"axle": {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "cam"}},
              "motor": {"kind": "driven-angle", "first": {"body": "ground"}, "second": {"body": "cam"},
                        "angle": f"{speed}*t"},
              "line": {"kind": "slider", "first": {"body": "ground", "point": [0.0, 0.0]}, "direction": np.pi / 2,
                       "second": {"body": "follower", "point": [0.0, 0.0]}}}  # fmt: skip
    bodies = {
        "cam": {"kind": "rigid-body", "mass": 1.0, "inertia": 0.01},
        "follower": {"kind": "point-mass", "mass": 0.5},
    }
    contact = {"first": {"body": "follower", "radius": roller}, "second": {"body": "cam", "cam": outline}, **law}
    return Scene.parse({"name": "followed", "gravity": [0.0, -G], "bodies": bodies, "joints": joints,
                        "contacts": {"cam": contact}, "initial": {"follower": start},
                        "markers": {"F": {"body": "follower"}}, "solver": {"duration": duration}, **more})  # fmt: skip


def pressed(stiffness: float, rest: float) -> dict[str, Any]:
    """A spring that presses the follower down; rest: height at which its force is zero."""
    return {"spring": {"kind": "spring", "first": {"body": "ground", "point": [0.0, -2.0]},
                       "second": {"body": "follower"}, "stiffness": stiffness, "length": 2.0 + rest}}  # fmt: skip


def run(scene: Scene, *times: float) -> Trajectory:
    found = simulate(scene, np.array(times or (scene.solver.duration,)))
    assert found.ok, found.message
    assert found.energy_drift[0] < 1e-9
    return found


def test_a_follower_leaves_a_fast_cam_and_strikes_it_in_every_turn() -> None:
    """Its lift is 0.01 sin(60 t); the values are those of the reference problem `cam`, by matrix exponentials."""
    base = 0.1
    outline = {"table": table(lambda angle: base + 0.01 * np.cos(angle), 720)}
    # The spring is relaxed at y = 0 but for a preload of 2 N.
    scene = followed(outline, 0.0, 0.15, start={"position": [0.0, base], "velocity": [0.0, 0.6]},
                     loads=pressed(400.0, base - 2.0 / 400.0))  # fmt: skip
    found = run(scene, 0.05, 0.1, 0.15)
    told = [event for event in found.model["events"] if event["kind"] in ("opens", "impact")]
    assert [event["kind"] for event in told[:2]] == ["opens", "impact"]
    assert [event["time"] for event in told[:2]] == pytest.approx([0.008596347860782484, 0.07963580087909178], abs=1e-7)
    heights = [0.008373672619563682, -0.0025410164128889627, 0.010056712985181921]
    np.testing.assert_allclose(found.points[:, 0, 1, 0] - base, heights, atol=1e-9)
    assert found.velocities is not None
    rates = [-0.3751497575543526, 0.6034644636421498, -0.27565805853739356]
    np.testing.assert_allclose(found.velocities[:, 0, 1, 0], rates, atol=1e-7)


def eccentric(size: float, off: float) -> Any:
    """Return the radius of a circle about a place that is off its middle along the x axis."""
    return lambda angle: off * np.cos(angle) + np.sqrt(size**2 - (off * np.sin(angle)) ** 2)


@pytest.mark.parametrize("roller", [0.0, 0.02])
def test_a_roller_follows_the_parallel_curve_of_an_eccentric_circle(roller: float) -> None:
    size, off, speed, end = 0.05, 0.01, 5.0, 1.3

    def height(t: float) -> float:
        return float(off * np.sin(speed * t) + np.sqrt((size + roller) ** 2 - (off * np.cos(speed * t)) ** 2))

    start = {"position": [0.0, height(0.0)], "velocity": [0.0, off * speed]}
    outline = {"table": table(eccentric(size, off), 180)}
    found = run(followed(outline, roller, end, speed, start=start), 0.4, 0.9, end)
    assert all(event["time"] < 1e-6 for event in found.model["events"])  # the start is off by the spline's error
    np.testing.assert_allclose(found.points[:, 0, 1, 0], [height(t) for t in (0.4, 0.9, end)], atol=2e-9)


def thrown(second: dict[str, Any], seed: int) -> Scene:
    """A disc that is thrown at an eccentric circle, which turns and flies, with friction."""
    rng = np.random.default_rng(seed)
    contact = {"first": {"body": "B", "radius": float(rng.choice([0.02, 0.1]))}, "second": {"body": "K", **second},
               "restitution": float(rng.uniform(0.0, 1.0)), "mu": float(rng.uniform(0.0, 0.5))}  # fmt: skip
    return Scene.parse({
        "name": "thrown", "gravity": [0.0, 0.0], "contacts": {"hit": contact},
        "bodies": {"B": {"kind": "rigid-body", "mass": 1.0, "inertia": 0.004},
                   "K": {"kind": "rigid-body", "mass": 2.0, "inertia": 0.05, "centre_of_mass": [0.05, 0.02]}},
        "initial": {"B": {"position": [rng.uniform(-0.2, 0.2), 0.9], "velocity": [0.0, -1.0],
                          "rate": rng.uniform(-9.0, 9.0), "angle": 0.0},
                    "K": {"position": [0.0, 0.0], "velocity": [0.0, 0.0], "angle": rng.uniform(0.0, 6.0),
                          "rate": rng.uniform(-4.0, 4.0)}},
        "markers": {name: {"body": name} for name in "BK"},
        "loads": {"spring": {"kind": "spring", "first": {"body": "B"}, "second": {"body": "K"}, "stiffness": 5.0,
                             "length": 0.0}},
        "solver": {"duration": 1.5, "relative_tolerance": 1e-11},
    })  # fmt: skip


@pytest.mark.parametrize("seed", range(6))
def test_a_cam_that_is_a_circle_acts_as_that_circle(seed: int) -> None:
    """A spring holds them together, so that they strike, slide, stick and roll."""
    size, off = 0.3, 0.06
    circle = thrown({"point": [off, 0.0], "radius": size}, seed)
    cam = thrown({"point": [0.0, 0.0], "cam": {"table": table(eccentric(size, off), 360)}}, seed)
    one, other = (simulate(scene, np.array([0.7, 1.0])) for scene in (circle, cam))
    assert one.ok == other.ok
    if one.ok:
        kinds = [[event["kind"] for event in found.model["events"] if event["time"] < 1.0] for found in (one, other)]
        assert kinds[0] == kinds[1]
        np.testing.assert_allclose(other.points, one.points, atol=1e-7)


@pytest.mark.parametrize(("integrator", "step", "order"), [("leapfrog", 4e-3, 2), ("rk4", 4e-3, 4)])
def test_an_integrator_keeps_its_order_over_knots(integrator: str, step: float, order: int) -> None:
    """A cam of few points, whose third derivatives jump, turns under the weight of its roller."""
    outline = {"table": [[0.0, 0.1], [1.0, 0.12], [2.0, 0.11], [3.5, 0.15], [5.0, 0.13]]}
    bodies = {
        "cam": {"kind": "rigid-body", "mass": 1.0, "inertia": 0.01},
        "follower": {"kind": "point-mass", "mass": 0.5},
    }
    joints = {"axle": {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "cam"}},
              "line": {"kind": "slider", "first": {"body": "ground", "point": [0.0, 0.0]}, "direction": np.pi / 2,
                       "second": {"body": "follower", "point": [0.0, 0.0]}}}  # fmt: skip

    def at(**solver: Any) -> Any:
        scene = Scene.parse({
            "name": "few", "gravity": [0.0, -G], "bodies": bodies, "joints": joints,
            "contacts": {"cam": {"first": {"body": "follower", "radius": 0.02},
                                 "second": {"body": "cam", "cam": outline}}},
            "initial": {"follower": {"position": [0.0, 0.2]}, "cam": {"angle": 1.0, "rate": 6.0}},
            "markers": {"F": {"body": "follower"}, "C": {"body": "cam", "point": [0.1, 0.0]}},
            "solver": {"duration": 0.9, "energy_tolerance": 0.1, **solver}})  # fmt: skip
        found = simulate(scene, np.array([0.9]))
        assert found.ok, found.message
        return found.points[0, :, :, 0]

    exact = at(relative_tolerance=1e-13)
    errors = [np.linalg.norm(at(integrator=integrator, step=h) - exact) for h in (step, step / 4)]
    assert np.log2(errors[0] / errors[1]) / 2 == pytest.approx(order, abs=0.35)


def test_lanes_of_cams_strike_as_alone() -> None:
    scene = thrown({"point": [0.0, 0.0], "cam": {"table": table(eccentric(0.3, 0.06), 90)}}, 1)
    values, times = {"contacts.hit.restitution": np.array([0.2, 0.5, 0.9])}, np.linspace(0.0, 1.0, 6)
    together = get_engine("gauss").simulate_many(scene, values, times)
    assert together.ok
    for lane, value in enumerate(values["contacts.hit.restitution"]):
        alone = simulate(scene.with_values({"contacts.hit.restitution": float(value)}), times)
        np.testing.assert_allclose(together.points[..., lane], alone.points[..., 0], atol=1e-7)


@pytest.mark.parametrize(
    ("outline", "roller", "text"),
    [
        ({"table": [[0, 0.1], [1, 0.1]]}, 0.0, "cam.table"),
        ({"table": [[0, 0.1], [1, 0.1], [1, 0.2]]}, 0.0, "table.2: must grow from 1, found 1"),
        ({"table": [[0, 0.1], [1, 0.1], [7, 0.2]]}, 0.0, "table.2: must be less than a period beyond the first one, 0"),
        ({"table": table(np.cosh, 5), "period": 2.0}, 0.0, "period: must be 2 pi over a whole number"),
        ({"table": [[0, 0.1], [1, 1.0], [1.1, 0.001], [5, 1.0]]}, 0.0, "second.cam.table: the outline goes through"),
        (
            {"table": table(lambda a: 0.1 + 0.02 * np.cos(3 * a), 60)},
            0.2,
            "first.radius: a roller of 0.2 m does not fit",
        ),
    ],
)
def test_a_cam_that_is_none_is_refused(outline: dict[str, Any], roller: float, text: str) -> None:
    with pytest.raises(InputError, match=re.escape(text)):
        simulate(followed(outline, roller, 1.0, start={"position": [0.0, 3.0]}), np.array([1.0]))


def test_a_start_within_a_cam_is_refused() -> None:
    scene = followed({"table": table(eccentric(0.05, 0.01), 60)}, 0.01, 1.0, start={"position": [0.0, 0.05]})
    with pytest.raises(InputError, match=r"contacts\.cam: the machine starts beyond this limit, at -0\.0"):
        simulate(scene, np.array([1.0]))


def test_lobes_repeat_an_outline() -> None:
    """Three lobes of a third of a turn each are the whole table."""
    whole = {"table": table(lambda angle: 0.1 + 0.005 * np.cos(3 * angle), 60)}
    lobe = {"table": whole["table"][:20], "period": FULL / 3}
    one, other = (run(followed(outline, 0.01, 0.3, 5.0, start={"position": [0.0, 0.12]})) for outline in (whole, lobe))
    np.testing.assert_allclose(one.points, other.points, atol=1e-11)
