"""Contacts between bodies against closed forms: impacts, stick and slip, rolling, accumulations, Painleve's paradox."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import shoal
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation
from shoal.errors import InputError
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene, load_scene
from shoal.trajectory import Array, Trajectory

pytestmark = pytest.mark.compiles("kernels of contacts, which few machines need")
FLOOR = {"body": "ground", "line": 0.0}
G = 9.81


def machine(
    body: dict[str, Any], contacts: dict[str, Any], start: dict[str, Any], duration: float, **more: Any
) -> Scene:
    """One body B that starts with a position, and its contacts."""
    return Scene.parse({"name": "contacts", "bodies": {"B": body}, "contacts": contacts, "initial": {"B": start},
                        "markers": {"P": {"body": "B"}}, "solver": {"duration": duration}, **more})  # fmt: skip


def run(scene: Scene, *times: float, balance: float = 1e-10) -> Trajectory:
    found = simulate(scene, np.array(times or (scene.solver.duration,)))
    assert found.ok, found.message
    assert found.energy_drift[0] < balance
    return found


def events(found: Trajectory, kind: str) -> list[float]:
    return [event["time"] for event in found.model["events"] if event["kind"] == kind]


POINT = {"kind": "point-mass", "mass": 1.0}


def test_a_ball_bounces_until_it_rests() -> None:
    """The times of its impacts are a geometric series."""
    floor = {"floor": {"first": {"body": "B"}, "second": FLOOR, "restitution": 0.8}}
    found = run(machine(POINT, floor, {"position": [0.0, 1.0]}, 5.0), 1.0, 4.0, 5.0)
    first, kept = np.sqrt(2.0 / G), 0.8
    end = first * (1.0 + kept) / (1.0 - kept)
    times = events(found, "impact")
    for k in range(20):
        assert times[k] == pytest.approx(first * (1.0 + 2.0 * sum(kept**i for i in range(1, k + 1))), abs=1e-11)
    (rests,) = [event for event in found.model["events"] if event["kind"] == "rests"]
    assert rests["time"] == pytest.approx(end, abs=1e-9)
    assert found.points[2, 0, 1, 0] == 0.0


def test_friction_of_an_accumulation_keeps_its_whole_impulse() -> None:
    """A ball that bounces and slides loses mu times its normal impulse; hops that are left out count."""
    kept, mu = 0.5, 0.1
    floor = {"floor": {"first": {"body": "B"}, "second": FLOOR, "restitution": kept, "mu": mu}}
    found = run(machine(POINT, floor, {"position": [0.0, 1.0], "velocity": [30.0, 0.0]}, 5.0))
    # All normal impulse up to t balances gravity; the ball falls until the first impact.
    expected = 30.0 - mu * G * 5.0
    assert found.velocities is not None
    assert found.velocities[0, 0, 0, 0] == pytest.approx(expected, abs=1e-10)


def block(mu: float, slope: float, pull: float, duration: float) -> Scene:
    """A block on a slope that a force pulls down, which grows by `pull` N/s."""
    down = np.array([np.cos(slope), -np.sin(slope)])
    loads = {"pull": {"kind": "force", "at": {"body": "B"}, "force": (pull * down).tolist(),
                      "scale": {"table": [[0.0, 0.0], [10.0, 10.0]]}}}  # fmt: skip
    contact = {"slope": {"first": {"body": "B"}, "second": {"body": "ground", "line": -slope}, "mu": mu}}
    return machine(POINT, contact, {"position": [0.0, 0.0]}, duration, loads=loads)


@pytest.mark.parametrize("integrator", ["semi-implicit-euler", "leapfrog", "rk4"])
def test_the_energy_of_fixed_steps_counts_what_friction_takes(integrator: str) -> None:
    """A block slides to rest after v^2/(2 mu g), where all of its energy is taken up."""
    mu, speed, step = 0.3, 2.0, 1e-3
    floor = {"floor": {"first": {"body": "B"}, "second": FLOOR, "mu": mu}}
    start = {"position": [0.0, 0.0], "velocity": [speed, 0.0]}
    solver = {"duration": 1.0, "integrator": integrator, "step": step}
    found = run(machine(POINT, floor, start, 1.0, solver=solver))
    allowed = speed * step if integrator == "semi-implicit-euler" else 1e-12  # of first order
    assert found.points[0, 0, 0, 0] == pytest.approx(speed**2 / (2.0 * mu * G), abs=allowed)


def test_a_block_sticks_until_the_force_exceeds_friction() -> None:
    mu, slope, pull = 0.5, 0.4, 0.2
    found = run(block(mu, slope, pull, 6.0), 2.0, 6.0)
    begins = (mu * np.cos(slope) - np.sin(slope)) * G / pull
    (slips,) = events(found, "slips")
    assert slips == pytest.approx(begins, abs=1e-12)
    way = np.hypot(*found.points[:, 0, :, 0].T)
    assert way[0] < 1e-15
    assert way[1] == pytest.approx(pull * (6.0 - begins) ** 3 / 6.0, abs=1e-11)


@pytest.mark.parametrize("duration", [10.0, pytest.param(1000.0, marks=pytest.mark.slow)])
def test_what_sticks_does_not_creep(duration: float) -> None:
    """A block on a spring and a dry table comes to rest off the middle, after four half swings, for ever."""
    spring = {"kind": "spring", "first": {"body": "ground", "point": [-1.0, 0.0]}, "second": {"body": "B"},
              "stiffness": 100.0, "length": 1.0}  # fmt: skip
    table = {"table": {"first": {"body": "B"}, "second": FLOOR, "mu": 0.3}}
    found = run(machine(POINT, table, {"position": [0.25, 0.0]}, duration, loads={"spring": spring}), 2.0, duration)
    (sticks,) = events(found, "sticks")
    assert sticks == pytest.approx(4 * np.pi / 10.0, abs=1e-11)
    assert found.points[:, 0, 0, 0] == pytest.approx(0.25 - 4 * 2 * 0.3 * G / 100.0, abs=1e-12)
    assert found.points[0, 0, 0, 0] == found.points[1, 0, 0, 0]


def test_static_friction_above_that_of_slip_gives_stick_slip_on_a_belt() -> None:
    """The belt is at rest and the spring's foot is pulled, which is the same but for the observer."""
    rate, stiffness, static, kinetic = 0.1, 100.0, 0.4, 0.3
    scene = machine(
        POINT, {"belt": {"first": {"body": "B"}, "second": FLOOR, "mu": kinetic, "mu_static": static}},
        {"position": [0.0, 0.0]}, 2.0,
        ground_points={"foot": {"x": {"table": [[0.0, -1.0], [10.0, -1.0 - 10.0 * rate]]}}},
        loads={"spring": {"kind": "spring", "first": {"body": "ground", "point": "foot"}, "second": {"body": "B"},
                          "stiffness": stiffness, "length": 1.0}},
    )  # fmt: skip
    found = run(scene)
    slips, sticks = events(found, "slips"), events(found, "sticks")
    w, fall = np.sqrt(stiffness), (static - kinetic) * G / stiffness
    lasts = (2.0 * np.pi - 2.0 * np.arctan2(fall * w, rate)) / w
    assert slips[0] == pytest.approx(static * G / stiffness / rate, abs=1e-11)
    assert sticks[0] - slips[0] == pytest.approx(lasts, abs=1e-10)
    assert slips[1] - sticks[0] == pytest.approx(2.0 * fall / rate, abs=1e-10)


DISC = {"kind": "rigid-body", "mass": 1.0, "inertia": 0.005}


def test_the_built_in_disc_rolls_strikes_a_wall_and_rolls_back() -> None:
    """Slip ends after (u - w r) / (3 mu g), at two thirds of the rate and a third of the spin: solid disc."""
    scene, mu, kept, radius, begun = load_scene("rolling-disc"), 0.2, 0.8, 0.1, 3.0
    slip = begun / (3.0 * mu * G)
    rolled, rate = begun * slip - 0.5 * mu * G * slip**2, 2.0 / 3.0 * begun
    wall = slip + (3.0 - rolled) / rate
    again = (1.0 + kept) * rate / (3.0 * mu * G)
    back = 3.0 - kept * rate * again + 0.5 * mu * G * again**2
    rest, spun = 3.0 - wall - again, rate / radius * again - mu * G * again**2 / radius  # inertia m r^2 / 2
    end = rate * (1.0 - 2.0 * kept) / 3.0
    found = run(scene, 1.0, 3.0)
    assert found.points[:, 0, 0, 0] == pytest.approx([rolled + rate * (1.0 - slip), back + end * rest], abs=1e-10)
    turned = mu * G * slip**2 / radius + (3.0 - rolled) / radius + spun + end / radius * rest
    assert found.angles[-1, 0, 0] == pytest.approx(-turned, abs=1e-8)
    assert events(found, "impact") == pytest.approx([wall], abs=1e-10)
    assert [one.value for one in scene.expect.values()] == pytest.approx(found.points[:, 0, 0, 0], abs=1e-10)


def test_a_disc_slips_until_it_rolls() -> None:
    road = {"road": {"first": {"body": "B", "radius": 0.1}, "second": FLOOR, "mu": 0.2}}
    start = {"position": [0.0, 0.1], "velocity": [2.0, 0.0], "rate": 5.0}
    found = run(machine(DISC, road, start, 2.0), 1.0, 2.0)
    (sticks,) = events(found, "sticks")
    assert sticks == pytest.approx(2.5 / (3.0 * 0.2 * G), abs=1e-11)
    assert found.velocities is not None
    assert found.rates is not None
    assert found.velocities[:, 0, 0, 0] == pytest.approx(7.0 / 6.0, abs=1e-11)
    assert found.velocities[:, 0, 0, 0] == pytest.approx(-0.1 * found.rates[:, 0, 0], abs=1e-14)


@pytest.mark.parametrize(("mu", "rolling", "share"), [(0.2, False, None), (0.3, False, 1.5), (0.1, True, 1.5)])
def test_a_disc_rolls_down_a_slope_if_friction_suffices(mu: float, rolling: bool, share: float | None) -> None:
    slope = 0.6
    road = {"first": {"body": "B", "radius": 0.1}, "second": {"body": "ground", "line": -slope}, "mu": mu}
    start = {"position": [0.1 * np.sin(slope), 0.1 * np.cos(slope)]}
    found = run(machine(DISC, {"road": road | {"rolling": rolling}}, start, 1.0))
    expected = G * np.sin(slope) / share if share else G * (np.sin(slope) - mu * np.cos(slope))
    assert found.velocities is not None
    assert np.hypot(*found.velocities[0, 0, :, 0]) == pytest.approx(expected, abs=1e-10)


OBLIQUE = [
    # angle, velocity and spin before, mu, e, e_T, and after: closed form of each mode (Moreau's law)
    (0.0, (3.0, -4.0, 2.0), 0.2, 0.5, 0.0, (2.55, -1.75, -4.75)),
    (0.9273, (1.0, -3.0, -4.0), 0.5, 0.5, 0.0, (1.3308936539253247, -2.3382126921493507, -4.39706194130858)),
    (1.2, (-4.0, -2.0, 1.0), 0.3, 0.0, 0.0, (-3.3497805595775145, 0.16739813474161888, 0.461969235302773)),
    (0.6, (0.0, -1.0, 0.0), 1.0, 0.8, 0.5, (0.6291263830278778, -0.11959148427175467, -1.1142030801280658)),
]


def leaning(angle: float, velocity: Any, mass: float, inertia: float, **law: Any) -> Scene:
    """A rod of half length 1 m whose lower end touches the ground."""
    body = {"kind": "rigid-body", "mass": mass, "inertia": inertia, "named_points": {"end": [-1.0, 0.0]}}
    start = {"position": [np.cos(angle), np.sin(angle)], "angle": angle, "velocity": [*velocity[:2]],
             "rate": velocity[2]}  # fmt: skip
    return machine(body, {"ground": {"first": {"body": "B", "point": "end"}, "second": FLOOR, **law}}, start, 1e-3)


@pytest.mark.parametrize(("angle", "before", "mu", "kept", "tangential", "after"), OBLIQUE)
def test_a_rod_strikes_the_ground_with_friction(
    angle: float, before: Any, mu: float, kept: float, tangential: float, after: Any
) -> None:
    law = {"mu": mu, "restitution": kept, "tangential_restitution": tangential}
    found = run(leaning(angle, before, 12.0, 4.0, **law).with_values({"gravity": [0.0, 0.0]}), 1e-9)
    assert found.velocities is not None
    assert found.rates is not None
    np.testing.assert_allclose([*found.velocities[0, 0, :, 0], found.rates[0, 0, 0]], after, atol=1e-7)


PAINLEVE = [(1.2, 0.0, -1.0, ""), (1.6, 0.0, -1.0, "no-contact-force"), (1.6, 5.0, -1.0, "several-motions"),
            (1.6, 0.0, 1.0, ""), (1.2, 5.0, -1.0, "")]  # fmt: skip
"""mu, spin, slip, and what the run ends with, at tan(angle) = 2: beyond mu = 4/3 none or several accelerations."""


@pytest.mark.parametrize(("mu", "spin", "slip", "code"), PAINLEVE)
def test_a_sliding_rod_with_none_or_several_accelerations_is_told(
    mu: float, spin: float, slip: float, code: str
) -> None:
    angle = np.arctan(2.0)
    velocity = (slip - np.sin(angle) * spin, np.cos(angle) * spin, spin)
    found = simulate(leaning(angle, velocity, 1.0, 1 / 3, mu=mu), np.array([1e-4]))
    assert found.codes == [code] * bool(code)


def test_a_rod_slides_as_its_equations_say() -> None:
    """mu p_N against the slip, by scipy, until the rod leaves the ground or lies on it."""
    angle, mu = 1.3, 0.3
    scene = leaning(angle, (-2.0, 0.0, 0.0), 1.0, 1 / 3, mu=mu).with_values({"solver.duration": 0.2})
    found = run(scene)

    def rates(_: float, y: Any) -> Any:
        _, th, u, w = y
        s, c = np.sin(th), np.cos(th)
        # a_y - c alpha + s w^2 = 0 for the end; alpha / 3 = N (mu s - c), a_y = N - g
        push = (G - s * w * w) / (1.0 - 3.0 * c * (mu * s - c))
        return [u, w, mu * push, 3.0 * push * (mu * s - c)]

    end = solve_ivp(rates, (0.0, 0.2), [np.cos(angle), angle, -2.0, 0.0], "DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    assert found.points[0, 0, 0, 0] == pytest.approx(end[0], abs=1e-10)
    assert found.angles[0, 0, 0] == pytest.approx(end[1], abs=1e-10)


def test_a_block_rocks_until_it_stands() -> None:
    """Housner's ratio of spins at each impact; it stands where their times accumulate."""
    b, h, tilt = 0.2, 0.8, 0.12
    body = {"kind": "rigid-body", "mass": 1.0, "inertia": (b * b + h * h) / 3}
    corners = {name: {"first": {"body": "B", "point": [x, -h]}, "second": FLOOR, "mu": 1.0}
               for name, x in (("left", -b), ("right", b))}  # fmt: skip
    turned = np.array([[np.cos(tilt), -np.sin(tilt)], [np.sin(tilt), np.cos(tilt)]]) @ [b, h]
    found = run(machine(body, corners, {"position": turned.tolist(), "angle": tilt}, 8.0))
    expected = [0.4338738210642413, 1.1431470900549372, 1.7462333164173767, 2.269836949010758, 2.730312998187644]
    assert events(found, "impact")[:5] == pytest.approx(expected, abs=1e-10)
    assert events(found, "impact")[-1] == pytest.approx(7.036712828396093, abs=1e-4)
    assert found.angles[0, 0, 0] == pytest.approx(0.0, abs=1e-12)


def test_exact_stick_of_a_joint_is_verified_without_a_run_that_smooths_it() -> None:
    """A scene that is written with all fields is read again; its only errors are those of time."""
    bar = {"kind": "rigid-body", "mass": 1.0, "inertia": 1 / 12, "centre_of_mass": [0.5, 0.0]}
    pin = {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "B"}, "coulomb": 9.0, "stick": "exact"}
    scene = {"name": "dry", "bodies": {"B": bar}, "joints": {"O": pin}, "initial": {"B": {"angle": -0.3}},
             "markers": {"P": {"body": "B", "point": [1.0, 0.0]}}, "solver": {"duration": 1.0}}  # fmt: skip
    found = shoal.simulate(scene, set={"joints.O.coulomb": 8.0})
    assert found.ok, found.message
    assert found.points[-1, 0, :, 0] == pytest.approx([np.cos(0.3), -np.sin(0.3)], abs=1e-14)
    assert set(found.errors.estimates) == {"time"}
    with pytest.raises(InputError, match=r"joints\.O: coulomb_speed: smooths friction"):
        shoal.simulate(scene, set={"joints.O.coulomb_speed": 0.1})


def test_a_step_too_long_for_a_rod_with_contacts_names_no_integrator_that_knows_none() -> None:
    rod = {"kind": "rod", "length": 1.0, "height": 0.01, "width": 0.02, "density": 2700.0, "youngs_modulus": 7e10,
           "element": "ancf-cable", "elements": 2}  # fmt: skip
    floor = {"floor": {"first": {"body": "B", "point": "end"}, "second": FLOOR}}
    with pytest.raises(InputError, match=r"beyond the stability limit .* use a smaller step$"):
        run(machine(rod, floor, {"position": [0.0, 0.5]}, 1.0))


@pytest.mark.parametrize("wall", [-1.2, -0.7, -0.3, 0.02, 0.17])
def test_a_pinned_rod_leaves_a_rough_wall_at_its_restitution(wall: float) -> None:
    """Its joint leaves one rate: if the tip may not stick and leave at once, it slips on."""
    contact = {"first": {"body": "B", "point": [0.25, 0.0]}, "restitution": 0.6, "mu": 0.2,
               "second": {"body": "ground", "point": [0.5, 0.0], "line": wall}}  # fmt: skip
    scene = machine({"kind": "rigid-body", "mass": 2.0, "inertia": 0.1}, {"wall": contact}, {
        "position": [0.25 * np.cos(0.2), 0.25 * np.sin(0.2)], "angle": 0.2, "rate": -1.0,
        "velocity": [0.25 * np.sin(0.2), -0.25 * np.cos(0.2)],
    }, 0.3, gravity=[0.0, 0.0], joints={"pin": {"kind": "revolute", "first": {"body": "ground", "point": [0.0, 0.0]},
                                                "second": {"body": "B", "point": [-0.25, 0.0]}}})  # fmt: skip
    found = run(scene)
    (impact,) = events(found, "impact")
    assert found.angles[-1, 0, 0] == pytest.approx(0.2 - impact + 0.6 * (0.3 - impact), abs=1e-12)


def test_friction_in_a_hole_turns_with_the_surface() -> None:
    """A disc that slides around a hole, until it has gone half around; Newton and Euler by SciPy."""
    mass, inertia, radius, hole, mu = 1.0, 2e-3, 0.1, 0.5, 0.05
    way, length = 6.0 / (hole - radius), 0.3

    def slides(_: float, y: Array) -> Array:
        angle, rate, spin = y
        normal = mass * (rate**2 * (hole - radius) + G * np.cos(angle))
        slip = rate * (hole - radius) + spin * radius  # of the disc's point at the wall, along the way
        friction = -mu * normal * np.sign(slip)
        return np.array([rate, friction / mass / (hole - radius) - G * np.sin(angle) / (hole - radius),
                         friction * radius / inertia])  # fmt: skip

    true: Any = solve_ivp(slides, (0.0, length), [0.0, way, 30.0], "DOP853", rtol=1e-12, atol=1e-12)
    wall = {"first": {"body": "B", "radius": radius}, "mu": mu,
            "second": {"body": "ground", "point": [0.0, 0.0], "hole": hole}}  # fmt: skip
    scene = machine({"kind": "rigid-body", "mass": mass, "inertia": inertia}, {"wall": wall}, {
        "position": [0.0, -(hole - radius)], "velocity": [6.0, 0.0], "rate": 30.0}, length)  # fmt: skip
    found, angle = run(scene), true.y[0, -1]
    assert angle > 2.0
    expected = (hole - radius) * np.array([np.sin(angle), -np.cos(angle)])
    np.testing.assert_allclose(found.points[-1, 0, :, 0], expected, atol=1e-9)


@pytest.mark.slow  # compiles kernels of contacts in space
def test_friction_in_a_bowl_turns_with_the_surface() -> None:
    """A sphere that slides in a hollow sphere; Newton and Euler by SciPy."""
    mass, radius, hole, mu = 0.5, 0.1, 0.6, 0.05
    inertia, far, length = 0.4 * mass * radius**2, hole - radius, 1.0
    down = np.array([0.0, 0.0, -G])

    def slides(_: float, y: Array) -> Array:
        place, velocity, spin = y[:3], y[3:6], y[6:]
        inward = -place / far
        slip = velocity + np.cross(spin, -radius * inward)
        slip -= inward * (inward @ slip)
        normal = mass * (velocity @ velocity / far - inward @ down)
        friction = -mu * normal * slip / np.linalg.norm(slip)
        force = normal * inward + friction
        return np.concatenate([velocity, force / mass + down, np.cross(-radius * inward, friction) / inertia])

    start = [0.3, 0.0, -0.4], [0.0, 3.0, 0.0], [20.0, 5.0, -10.0]
    true: Any = solve_ivp(slides, (0.0, length), np.concatenate(start), "DOP853", rtol=1e-12, atol=1e-12)
    bowl = {"first": {"body": "B", "radius": radius}, "mu": mu,
            "second": {"body": "ground", "point": [0.0, 0.0, 0.0], "hole": hole}}  # fmt: skip
    body = {"kind": "rigid-body", "mass": mass, "inertia": [inertia] * 3}
    scene = machine(body, {"bowl": bowl}, dict(zip(("position", "velocity", "spin"), start, strict=True)), length,
                    dimensions=3, gravity=down.tolist())  # fmt: skip
    found = run(scene, balance=1e-8)
    assert not found.model["events"]
    np.testing.assert_allclose(found.points[-1, 0, :, 0], true.y[:3, -1], atol=1e-8)


def test_a_ball_in_a_circular_hole_is_a_billiard() -> None:
    hole = {"hole": {"first": {"body": "B"}, "second": {"body": "ground", "hole": 1.0}, "restitution": 1.0}}
    rates = [-0.93232734560603442, 0.36161543196496198]
    scene = machine(POINT, hole, {"position": [1.0, 0.0], "velocity": rates}, 100.0, gravity=[0.0, 0.0])
    found = run(scene, 10.0, 100.0)
    np.testing.assert_allclose(events(found, "impact"), 1.8646546912120687 * np.arange(1, 54), atol=1e-10)
    expected = [[0.44266644177259384, 0.011996323440632945], [-0.419071102147309, -0.11495046920121202]]
    np.testing.assert_allclose(found.points[:, 0, :, 0], expected, atol=1e-11)


def test_dry_friction_of_a_joint_sticks() -> None:
    """A pendulum with a constant friction torque, half swing by half swing by scipy."""
    section = {"kind": "rigid-body", "mass": 1.0, "inertia": 1 / 12, "centre_of_mass": [0.5, 0.0]}
    pin = {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "B"}, "coulomb": 0.8, "stick": "exact"}
    scene = Scene.parse({"name": "dry", "bodies": {"B": section}, "joints": {"O": pin},
                         "initial": {"B": {"angle": -0.3}}, "markers": {"P": {"body": "B"}},
                         "solver": {"duration": 20.0}})  # fmt: skip
    found = run(scene, 10.0, 20.0)
    angle, time, way = -0.3, 0.0, -1.0
    while abs(G / 2 * np.cos(angle)) > 0.8:

        def stands(_: float, y: Any) -> float:
            return float(y[1])

        stands.terminal, stands.direction = True, -way  # type: ignore[attr-defined]
        swing = solve_ivp(lambda _, y, s=way: [y[1], -3.0 * (G / 2 * np.cos(y[0]) + s * 0.8)], (0.0, 9.0), [angle, 0.0],
                          "DOP853", rtol=1e-13, atol=1e-14, events=stands)  # fmt: skip
        angle, time, way = float(swing.y[0, -1]), time + float(swing.t[-1]), -way
    (sticks,) = events(found, "sticks")
    assert sticks == pytest.approx(time, abs=1e-9)
    assert found.angles[:, 0, 0] == pytest.approx(angle, abs=1e-11)
    assert found.angles[0, 0, 0] == pytest.approx(found.angles[1, 0, 0], abs=1e-13)


SPHERE = [
    # velocity, spin, mu, and the velocity after: tangential inverse mass 7/(2 m), the slip keeps its direction
    ((3.0, 1.0, -4.0), (100.0, -200.0, 50.0), 0.1, (2.3382155783869982, 0.7163781050229993, 3.2)),
    ((1.0, 0.5, -4.0), (0.0, 30.0, 0.0), 0.6, (0.8857142857142857, 0.35714285714285715, 3.2)),
]


@pytest.mark.slow  # compiles kernels of contacts in space
@pytest.mark.parametrize(("velocity", "spin", "mu", "after"), SPHERE)
def test_a_sphere_bounces_off_a_plane_with_friction(velocity: Any, spin: Any, mu: float, after: Any) -> None:
    inertia = 0.4 * 0.05 * 0.02**2
    body = {"kind": "rigid-body", "mass": 0.05, "inertia": [inertia] * 3}
    plane = {"first": {"body": "B", "radius": 0.02}, "second": {"body": "ground", "plane": "z"}, "mu": mu,
             "restitution": 0.8}  # fmt: skip
    start = {"position": [0.0, 0.0, 0.06], "velocity": [*velocity], "spin": [*spin]}
    scene = machine(body, {"plane": plane}, start, 0.02, dimensions=3, gravity=[0.0, 0.0, 0.0])
    found = run(scene)
    assert found.velocities is not None
    np.testing.assert_allclose(found.velocities[0, 0, :, 0], after, atol=1e-12)


@pytest.mark.slow  # compiles kernels of contacts in space
def test_a_sphere_rolls_on_a_slope_as_on_rails() -> None:
    """5/7 of the acceleration down the slope, at right angles to it the rate stays."""
    inertia, slope = 0.4 * 0.5 * 0.1**2, 0.3
    body = {"kind": "rigid-body", "mass": 0.5, "inertia": [inertia] * 3}
    normal = [np.sin(slope), 0.0, np.cos(slope)]
    road = {"first": {"body": "B", "radius": 0.1}, "second": {"body": "ground", "plane": normal}, "mu": 0.5}
    start = {"position": (0.1 * np.array(normal)).tolist(), "velocity": [0.0, 0.7, 0.0],
             "spin": (np.cross(normal, [0.0, 0.7, 0.0]) / 0.1).tolist()}  # fmt: skip
    scene = machine(body, {"road": road}, start, 1.0, dimensions=3, gravity=[0.0, 0.0, -G])
    found = run(scene)
    assert found.velocities is not None
    down = 5.0 / 7.0 * G * np.sin(slope)
    expected = [down * np.cos(slope), 0.7, -down * np.sin(slope)]
    np.testing.assert_allclose(found.velocities[0, 0, :, 0], expected, atol=1e-10)


@pytest.mark.slow  # compiles kernels of lanes
def test_lanes_stick_and_slip_on_their_own() -> None:
    from shoal.engines import get_engine

    scene, values = block(0.5, 0.4, 0.2, 6.0), np.array([0.43, 0.5, 0.55, 0.6, 0.9])
    times = np.linspace(0.5, 6.0, 12)
    together = get_engine("gauss").simulate_many(scene, {"contacts.slope.mu": values}, times)
    assert together.ok
    for lane, value in enumerate(values):
        alone = simulate(block(float(value), 0.4, 0.2, 6.0), times)
        np.testing.assert_allclose(together.points[..., lane], alone.points[..., 0], atol=1e-10)


BAD = [
    ({"first": {"body": "B", "line": 0.0}}, "first.line: the first side is a point or round"),
    ({"second": {"body": "B", "line": 0.0}}, "second.body: 'B' is the first body as well"),
    ({"second": {"body": "ground"}}, "second: is a point as the first side is"),
    (
        {"second": {"body": "ground", "plane": "y"}},
        "contacts.C.second.plane: this is for scenes in space",
    ),
    ({"first": {"body": "B", "radius": 0.2}, "second": {"body": "ground", "hole": 0.1}}, "second.hole: must be larger"),
    ({"mu": 0.3, "mu_static": 0.2}, "mu_static: must be at least mu, found 0.2 and 0.3"),
    ({"second": {"body": "ground", "line": 0.0, "radius": 0.1}}, "line: radius is stated as well"),
    ({"second": {"body": "C", "line": 0.0}}, "contacts.C.second.body: no body 'C'"),
]


@pytest.mark.parametrize(("given", "text"), BAD)
def test_a_contact_that_is_none_is_refused(given: dict[str, Any], text: str) -> None:
    contact = {"first": {"body": "B"}, "second": FLOOR} | given
    with pytest.raises(InputError) as refused:
        machine(POINT, {"C": contact}, {"position": [0.0, 1.0]}, 1.0)
    assert text in str(refused.value)


def test_a_start_within_a_surface_is_refused() -> None:
    scene = machine(POINT, {"C": {"first": {"body": "B"}, "second": FLOOR}}, {"position": [0.0, -0.1]}, 1.0)
    with pytest.raises(InputError, match=r"contacts\.C: the machine starts beyond this limit, at -0\.1"):
        simulate(scene, np.array([1.0]))


@pytest.mark.slow  # compiles no more, but takes a second
def test_a_thin_disc_rolls_and_wobbles_on_a_plane() -> None:
    """Rolling equations in the semi-body frame and Newton-Euler with directors agree on these places to 3e-11."""
    mass, radius = 1.0, 0.3
    inertia = [mass * radius**2 / 2, mass * radius**2 / 4, mass * radius**2 / 4]
    axle = np.array([0.2633697832234622, -0.8514029104439915, 0.4535961214255773])
    across = np.cross(axle, [0.0, 0.0, 1.0]) / np.linalg.norm(np.cross(axle, [0.0, 0.0, 1.0]))
    turn = np.stack([axle, across, np.cross(axle, across)], axis=1)
    start = {"position": [0.0, 0.0, 0.26736220801843064], "rotation": Rotation.from_matrix(turn).as_rotvec().tolist(),
             "spin": [-2.18926368267762, 8.430839665846014, -2.7455540527380435],
             "velocity": [2.6110128946259517, 0.6957362087323377, 0.05443153457106936]}  # fmt: skip
    body = {"kind": "rigid-body", "mass": mass, "inertia": inertia}
    road = {"first": {"body": "B", "radius": radius, "axis": axle.tolist()}, "second": {"body": "ground", "plane": "z"},
            "rolling": True}  # fmt: skip
    scene = machine(body, {"road": road}, start, 4.0, dimensions=3, gravity=[0.0, 0.0, -G])
    found = run(scene, 0.5, 1.0, 4.0)
    expected = [[1.1398611167170902, 0.686002279087787, 0.26934210028369765],
                [1.7223964854128155, 1.8815356650442918, 0.2715019974512399],
                [-2.9050459249182494, 1.929708543357389, 0.2726863759712]]  # fmt: skip
    np.testing.assert_allclose(found.points[:, 0, :, 0], expected, atol=1e-9)
    assert found.model["events"] == []


LAWS = [
    # Hertz: contact time 2.9433 d_max / v, d_max = (5 m v^2 / 4 K)^(2/5)
    ({"stiffness": 1e8}, 8.083414963977903e-4, 1.0),
    ({"stiffness": 1e8, "damping": 0.5}, None, 0.7484349315974341),
    ({"stiffness": 1e8, "restitution": 0.7}, None, 0.7),
    # A spring with a damper that cannot pull: e = exp(-tan(p) (pi - 2 p)), sin(p) the damping ratio
    ({"stiffness": 1e5, "exponent": 1.0, "viscosity": 20.0}, None, 0.7440793977217797),
]


@pytest.mark.parametrize(("law", "lasts", "kept"), LAWS)
def test_a_contact_that_gives_way_rebounds_as_its_law_says(
    law: dict[str, Any], lasts: float | None, kept: float
) -> None:
    wall = {"wall": {"first": {"body": "B"}, "second": FLOOR, "law": law}}
    start = {"position": [0.0, 1e-3], "velocity": [0.0, -1.0]}
    scene = machine(POINT | {"mass": 0.1}, wall, start, 0.01, gravity=[0.0, 0.0])
    found = run(scene, balance=1e-8)
    assert found.velocities is not None
    assert found.velocities[0, 0, 1, 0] == pytest.approx(kept, abs=1e-9)
    (touches,), (opens,) = events(found, "touches"), events(found, "opens")
    assert touches == pytest.approx(1e-3, abs=1e-14)
    if lasts is not None:
        assert opens - touches == pytest.approx(lasts, abs=1e-12)


def test_a_ball_on_a_soft_floor_comes_to_rest_and_sticks() -> None:
    floor = {
        "floor": {"first": {"body": "B"}, "second": FLOOR, "mu": 0.3, "law": {"stiffness": 1e4, "restitution": 0.5}}
    }
    found = run(machine(POINT, floor, {"position": [0.0, 0.1], "velocity": [3.0, 0.0]}, 8.0), 6.0, 8.0, balance=1e-8)
    assert found.points[1, 0, 1, 0] == pytest.approx(-((G / 1e4) ** (2 / 3)), rel=1e-6)
    assert found.points[0, 0, 0, 0] == pytest.approx(found.points[1, 0, 0, 0], abs=1e-12)
    assert len(events(found, "sticks")) >= 1


@pytest.mark.parametrize("law", [{"exponent": 1.5, "restitution": 0.6}, {"exponent": 1.0, "restitution": 0.9}, {}])
def test_friction_under_a_law_ends_with_the_touch(law: dict[str, float]) -> None:
    """A ball that bounces on a soft floor until it rolls; where the force ends no friction is left to decide on."""
    contact = {"first": {"body": "B", "radius": 0.1}, "second": FLOOR, "mu": 0.2, "law": {"stiffness": 1e6, **law}}
    ball = {"kind": "rigid-body", "mass": 1.0, "inertia": 0.004}
    found = run(machine(ball, {"floor": contact}, {"position": [0.0, 0.3], "velocity": [0.5, 0.0]}, 1.5), balance=1e-7)
    assert found.velocities is not None
    assert found.velocities[0, 0, 0, 0] == pytest.approx(0.5 * 0.01 / 0.014, abs=1e-8)
    assert len(events(found, "opens")) > 2


@pytest.mark.parametrize("law", [{"restitution": 1.0}, {"law": {"stiffness": 1e8}}])
@pytest.mark.parametrize("step", [{}, {"integrator": "leapfrog", "step": 1e-5}])
def test_a_gap_that_closes_just_at_the_end_of_a_step_is_seen(law: dict[str, Any], step: dict[str, Any]) -> None:
    """A ball that flies 1 mm at 1 m/s, in steps and to times of round numbers."""
    wall = {"wall": {"first": {"body": "B"}, "second": FLOOR, **law}}
    start = {"position": [0.0, 1e-3], "velocity": [0.0, -1.0]}
    scene = machine(POINT | {"mass": 0.1}, wall, start, 0.01, gravity=[0.0, 0.0]).with_values(
        {f"solver.{name}": value for name, value in step.items()}
    )
    found = run(scene, 0.001, 0.0012, 0.01, balance=1e-3)
    (met,) = events(found, "impact") + events(found, "touches")
    assert met == pytest.approx(1e-3, abs=1e-14)
    assert found.velocities is not None
    assert found.velocities[2, 0, 1, 0] == pytest.approx(1.0, abs=1e-9 if not step else 1e-3)


def test_a_block_at_rest_on_two_corners_shares_its_weight_and_its_friction_alike() -> None:
    """Their friction is not unique: each holds as its normal force lets it, and both begin to slip at once."""
    b, h = 0.3, 0.1
    body = {"kind": "rigid-body", "mass": 1.0, "inertia": (b * b + h * h) / 3}
    corners = {name: {"first": {"body": "B", "point": [x, -h]}, "second": FLOOR, "mu": 0.5}
               for name, x in (("left", -b), ("right", b))}  # fmt: skip
    loads = {"pull": {"kind": "force", "at": {"body": "B", "point": [0.0, -h]}, "force": [1.0, 0.0],
                      "scale": {"table": [[0.0, 0.0], [10.0, 10.0]]}}}  # fmt: skip
    found = run(machine(body, corners, {"position": [0.0, h]}, 6.0, loads=loads), 4.9, 6.0)
    assert events(found, "slips") == pytest.approx([0.5 * G, 0.5 * G], abs=1e-9)
    assert found.points[0, 0, 0, 0] == pytest.approx(0.0, abs=1e-14)
    assert found.points[1, 0, 0, 0] == pytest.approx((6.0 - 0.5 * G) ** 3 / 6.0, abs=1e-9)


@pytest.mark.parametrize(("other", "codes"), [(0.1, ["contact-forces-not-unique"]), (0.3, [])])
def test_friction_of_contacts_that_share_a_load_is_told_where_it_is_a_choice(other: float, codes: list[str]) -> None:
    """Two contacts at one place: alike they are one, with different coefficients nothing tells what each bears."""
    floors = {name: {"first": {"body": "B"}, "second": FLOOR, "mu": mu} for name, mu in (("one", 0.3), ("two", other))}
    found = shoal.simulate(machine(POINT, floors, {"position": [0.0, 0.0], "velocity": [2.0, 0.0]}, 0.5))
    assert found.ok
    assert [one.code for one in found.findings] == codes
    if not codes:
        assert found.marker("P")[-1, 0] == pytest.approx(2.0 * 0.5 - 0.5 * 0.3 * G * 0.25, abs=1e-10)


@pytest.mark.parametrize(("left", "right", "mu"), [(0.41, 0.78, 0.36), (0.13, 1.03, 0.08), (0.96, 0.48, 0.5)])
def test_a_body_in_a_notch_of_two_lines_rests_with_friction_that_suffices(left: float, right: float, mu: float) -> None:
    """Of the forces that bear it, which are not unique, there are some with no friction at all."""
    lines = {
        name: {"first": {"body": "B"}, "second": {"body": "ground", "line": angle}, "mu": mu}
        for name, angle in (("left", -left), ("right", right))
    }
    found = run(machine(POINT, lines, {"position": [0.02, 0.3]}, 3.0))
    assert np.hypot(*found.points[0, 0, :, 0]) < 1e-9
    assert len(found.model["events"]) < 40
    assert {*found.model["closed_contacts"]} == {"left", "right"}
