"""Contacts with polygons against equations that share no code: discs that roll over corners, and bodies that bounce."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from shoal.engines import get_engine
from shoal.errors import InputError
from shoal.mechanics.analysis.reactions import reactions
from shoal.mechanics.analysis.statics import statics
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene
from shoal.trajectory import Trajectory

pytestmark = pytest.mark.compiles("kernels of contacts, which few machines need")
G = 9.81
RADIUS, SLOPE = 0.2, 0.6
HILL = [[-3.0, 0.0], [-3.0, -6.0], [6.0, -6.0], [3.0 * np.cos(SLOPE), -3.0 * np.sin(SLOPE)], [0.0, 0.0]]
"""Level ground that falls off at a slope from the origin on, counter-clockwise."""


def machine(
    body: dict[str, Any], contacts: dict[str, Any], start: dict[str, Any], duration: float, **solver: Any
) -> Scene:
    return Scene.parse({"name": "polygons", "bodies": {"B": body}, "contacts": contacts, "initial": {"B": start},
                        "markers": {"P": {"body": "B"}}, "gravity": [0.0, -G],
                        "solver": {"duration": duration, **solver}})  # fmt: skip


def run(scene: Scene, *times: float, balance: float = 1e-10) -> Trajectory:
    found = simulate(scene, np.array(times or (scene.solver.duration,)))
    assert found.ok, found.message
    assert found.energy_drift[0] < balance
    return found


def events(found: Trajectory, kind: str) -> list[float]:
    return [event["time"] for event in found.model["events"] if event["kind"] == kind]


DISC = {"kind": "rigid-body", "mass": 2.0, "inertia": 0.5 * 2.0 * RADIUS**2}


def rolled(speed: float, duration: float) -> Any:
    """Return the place (2,) and the turn of a disc that rolls from (-0.1, RADIUS) on, over the corner, along the way s.

    The way of its centre is a line, an arc about the corner, and a line; it rolls by s / RADIUS.
    """
    arc, first = RADIUS * SLOPE, 0.1

    def direction(s: float) -> float:
        return -float(np.clip((s - first) / RADIUS, 0.0, SLOPE))

    def slope(_: float, y: Any) -> list[float]:
        return [y[1], -G * np.sin(direction(y[0])) / 1.5]

    t, y = 0.0, [0.0, speed]
    for knot in (first, first + arc, np.inf):

        def reached(_: float, y: Any, knot: float = knot) -> float:
            return float(y[0] - min(knot, 1e3))

        reached.terminal = True  # type: ignore[attr-defined]
        way = solve_ivp(slope, (t, duration), y, events=reached, rtol=1e-13, atol=1e-14, method="DOP853")
        t, y = way.t[-1], list(way.y[:, -1])
        if t >= duration:
            break
    s = y[0]
    x = min(s, first) - first
    turn = -direction(s)
    centre = np.array([x + RADIUS * np.sin(turn), RADIUS * np.cos(turn)])
    down = max(s - first - arc, 0.0)
    return centre + down * np.array([np.cos(SLOPE), -np.sin(SLOPE)]), -s / RADIUS


def hill(speed: float, duration: float, **solver: Any) -> Scene:
    road = {"first": {"body": "B", "radius": RADIUS}, "second": {"body": "ground", "polygon": HILL}, "rolling": True}
    start = {"position": [-0.1, RADIUS], "velocity": [speed, 0.0], "rate": -speed / RADIUS}
    return machine(DISC, {"road": road}, start, duration, **solver)


def test_a_disc_rolls_over_a_convex_corner() -> None:
    """On either side it touches an edge, between them the corner; the change of its acceleration is an event."""
    found = run(hill(0.3, 0.9, relative_tolerance=1e-12))
    place, turn = rolled(0.3, 0.9)
    assert place[0] > 0.25
    np.testing.assert_allclose(found.points[0, 0, :, 0], place, atol=1e-11)
    assert found.angles[0, 0, 0] == pytest.approx(turn, abs=1e-10)
    assert not found.model["events"]


@pytest.mark.parametrize(("integrator", "step", "order"), [("leapfrog", 0.01, 2), ("rk4", 0.03, 4)])
def test_an_integrator_keeps_its_order_over_a_corner(integrator: str, step: float, order: int) -> None:
    place, _ = rolled(0.3, 0.9)
    errors = [
        np.linalg.norm(run(hill(0.3, 0.9, integrator=integrator, step=h), balance=1e-3).points[0, 0, :, 0] - place)
        for h in (step, step / 2, step / 4)
    ]
    assert np.log2(errors[0] / errors[2]) / 2 == pytest.approx(order, abs=0.35)


def test_a_fast_disc_leaves_the_ground_at_the_corner() -> None:
    """Where v^2 > g r it flies off as soon as the ground falls away."""
    speed = 2.0
    found = run(hill(speed, 0.15))
    assert events(found, "opens") == pytest.approx([0.1 / speed], abs=1e-12)
    t = 0.15 - 0.1 / speed
    np.testing.assert_allclose(found.points[0, 0, :, 0], [speed * t, RADIUS - G * t * t / 2], atol=1e-12)


@pytest.mark.parametrize("radius", [0.0, 0.1])
def test_a_body_that_slides_into_a_valley_stops_in_it(radius: float) -> None:
    """Without restitution and friction it is stopped part by part by the other slope, then rests on both."""
    steep = 0.5
    valley = [[-2.0, 2.0 * np.tan(steep)], [-2.0, -1.0], [2.0, -1.0], [2.0, 2.0 * np.tan(steep)], [0.0, 0.0]]
    lift = radius / np.cos(steep)
    start = {"position": [-0.5, 0.5 * np.tan(steep) + lift]}
    ground = {"second": {"body": "ground", "polygon": valley}}
    scene = machine(DISC, {"g": {"first": {"body": "B", "radius": radius}, **ground}}, start, 3.0)
    found = run(scene)
    way, pull = 0.5 / np.cos(steep), G * np.sin(steep)
    first, speed = np.sqrt(2 * way / pull), np.sqrt(2 * way * pull)
    kept = np.cos(2 * steep)  # along the other slope
    second = 2 * kept * speed / pull
    times = [first, *(first + second * (1 - kept**k) / (1 - kept) for k in range(1, 6))]
    assert events(found, "impact")[:6] == pytest.approx(times, abs=1e-9)
    assert events(found, "rests")[-1] == pytest.approx(first + second / (1 - kept), abs=1e-5)
    np.testing.assert_allclose(found.points[0, 0, :, 0], [0.0, lift], atol=1e-9)


def test_a_point_slides_off_a_corner_and_flies() -> None:
    start = {"position": [-1.0, 0.0], "velocity": [2.0, 0.0]}
    ground = {"first": {"body": "B"}, "second": {"body": "ground", "polygon": HILL}, "mu": 0.1}
    found = run(machine({"kind": "point-mass", "mass": 1.0}, {"g": ground}, start, 0.68))
    late = (2.0 - np.sqrt(4.0 - 2 * 0.1 * G)) / (0.1 * G)
    assert events(found, "opens") == pytest.approx([late], abs=1e-10)
    speed, t = 2.0 - 0.1 * G * late, 0.68 - late
    np.testing.assert_allclose(found.points[0, 0, :, 0], [speed * t, -G * t * t / 2], atol=1e-10)


def test_a_disc_falls_into_a_slot_and_rests_on_both_corners() -> None:
    """Of one chain of the outline two corners carry it."""
    slot = [[0, 0], [3, 0], [3, 2], [1.6, 2], [1.6, 1], [1.4, 1], [1.4, 2], [0, 2]]
    contact = {"first": {"body": "B", "radius": RADIUS}, "second": {"body": "ground", "polygon": slot}, "mu": 0.5}
    found = run(machine(DISC, {"slot": contact}, {"position": [1.5, 2.5]}, 2.0))
    np.testing.assert_allclose(found.points[0, 0, :, 0], [1.5, 2.0 + np.sqrt(RADIUS**2 - 0.1**2)], atol=1e-9)
    assert found.model["closed_contacts"] == ["slot"]


class Struck:
    """A disc that strikes a polygon on a free body, or at rest: flights with closed forms, Moreau's impacts."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.radius, self.kept, self.mu = rng.choice([0.0, 0.15]), rng.uniform(0.6, 1.0), rng.uniform(0.0, 0.4)
        sides = int(rng.integers(3, 8))
        angle = 2 * np.pi * (np.arange(sides) + rng.uniform(0.0, 0.6, sides)) / sides
        size = rng.uniform(0.4, 1.0, sides)  # concave as well
        self.polygon = np.stack([size * np.cos(angle), size * np.sin(angle)], axis=1)
        self.free = bool(rng.integers(0, 2))
        self.mass = np.array([1.0, 1.0, 0.02, 3.0, 3.0, 0.5])  # of the disc, then of the polygon
        if not self.free:
            self.mass[3:] = np.inf
        self.gravity = np.array([0.0, 0.0 if self.free else -G, 0.0, 0.0, 0.0, 0.0])
        self.q = np.array([rng.uniform(-0.5, 0.5), 1.6, 0.0, 0.0, 0.0, rng.uniform(0.0, 6.0)])
        spin = rng.uniform(-1.0, 1.0) if self.free else 0.0
        self.v = np.array([rng.uniform(-0.3, 0.3), -1.5, rng.uniform(-3.0, 3.0) * (self.radius > 0), 0.0, 0.0, spin])
        self.begin, self.gains = (self.q.copy(), self.v.copy()), False

    def _seen(self, q: Any) -> tuple[float, Any, Any]:
        """Return the gap, the place on the polygon that is nearest to the disc, and the normal of its edge."""
        c, s = np.cos(q[5]), np.sin(q[5])
        corners = q[3:5] + self.polygon @ np.array([[c, s], [-s, c]])
        ways = np.roll(corners, -1, axis=0) - corners
        off = q[:2] - corners
        share = np.clip(np.sum(off * ways, axis=1) / np.sum(ways**2, axis=1), 0.0, 1.0)
        feet = corners + share[:, None] * ways
        away = np.linalg.norm(q[:2] - feet, axis=1)
        k = int(np.argmin(away))
        bearing = np.arctan2(*(corners - q[:2]).T[::-1])
        turned = np.sum(np.angle(np.exp(1j * (np.roll(bearing, -1) - bearing))))
        side = -1.0 if abs(turned) > 1.0 else 1.0  # turned round it is inside
        normal = np.array([ways[k, 1], -ways[k, 0]]) / np.linalg.norm(ways[k])
        return side * float(away[k]) - self.radius, feet[k], normal

    def _at(self, t: float) -> Any:
        return self.q + self.v * t + 0.5 * self.gravity * t * t

    def run(self, end: float) -> tuple[list[float], Any]:
        now, times, grid = 0.0, list[float](), 5e-4
        while True:
            t = grid
            while now + t < end + grid and self._seen(self._at(t))[0] > 0.0:
                t += grid
            if now + t >= end + grid:
                break
            step = float(brentq(lambda s: self._seen(self._at(s))[0], t - grid + 1e-9, t, xtol=1e-15, rtol=1e-14))
            if now + step > end:
                break
            self.q, self.v, now = self._at(step), self.v + self.gravity * step, now + step
            times.append(now)
            self._strike()
        return times, self._at(end - now)

    def _strike(self) -> None:
        _, foot, n = self._seen(self.q)
        if self.radius > 0.0:
            n = (self.q[:2] - foot) / np.linalg.norm(self.q[:2] - foot)
        arms = foot - self.q[:2], foot - self.q[3:5]
        axes = [n, np.array([-n[1], n[0]])]
        rows = np.array([
            [*axis, arms[0][0] * axis[1] - arms[0][1] * axis[0], *-axis, -(arms[1][0] * axis[1] - arms[1][1] * axis[0])]
            for axis in axes
        ])  # fmt: skip
        response = rows.T / self.mass[:, None]
        matrix, rates = rows @ response, rows @ self.v
        push = np.linalg.solve(matrix, [-(1 + self.kept) * rates[0], -rates[1]])
        if abs(push[1]) > self.mu * push[0]:
            for way in (1.0, -1.0):
                cone = np.array([1.0, -way * self.mu])
                push = cone * -(1 + self.kept) * rates[0] / (matrix[0] @ cone)
                if way * (rates + matrix @ push)[1] >= 0.0:
                    break
        heavy = np.where(np.isfinite(self.mass), self.mass, 0.0)
        before = self.v @ (heavy * self.v)
        self.v = self.v + response @ push
        self.gains = self.gains or bool(self.v @ (heavy * self.v) > before * (1 + 1e-9))


class Terrain(Struck):
    """A disc or point that is thrown fast over ground with hills, steps and valleys, in few steps of its flight."""

    def __init__(self, seed: int) -> None:
        super().__init__(seed)
        rng = np.random.default_rng(1000 + seed)
        self.radius, self.kept, self.mu = float(rng.choice([0.0, 0.05, 0.3])), rng.uniform(0.5, 1.0), 0.0
        x = np.sort(rng.uniform(-2.5, 2.5, int(rng.integers(2, 9))))
        y = rng.uniform(-0.6, 0.6, len(x)) * (rng.uniform(size=len(x)) < 0.6)
        ground = np.stack([np.r_[-3.0, x, 3.0], np.r_[0.0, y, 0.0]], axis=1)
        self.polygon = np.concatenate([[[-3.0, -3.0], [3.0, -3.0]], ground[::-1]])
        self.free, self.mass = False, np.array([1.0, 1.0, 0.02, np.inf, np.inf, np.inf])
        self.gravity = np.array([0.0, -G, 0.0, 0.0, 0.0, 0.0])
        self.q = np.array([rng.uniform(-2.5, -1.5), rng.uniform(1.0, 1.6), 0.0, 0.0, 0.0, 0.0])
        self.v = np.array([rng.uniform(1.0, 6.0), rng.uniform(-1.0, 2.0), 0.0, 0.0, 0.0, 0.0])


@pytest.mark.parametrize("seed", range(8))
def test_a_body_thrown_over_random_ground_misses_no_impact(seed: int) -> None:
    body = Terrain(seed)
    contact = {"first": {"body": "B", "radius": body.radius}, "restitution": body.kept,
               "second": {"body": "ground", "polygon": body.polygon.tolist()}}  # fmt: skip
    start = {"position": body.q[:2].tolist(), "velocity": body.v[:2].tolist()}
    found = run(machine(DISC, {"hit": contact}, start, 0.8, relative_tolerance=1e-12))
    times, q = body.run(0.8)
    assert events(found, "impact") == pytest.approx(times, abs=1e-8)
    np.testing.assert_allclose(found.points[0, 0, :, 0], q[:2], atol=1e-7)


@pytest.mark.parametrize("seed", range(12))
def test_a_disc_or_point_bounces_on_a_random_polygon(seed: int) -> None:
    """Convex and concave ones, at rest or free to fly and turn, with friction and spin."""
    body = Struck(seed)
    (x, y, turn, _, _, angle), (u, v, rate, _, _, spin) = body.begin
    moved = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    disc = {"kind": "rigid-body", "mass": 1.0, "inertia": 0.02}
    bodies = {"B": disc} | ({"K": {"kind": "rigid-body", "mass": 3.0, "inertia": 0.5}} if body.free else {})
    start: dict[str, Any] = {"B": {"position": [x, y], "velocity": [u, v], "angle": turn, "rate": rate}}
    polygon = body.polygon if body.free else body.polygon @ moved
    if body.free:
        start["K"] = {"position": [0.0, 0.0], "velocity": [0.0, 0.0], "angle": angle, "rate": spin}
    second = {"body": "K" if body.free else "ground", "point": [0.0, 0.0], "polygon": polygon.tolist()}
    contact = {"first": {"body": "B", "radius": body.radius}, "second": second, "restitution": body.kept, "mu": body.mu}
    duration = 1.2
    times, q = body.run(duration)
    scene = Scene.parse({"name": "struck", "bodies": bodies, "contacts": {"hit": contact}, "initial": start,
                         "gravity": body.gravity[:2].tolist(), "markers": {name: {"body": name} for name in bodies},
                         "solver": {"duration": duration, "relative_tolerance": 1e-12}})  # fmt: skip
    found = simulate(scene, np.array([duration]))
    if body.gains:
        assert found.status[0] == "energy-check-failed"
        return
    assert found.ok, found.message
    assert events(found, "impact") == pytest.approx(times, abs=1e-8)
    np.testing.assert_allclose(found.points[0, 0, :, 0], q[:2], atol=1e-7)


def test_a_box_of_a_polygon_rocks_on_a_line_until_it_stands() -> None:
    """Housner's block, whose corners touch: the spins fall by 1 - 3/2 sin^2 of its slenderness."""
    half, high, tilt = 0.2, 0.8, 0.12
    mass = {"kind": "rigid-body", "mass": 1.0, "inertia": (half**2 + high**2) / 3}
    box = [[-half, -high], [half, -high], [half, high], [-half, high]]
    middle = [half * np.cos(tilt) - high * np.sin(tilt), half * np.sin(tilt) + high * np.cos(tilt)]
    start = {"position": middle, "angle": tilt}
    floor = {"first": {"body": "B", "polygon": box}, "second": {"body": "ground", "line": 0.0}, "mu": 1.0}
    found = run(machine(mass, {"floor": floor}, start, 3.0))
    times = [0.4338738210642413, 1.1431470900549372, 1.7462333164173767, 2.269836949010758, 2.730312998187644]
    struck = [event for event in found.model["events"] if event["kind"] == "impact"]
    assert [event["time"] for event in struck] == pytest.approx(times, abs=1e-9)
    assert [event["corner"] for event in struck] == [2, 1, 2, 1, 2]


def test_the_corners_of_a_box_at_rest_bear_its_weight_together() -> None:
    box = [[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]]
    floor = {"first": {"body": "B", "polygon": box}, "second": {"body": "ground", "line": 0.0}, "mu": 0.3}
    scene = machine(DISC, {"floor": floor}, {"position": [0.5, 0.1]}, 1.0)
    (found,) = reactions(scene, [0.5])
    told = found.contacts["floor"]
    assert told.normal == pytest.approx(2.0 * G, abs=1e-10)
    assert told.at == pytest.approx([0.5, 0.0], abs=1e-10)
    assert told.state == "sticks"


def test_a_disc_rolls_softly_over_a_corner_and_keeps_its_energy() -> None:
    law = {"stiffness": 1e6, "exponent": 1.5}
    road = {"first": {"body": "B", "radius": RADIUS}, "second": {"body": "ground", "polygon": HILL}, "law": law}
    deep = (2.0 * G / 1e6) ** (2 / 3)
    found = run(machine(DISC, {"road": road}, {"position": [-0.1, RADIUS - deep], "velocity": [0.3, 0.0]}, 0.7))
    assert found.points[0, 0, 0, 0] > 0.2
    assert not events(found, "opens")


def test_lanes_of_discs_roll_bounce_and_fly_as_alone() -> None:
    scene, times = hill(0.3, 0.9), np.linspace(0.0, 0.9, 7)
    values = {"initial.B.velocity.0": np.array([0.3, 1.0, 2.0, 3.0])}
    values["initial.B.rate"] = -values["initial.B.velocity.0"] / RADIUS
    together = get_engine("gauss").simulate_many(scene, values, times)
    assert together.ok
    for lane in range(4):
        alone = simulate(scene.with_values({path: float(each[lane]) for path, each in values.items()}), times)
        np.testing.assert_allclose(together.points[..., lane], alone.points[..., 0], atol=1e-7)


TRIANGLE = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]


@pytest.mark.parametrize(
    ("second", "text"),
    [
        ({"polygon": TRIANGLE[:2]}, "contacts.c.second: polygon: has at least three corners, found 2"),
        ({"polygon": [[0, 0], [1, 1], [1, 0], [0, 1]]}, "polygon: the edges that begin at corners 0 and 2 meet"),
        ({"polygon": [*TRIANGLE, [0.0, 1.0]]}, "polygon.2: [0, 1] is there twice in a row"),
        ({"polygon": [[0, 0], [1, 0], [2, 0]]}, "polygon"),
        (
            {"polygon": TRIANGLE, "law": {"stiffness": 1e5}},
            "law: of a polygon into which a point sinks past its corners",
        ),
        ({"polygon": TRIANGLE, "line": 0.0}, "polygon: line is stated as well; a surface has one shape"),
    ],
)
def test_a_polygon_that_is_none_is_refused(second: dict[str, Any], text: str) -> None:
    law = {"law": second.pop("law")} if "law" in second else {}
    contact = {"first": {"body": "B"}, "second": {"body": "ground", **second}, **law}
    with pytest.raises(InputError, match=re.escape(text)):
        machine(DISC, {"c": contact}, {"position": [2.0, 2.0]}, 1.0)


def test_polygons_are_refused_by_name_where_nothing_knows_them() -> None:
    contact = {"first": {"body": "B"}, "second": {"body": "ground", "polygon": TRIANGLE}}
    with pytest.raises(InputError, match=r"contacts\.c: the machine starts beyond this limit, at -0"):
        simulate(machine(DISC, {"c": contact}, {"position": [0.25, 0.25]}, 1.0), np.array([1.0]))
    with pytest.raises(InputError, match=r"contacts\.c\.second: equilibria and modes take lines, circles"):
        statics(machine(DISC, {"c": contact}, {"position": [2.0, 2.0]}, 1.0))
    for engine in ("exudyn", "mujoco"):
        with pytest.raises(InputError, match=rf"contacts\.c\.second\.polygon: engine {engine} cannot do polygons"):
            get_engine(engine).simulate(machine(DISC, {"c": contact}, {"position": [2.0, 2.0]}, 1.0))
    both = {"first": {"body": "B", "polygon": TRIANGLE}, "second": {"body": "ground", "polygon": TRIANGLE}}
    with pytest.raises(InputError, match=r"first\.polygon: the first side is a point or round"):
        machine(DISC, {"c": both}, {"position": [2.0, 2.0]}, 1.0)


def room(seed: int, *, whole: bool) -> Scene:
    """A disc or point in a convex room, which turns or is at rest: one polygon clockwise, or a line for each wall.

    It strikes, slides, sticks and rolls, and comes to rest in corners.
    """
    rng = np.random.default_rng(seed)
    moves, sides = bool(seed % 2), int(rng.integers(3, 7))
    angle = 2 * np.pi * (np.arange(sides) + rng.uniform(0.0, 0.5, sides)) / sides
    walls = np.stack([np.cos(angle), np.sin(angle)], axis=1)[::-1]
    first = {"body": "B", "radius": float(rng.choice([0.0, 0.1]))}
    law = {
        "restitution": float(rng.choice([0.0, rng.uniform()])),
        "mu": float(rng.choice([0.0, rng.uniform(0.0, 0.8)])),
    }
    on, body = "K" if moves else "ground", {"kind": "rigid-body", "mass": 1.0, "inertia": 0.004}
    contacts = {"c": {"first": first, "second": {"body": on, "point": [0.0, 0.0], "polygon": walls.tolist()}, **law}}
    if not whole:
        contacts = {}
        for k, (one, other) in enumerate(zip(walls, np.roll(walls, -1, axis=0), strict=True)):
            line = {"body": on, "point": one.tolist(), "line": float(np.arctan2(*(one - other)[::-1]))}
            contacts[f"c{k}"] = {"first": first, "second": line, **law}
    spin = float(rng.uniform(-5.0, 5.0) * bool(first["radius"]))
    thrown = {"position": [0.0, 0.0], "velocity": rng.uniform(-2.0, 2.0, 2).tolist(), "rate": spin, "angle": 0.0}
    start: dict[str, Any] = {"B": thrown}
    more: dict[str, Any] = {"gravity": [0.0, 0.0 if moves else -G], "bodies": {"B": body}}
    if moves:
        more["bodies"]["K"] = {"kind": "rigid-body", "mass": 3.0, "inertia": 1.0, "centre_of_mass": [0.1, 0.0]}
        start["K"] = {
            "position": [0.0, 0.0],
            "velocity": [0.0, 0.0],
            "angle": 0.0,
            "rate": float(rng.uniform(-1.0, 1.0)),
        }
        more["loads"] = {"s": {"kind": "spring", "first": {"body": "B"}, "second": {"body": "K", "point": [0.6, 0.3]},
                               "stiffness": 3.0, "length": 0.0}}  # fmt: skip
    return Scene.parse({"name": "room", "contacts": contacts, "initial": start, "markers": {"B": {"body": "B"}},
                        "solver": {"duration": 1.5, "relative_tolerance": 1e-11}, **more})  # fmt: skip


@pytest.mark.parametrize("seed", [0, 1, 2, 3, 4, 5, 6, 7, 130, 171])
def test_a_room_of_a_polygon_is_that_of_the_lines_of_its_walls(seed: int) -> None:
    times = np.array([0.5, 1.0, 1.5])
    one, other = (simulate(room(seed, whole=whole), times) for whole in (True, False))
    assert one.ok == other.ok
    if one.ok:
        np.testing.assert_allclose(one.points, other.points, atol=1e-6)
