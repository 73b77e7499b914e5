"""Joints with play against a reference problem and against impacts of one free body that share no code with them."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq
from shoal.engines import get_engine
from shoal.errors import InputError
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene

pytestmark = pytest.mark.compiles("kernels of contacts, which few machines need")
G = 9.81


def bar(mass: float, inertia: float, length: float, middle: float = 0.5) -> dict[str, Any]:
    return {"kind": "rigid-body", "mass": mass, "inertia": inertia, "centre_of_mass": [middle * length, 0.0],
            "named_points": {"end": [length, 0.0]}}  # fmt: skip


def guided(duration: float, turn: float = 0.0, **guide: Any) -> Scene:
    """A slider-crank whose slider has play in its guide, of Flores, Leine and Glocker (2010), turned by an angle."""
    bodies = {
        "crank": bar(0.038, 7.4e-5, 0.153),
        "rod": bar(0.038, 5.9e-4, 0.306),
        "slider": bar(0.076, 2.7e-6, 0.05, 0),
    }
    guide = {"play": 1e-3, "size": [0.1, 0.05], "restitution": 0.4, "mu": 0.01} | guide
    joints: dict[str, Any] = {
        "O": {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "crank"}},
        "A": {"first": {"body": "crank", "point": "end"}, "second": {"body": "rod"}},
        "B": {"first": {"body": "rod", "point": "end"}, "second": {"body": "slider", "point": [0.0, 0.0]}},
        "guide": {"kind": "slider", "first": {"body": "ground", "point": [0.0, 0.0]}, "direction": turn,
                  "second": {"body": "slider", "point": [0.0, 0.0]}, **guide},
    }  # fmt: skip
    rates = {"crank": 150.0, "rod": -75.0, "slider": -0.01}
    return Scene.parse({"name": "guided", "gravity": [-G * np.sin(-turn), -G * np.cos(turn)], "bodies": bodies,
                        "joints": joints, "markers": {name: {"body": name} for name in bodies},
                        "initial": {name: {"angle": turn, "rate": rate} for name, rate in rates.items()},
                        "solver": {"duration": duration, "relative_tolerance": 1e-12}})  # fmt: skip


@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_a_slider_strikes_its_guide_corner_by_corner_and_slides_on_both(turn: float) -> None:
    """The impacts of two corners accumulate at 2.69 ms at finite rates; both let go at one instant at 15.03 ms."""
    found = simulate(guided(0.025, turn), np.array([0.005, 0.01, 0.025]))
    assert found.ok, found.message
    assert found.energy_drift[0] < 1e-11
    told = found.model["events"]
    times = [0.002690903648407755, 0.002692254310925237, 0.0026924444331971444, 0.0026925056979773465]
    for event, time, corner in zip(told, times, (2, 1, 2, 1), strict=False):
        assert (event["kind"], event["corner"]) == ("impact", corner)
        assert event["time"] == pytest.approx(time, abs=1e-11)
    opens = [event["time"] for event in told if event["kind"] == "opens"]
    assert opens == pytest.approx([0.015031328460082] * 2, abs=1e-9)
    angles = [[0.5761231279263481, -0.27247973443391454, 0.0], [0.9478082373317464, -0.41457541187597485, 0.0],
              [2.0102142941440104, -0.47136088763865536, 0.0]]  # fmt: skip
    np.testing.assert_allclose(found.angles[:, :, 0] - turn, angles, rtol=0.0, atol=1e-10)


class Pinned:
    """One body with a hole about a fixed pin: it flies between impacts, whose law is Moreau's with friction.

    at: place of the hole from the centre of mass; wide: of the clearance; pin: radius.
    """

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.mass, self.inertia = rng.uniform(0.5, 2.0), rng.uniform(0.01, 0.1)
        self.at, self.wide, self.pin = rng.uniform(-0.3, 0.3, 2), rng.uniform(0.02, 0.05), rng.uniform(0.03, 0.1)
        self.kept, self.mu = rng.uniform(0.5, 1.0), rng.uniform(0.0, 0.6)
        away = rng.uniform(0.0, 0.8) * self.wide * np.array([np.cos(seed), np.sin(seed)])
        self.q = np.array([*(away - self._turned(0.3, self.at)), 0.3])
        self.v = np.array([*rng.uniform(-0.5, 0.5, 2), rng.uniform(-3.0, 3.0)])
        self.begin = self.q.copy(), self.v.copy()
        self.gains = False
        """Whether an impact gained energy, as Newton's law of restitution with friction may."""

    @staticmethod
    def _turned(angle: float, x: Any) -> Any:
        c, s = np.cos(angle), np.sin(angle)
        return np.array([c * x[0] - s * x[1], s * x[0] + c * x[1]])

    def _at(self, t: float) -> Any:
        return self.q + self.v * t + np.array([0.0, -G / 2, 0.0]) * t * t

    def _gap(self, t: float) -> float:
        q = self._at(t)
        return float(self.wide - np.hypot(*(q[:2] + self._turned(q[2], self.at))))

    def run(self, end: float, most: int) -> tuple[list[float], Any, Any]:
        """Return the times of the impacts until the end, or the first so many, and the state then."""
        now, times, grid = 0.0, list[float](), 1e-4
        while len(times) < most:
            ticks = np.arange(1, int((end - now) / grid) + 2) * grid
            below = np.flatnonzero([self._gap(t) < 0.0 for t in ticks])
            if not len(below) or now + ticks[below[0]] > end:
                break
            high = float(ticks[below[0]])
            step = float(brentq(self._gap, max(high - grid, 1e-9), high, xtol=1e-15, rtol=1e-14))
            self.q, self.v = self._at(step), self.v + np.array([0.0, -G, 0.0]) * step
            now += step
            times.append(now)
            self._strike()
        self.q, self.v, now = self._at(end - now), self.v + np.array([0.0, -G, 0.0]) * (end - now), end
        return times, self.q, self.v

    def _strike(self) -> None:
        centre = self.q[:2] + self._turned(self.q[2], self.at)
        n = -centre / np.hypot(*centre)  # the pin pushes the body so
        arm = self.pin * n - self.q[:2]
        axes = [n, np.array([-n[1], n[0]])]
        rows = np.array([[*axis, arm[0] * axis[1] - arm[1] * axis[0]] for axis in axes])
        inverse = np.diag([1 / self.mass, 1 / self.mass, 1 / self.inertia])
        matrix, rates = rows @ inverse @ rows.T, rows @ self.v
        push = np.linalg.solve(matrix, [-(1 + self.kept) * rates[0], -rates[1]])
        if abs(push[1]) > self.mu * push[0]:
            for way in (1.0, -1.0):
                cone = np.array([1.0, -way * self.mu])
                push = cone * -(1 + self.kept) * rates[0] / (matrix[0] @ cone)
                if way * (rates + matrix @ push)[1] >= 0.0:
                    break
        before, self.v = self.v @ (self.v / np.diag(inverse)), self.v + inverse @ rows.T @ push
        self.gains = self.gains or self.v @ (self.v / np.diag(inverse)) > before


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("swapped", [False, True])
def test_a_body_strikes_the_pin_that_it_has_play_on(seed: int, swapped: bool) -> None:
    """Pin and hole change places with the sides: the pin is that of the first body."""
    if swapped and seed > 2:
        pytest.skip("three are enough")
    body = Pinned(seed)
    if swapped:  # then the touch is at the body's pin, which is smaller by the play
        body.mu = 0.0
    (x, y, turn), (u, v, spin) = body.begin
    sides = {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "B", "point": body.at.tolist()}}
    if swapped:
        sides = {"first": sides["second"], "second": sides["first"]}
    joint = {**sides, "play": body.wide, "radius": body.pin, "restitution": body.kept, "mu": body.mu}
    duration = 0.25
    times, q, rates = body.run(duration, 40)
    scene = Scene.parse({"name": "pinned", "gravity": [0.0, -G], "joints": {"pin": joint},
                         "bodies": {"B": {"kind": "rigid-body", "mass": body.mass, "inertia": body.inertia}},
                         "initial": {"B": {"position": [x, y], "velocity": [u, v], "angle": turn, "rate": spin}},
                         "markers": {"P": {"body": "B"}},
                         "solver": {"duration": duration, "relative_tolerance": 1e-12}})  # fmt: skip
    found = simulate(scene, np.array([duration]))
    if body.gains:
        assert found.status[0] == "energy-check-failed"
        return
    assert found.ok, found.message
    assert len(times) >= 1
    assert len(times) < 40
    assert [event["time"] for event in found.model["events"]] == pytest.approx(times, abs=1e-9)
    np.testing.assert_allclose(found.points[0, 0, :, 0], q[:2], atol=1e-9)
    assert found.velocities is not None
    np.testing.assert_allclose(found.velocities[0, 0, :, 0], rates[:2], atol=1e-7)


@pytest.mark.parametrize("given", [{"law": {"stiffness": 1e6, "exponent": 1.5}}, {"restitution": 1.0}])
def test_a_ball_in_a_socket_swings_between_its_walls(given: dict[str, Any]) -> None:
    """In space, without gravity: a socket of 4 cm in which a ball of 2 cm flies to and fro, or springs back."""
    joint = {"kind": "spherical", "first": {"body": "ground", "point": [0.0, 0.0, 0.0]}, "second": {"body": "B"},
             "radius": 0.02, "play": 0.02, **given}  # fmt: skip
    scene = Scene.parse({"name": "socket", "dimensions": 3, "gravity": [0.0, 0.0, 0.0], "joints": {"ball": joint},
                         "bodies": {"B": {"kind": "rigid-body", "mass": 1.0, "inertia": [0.1, 0.1, 0.1]}},
                         "initial": {"B": {"position": [0.0, 0.0, 0.0], "velocity": [0.2, 0.1, 0.2]}},
                         "markers": {"P": {"body": "B"}}, "solver": {"duration": 0.3}})  # fmt: skip
    found = simulate(scene, np.array([0.3]))
    assert found.ok, found.message
    assert found.velocities is not None
    touch = 2.943275 * (1.25 / 1e6) ** 0.4 * 0.3**-0.2 if "law" in given else 0.0  # 2.9433 d/v of Hertz's law
    times = [event["time"] for event in found.model["events"] if event["kind"] in ("impact", "touches")]
    assert times == pytest.approx([0.02 / 0.3 + k * (0.04 / 0.3 + touch) for k in range(2)], abs=1e-6)
    np.testing.assert_allclose(found.velocities[0, 0, :, 0], [0.2, 0.1, 0.2], rtol=1e-8)


def cranked(**more: Any) -> dict[str, Any]:
    """A slider-crank with play in the pin between rod and slider, which the ground guides."""
    joints: dict[str, Any] = {
        "O": {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "crank"}},
        "A": {"first": {"body": "crank", "point": "end"}, "second": {"body": "rod"}},
        "B": {"first": {"body": "rod", "point": "end"}, "second": {"body": "slider", "point": [0.0, 0.0]},
              "play": 5e-4, "restitution": 0.7, **more},
        "guide": {"kind": "slider", "first": {"body": "ground", "point": [0.0, 0.0]}, "rotation": "locked",
                  "second": {"body": "slider", "point": [0.0, 0.0]}},
    }  # fmt: skip
    return {"name": "cranked", "gravity": [0.0, -G], "joints": joints,
            "bodies": {"crank": bar(1.0, 0.01, 0.2), "rod": bar(1.0, 0.01, 0.5), "slider": bar(1.0, 0.01, 0.1)},
            "markers": {"B": {"body": "rod", "point": "end"}, "S": {"body": "slider", "point": [0.0, 0.0]}},
            "initial": {"crank": {"angle": 0.8, "rate": 10.0}}, "solver": {"duration": 0.05}}  # fmt: skip


def test_a_pin_with_play_starts_centred_where_nothing_tells_where_it_is() -> None:
    found = simulate(Scene.parse(cranked()), np.array([0.0, 0.05]))
    assert found.ok, found.message
    apart = np.hypot(*(found.points[:, 0] - found.points[:, 1])[..., 0].T)
    assert apart[0] < 1e-12
    assert found.velocities is not None
    np.testing.assert_allclose(found.velocities[0, 0, :, 0], found.velocities[0, 1, :, 0], atol=1e-11)
    assert 0.0 < apart[1] <= 5e-4 * (1 + 1e-9)


def test_a_pin_with_play_starts_where_the_poses_say() -> None:
    given = cranked()
    slider = 0.2 * np.cos(0.8) + 0.5 * np.sqrt(1.0 - (0.4 * np.sin(0.8)) ** 2) + 3e-4
    given["initial"] |= {"rod": {"angle": -np.arcsin(0.4 * np.sin(0.8))}, "slider": {"position": [slider, 0.0]}}
    found = simulate(Scene.parse(given), np.array([0.0]))
    assert found.ok, found.message
    assert found.points[0, 1, 0, 0] - found.points[0, 0, 0, 0] == pytest.approx(3e-4, abs=1e-12)


def test_lanes_of_play_and_restitution_move_as_alone() -> None:
    scene, times = Scene.parse(cranked()), np.linspace(0.0, 0.05, 6)
    values = {"joints.B.play": np.array([2e-4, 5e-4, 1e-3]), "joints.B.restitution": np.array([0.3, 0.7, 0.9])}
    together = get_engine("gauss").simulate_many(scene, values, times)
    assert together.ok
    for lane in range(3):
        alone = simulate(scene.with_values({path: float(each[lane]) for path, each in values.items()}), times)
        np.testing.assert_allclose(together.points[..., lane], alone.points[..., 0], atol=2e-8)


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"play": 0.0}, "joints.B.play: Input should be greater than 0"),
        ({"play": None}, "joints.B: restitution: is of a joint with play; state `play` as well"),
        ({"mu": 0.1}, "joints.B: radius is missing"),
        ({"law": {"stiffness": 1e6}}, "restitution: is of rigid surfaces; state that of the law"),
        ({"kind": "slider"}, "joints.B: size is missing; a guide with play needs both"),
        ({"kind": "slider", "size": [0.1, 0.1], "rotation": "locked"}, "rotation: locked leaves no turn"),
        ({"mu": 0.1, "radius": 0.01, "mu_static": 0.05}, "joints.B.mu_static: must be at least mu, found 0.05"),
    ],
)
def test_a_joint_with_play_that_is_none_is_refused(given: dict[str, Any], text: str) -> None:
    with pytest.raises(InputError, match=re.escape(text)):
        Scene.parse(cranked(**given))


def test_in_space_a_hinge_has_no_play() -> None:
    joint = {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "B"}, "play": 1e-3}
    with pytest.raises(InputError, match=r"joints\.pin\.play: in space a spherical joint has play, a revol"):
        Scene.parse({"name": "hinge", "dimensions": 3, "joints": {"pin": joint}, "markers": {"P": {"body": "B"}},
                     "bodies": {"B": {"kind": "rigid-body", "mass": 1.0, "inertia": [1.0, 1.0, 1.0]}}})  # fmt: skip
