"""Modes about steady motions: rotors, tops, pendulums and blades against closed forms and their own equations."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import linear_sum_assignment
from scipy.spatial.transform import Rotation
from shoal.errors import ComputationError, InputError
from shoal.mechanics.analysis.campbell import campbell
from shoal.mechanics.analysis.modes import Modes, modes
from shoal.scene import Scene, load_scene
from shoal.trajectory import Array

ORIGIN = {"body": "ground", "point": [0.0, 0.0, 0.0]}
GRAVITY = 9.81


def in_space(bodies: dict[str, Any], start: dict[str, Any], gravity: float = 0.0, **more: Any) -> Scene:
    marker = {"m": {"body": next(iter(bodies)), "point": [0.3, 0.0, 0.0]}}
    if bodies[next(iter(bodies))]["kind"] == "point-mass":
        marker = {"m": {"body": next(iter(bodies))}}
    return Scene.parse({"name": "turning", "dimensions": 3, "gravity": [0.0, 0.0, -gravity], "bodies": bodies,
                        "initial": start, "markers": marker, **more})  # fmt: skip


def bearings(stations: Array, stiffness: Array, damping: Array) -> dict[str, Any]:
    """Springs with dampers along y and z at places of the shaft; stiffness and damping (stations, 2)."""
    return {
        f"{axis}{n}": {
            "kind": "spring", "stiffness": stiffness[n, k], "damping": damping[n, k],
            "first": {"body": "ground", "point": [x, *np.eye(2)[k].tolist()]},
            "second": {"body": "rotor", "point": [x, 0.0, 0.0]},
        }
        for n, x in enumerate(stations.tolist()) for k, axis in enumerate("yz")
    }  # fmt: skip


def rotor(inertia: Any, speed: float, loads: dict[str, Any], mass: float = 2.0, **start: Any) -> Scene:
    body = {"kind": "rigid-body", "mass": mass, "inertia": [float(one) for one in inertia]}
    begin = {"position": [0.0, 0.0, 0.0], "spin": [speed, 0.0, 0.0], **start}
    return in_space({"rotor": body}, {"rotor": begin}, loads=loads)


def supported(stations: Array, values: Array) -> Array:
    """Stiffness or damping of y, z and the turns about y and z: at x the shaft is at y + x tz, z - x ty."""
    total = np.zeros((4, 4))
    for x, (along_y, along_z) in zip(stations, values, strict=True):
        y, z = np.array([1.0, 0.0, 0.0, x]), np.array([0.0, 1.0, -x, 0.0])
        total += along_y * np.outer(y, y) + along_z * np.outer(z, z)
    return total


def quadratic(mass: Array, damping: Array, stiffness: Array) -> tuple[Array, Array]:
    """Roots with a positive imaginary part and their shapes, of M x'' + D x' + K x = 0."""
    n = len(mass)
    values, vectors = np.linalg.eig(
        np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)]])
    )
    order = np.argsort(values.imag)
    chosen = order[values.imag[order] > 1e-6]
    return values[chosen], vectors[:n, chosen]


def oscillating(found: Modes) -> Array:
    return np.array([mode.eigenvalue for mode in found.modes if mode.eigenvalue.imag > 0])


def matched(found: Array, expected: Array, size: float, tolerance: float = 1e-7) -> None:
    assert len(found) == len(expected)
    here, there = linear_sum_assignment(np.abs(found[:, None] - expected))
    np.testing.assert_allclose(found[here], expected[there], rtol=0.0, atol=tolerance * size)


def test_random_round_rotors_on_random_bearings_whirl_as_their_own_equations_say() -> None:
    """Bearings of any stiffness and damping, in a frame at rest; forward and backward by the orbit."""
    rng = np.random.default_rng(51)
    named = 0
    for case in range(8):
        polar, diametral, speed = rng.uniform(0.005, 0.04), rng.uniform(0.02, 0.05), rng.uniform(-400.0, 400.0)
        stations = np.array([-rng.uniform(0.1, 0.5), rng.uniform(0.1, 0.5)])
        stiffness = 10.0 ** rng.uniform(3.0, 5.0, (2, 2))
        damping = rng.uniform(0.0, 20.0, (2, 2)) * (case % 2)
        if case > 5:
            stiffness[:, 1], damping[:, 1] = stiffness[:, 0], damping[:, 0]
        scene = rotor([polar, diametral, diametral], speed, bearings(stations, stiffness, damping))
        mass = np.diag([2.0, 2.0, diametral, diametral])
        turning = np.zeros((4, 4))
        turning[2, 3], turning[3, 2] = polar * speed, -polar * speed
        values, shapes = quadratic(mass, supported(stations, damping) + turning, supported(stations, stiffness))
        found = modes(scene, count=12)
        assert found.ok
        assert all(mode.frame == "fixed" for mode in found.modes)
        matched(oscillating(found), values, np.max(np.abs(values)))
        whirls = {mode.eigenvalue.imag: mode.whirl for mode in found.modes}
        for value, shape in zip(values, shapes.T, strict=True):
            # About x, y leads z where the orbit goes with it; the rate of the area swept, weighted by the inertias.
            swept = [-2.0 * m * np.imag(np.conj(a) * b) for m, a, b in
                     ((2.0, shape[0], shape[1]), (diametral, shape[2], shape[3]))]  # fmt: skip
            if abs(sum(swept)) > 1e-3 * np.sum(np.diag(mass) * np.abs(shape) ** 2):
                named += 1
                nearest = min(whirls, key=lambda one: abs(one - value.imag))
                assert whirls[nearest] == ("forward" if sum(swept) * speed > 0 else "backward")
    assert named > 20


@pytest.mark.slow
def test_random_rotors_that_are_not_round_on_round_bearings_in_the_turning_frame() -> None:
    """Equations in the turning frame, M x'' + 2 W G x' + (K + W^2 N) x = 0, also where the rotor is unstable."""
    rng = np.random.default_rng(52)
    grew = 0
    for _ in range(8):
        moments = np.array([rng.uniform(0.02, 0.04), *rng.uniform(0.02, 0.05, 2)])
        moments[0] = min(moments[0], 0.9 * (moments[1] + moments[2]))
        moments[1:] += max(0.0, (moments[0] - np.sum(moments[1:])))
        stations = np.array([-0.4, 0.3]) * rng.uniform(0.5, 1.0, 2)
        each = 10.0 ** rng.uniform(3.0, 4.5, 2)
        stiffness = np.stack([each, each], axis=1)
        k = supported(stations, stiffness)
        speed = float(np.sqrt(k[2, 2] / np.mean(moments[1:]))) * rng.uniform(0.3, 2.0)
        a, b, c = moments
        quarter = np.array([[0.0, -1.0], [1.0, 0.0]])
        gyroscopic = np.block([
            [2.0 * 2.0 * speed * quarter, np.zeros((2, 2))],
            [np.zeros((2, 2)), speed * (b + c - a) * quarter],
        ])  # fmt: skip
        centrifugal = speed**2 * np.diag([-2.0, -2.0, a - c, a - b])
        values, _ = quadratic(np.diag([2.0, 2.0, b, c]), gyroscopic, k + centrifugal)
        found = modes(rotor(moments, speed, bearings(stations, stiffness, np.zeros((2, 2)))), count=12)
        grew += not found.ok
        sizes = np.max(np.abs(values))
        for mode in found.modes:
            if mode.eigenvalue.imag > 0:
                shifts = [0.0] if mode.rotating else [-speed, 0.0, speed]
                seen = [mode.eigenvalue + 1j * shift for shift in shifts]
                every = np.concatenate([values, values.conj()])
                assert min(np.min(np.abs(every - one)) for one in seen) < 1e-7 * sizes
    assert 0 < grew < 8


def test_a_free_body_turns_about_its_principal_axes_as_euler_says() -> None:
    """Beside a turn W about the axis of C: W ((C - A)(C - B) / (A B))^1/2; it grows about the middle one."""
    rng = np.random.default_rng(57)
    for k in range(6):
        small, large = np.sort(rng.uniform(0.02, 0.04, 2))
        moments = np.array([small, (small + large) / 2, large])
        speed, axis = rng.uniform(10.0, 100.0), k % 3
        spin = (speed * np.eye(3)[axis]).tolist()
        glide = (rng.normal() * (k > 2) * np.eye(3)[axis]).tolist()
        body = {"kind": "rigid-body", "mass": 2.0, "inertia": moments.tolist()}
        start = {"b": {"position": [0.1, 0.2, 0.3], "spin": spin, "velocity": glide}}
        found = modes(in_space({"b": body}, start))
        c, (a, b) = moments[axis], np.delete(moments, axis)
        square = speed**2 * (c - a) * (c - b) / (a * b)
        if square < 0:
            assert found.status == "unstable"
            assert found.modes[0].eigenvalue == pytest.approx(np.sqrt(-square), rel=1e-6)
        else:
            assert found.ok, found.message
            value = next(mode for mode in found.modes if mode.eigenvalue != 0)
            shifts = [0.0] if value.rotating else [-speed, speed]
            turned = [abs(value.eigenvalue.imag + shift) for shift in shifts]
            assert min(abs(one - np.sqrt(square)) for one in turned) < 1e-6 * speed


def test_a_rod_by_modes_that_turns_is_not_answered() -> None:
    """Linear modes in a turning frame lack the centrifugal stiffening: at this speed they would call it unstable."""
    ground = {"body": "ground", "point": [0.0, 0.0]}
    rod = {"kind": "rod", "length": 1.0, "height": 0.02, "width": 0.02, "density": 2700.0, "youngs_modulus": 7e10,
           "element": "modal", "modes": 4}  # fmt: skip
    scene = Scene.parse({"name": "blade", "gravity": [0.0, 0.0], "bodies": {"b": rod},
                         "joints": {"O": {"first": ground, "second": {"body": "b"}}},
                         "initial": {"b": {"rate": 350.0}},
                         "markers": {"e": {"body": "b", "point": "end"}}})  # fmt: skip
    assert modes(scene).codes[0] == "motion-left-out"


def test_a_rotor_that_is_not_round_on_bearings_that_are_not_is_refused() -> None:
    stations = np.array([-0.4, 0.3])
    uneven = bearings(stations, np.array([[1e4, 2e4], [1e4, 2e4]]), np.zeros((2, 2)))
    with pytest.raises(ComputationError, match=r"changes along the motion .* periodic in time"):
        modes(rotor([0.03, 0.02, 0.025], 50.0, uneven))


@pytest.mark.slow
def test_frequencies_are_those_in_the_motion_by_scipy() -> None:
    """Random discs on a ball, held by springs and gravity: peaks of the spectrum of Newton's and Euler's equations."""
    rng = np.random.default_rng(53)
    for _ in range(3):
        polar, diametral, speed = 0.02, rng.uniform(0.01, 0.03), rng.uniform(100.0, 300.0)
        place = np.array([rng.uniform(0.3, 0.6), 0.0, 0.0])
        anchors = np.array([[place[0], 1.0, 0.0], [place[0], 0.0, 1.0]])
        stiff = rng.uniform(500.0, 3000.0, 2)
        loads = {
            f"k{n}": {"kind": "spring", "first": {"body": "ground", "point": anchor.tolist()}, "stiffness": k,
                      "second": {"body": "rotor", "point": place.tolist()}, "length": 1.0}
            for n, (anchor, k) in enumerate(zip(anchors, stiff, strict=True))
        }  # fmt: skip
        held = {"ball": {"kind": "spherical", "first": ORIGIN, "second": {"body": "rotor"}}}
        body = {"kind": "rigid-body", "mass": 2.0, "inertia": [polar, diametral, diametral]}
        scene = in_space({"rotor": body}, {"rotor": {"spin": [speed, 0.0, 0.0]}}, loads=loads, joints=held)
        inertia = np.array([polar, diametral, diametral])

        def rates(_: float, state: Array, inertia: Array = inertia, place: Array = place, anchors: Array = anchors,
                  stiff: Array = stiff) -> Array:  # fmt: skip
            turn, spin = state[:9].reshape(3, 3), state[9:]
            ways = anchors - turn @ place
            lengths = np.linalg.norm(ways, axis=1)
            force = (stiff * (lengths - 1.0) / lengths) @ ways
            torque = turn.T @ np.cross(turn @ place, force)
            turned = turn @ np.array([[0.0, -spin[2], spin[1]], [spin[2], 0.0, -spin[0]], [-spin[1], spin[0], 0.0]])
            return np.concatenate([turned.ravel(), (torque - np.cross(spin, inertia * spin)) / inertia])

        state = np.concatenate([np.eye(3).ravel(), [speed, 1e-3, 2e-3]])
        times = np.linspace(0.0, 1.0, 1024)
        path = solve_ivp(rates, (0.0, 1.0), state, "DOP853", t_eval=times, rtol=1e-7, atol=1e-11).y[[3, 6]]
        spectrum = np.log(np.abs(np.fft.rfft(path * np.hanning(len(times)), axis=1)).sum(axis=0))
        inner = spectrum[1:-1]
        peaks = 1 + np.flatnonzero((inner > spectrum[:-2]) & (inner > spectrum[2:]) & (inner > np.max(inner) - 3.0))
        before, here, after = (spectrum[peaks + k] for k in (-1, 0, 1))
        bins = peaks + 0.5 * (before - after) / (before - 2.0 * here + after)
        found = sorted(mode.frequency for mode in modes(scene).modes if mode.frequency > 0)
        assert len(found) == 2
        assert bins / (len(times) * times[1]) == pytest.approx(found, abs=0.1)


@pytest.mark.slow
def test_tops_nutate_as_lagrange_and_routh_say() -> None:
    """Steady precessions of random tops, slow and fast; nutation from the effective potential; and sleeping tops."""
    rng = np.random.default_rng(54)
    for k in range(6):
        height, centre, polar = rng.uniform(0.1, 0.3), rng.uniform(0.02, 0.06), rng.uniform(0.01, 0.03)
        about = centre + height**2
        tilt, spin = rng.uniform(0.2, 1.2), rng.uniform(100.0, 160.0)
        root = np.sqrt((polar * spin) ** 2 - 4.0 * about * np.cos(tilt) * GRAVITY * height)
        precession = (polar * spin + (-1) ** k * root) / (2.0 * about * np.cos(tilt))
        axis = np.array([np.sin(tilt), 0.0, np.cos(tilt)])
        whole = precession * np.array([0.0, 0.0, 1.0]) + (spin - precession * np.cos(tilt)) * axis
        top = {"kind": "rigid-body", "mass": 1.0, "inertia": [centre, centre, polar],
               "centre_of_mass": [0.0, 0.0, height]}  # fmt: skip
        held = {"ball": {"kind": "spherical", "first": ORIGIN, "second": {"body": "top"}}}
        start = {"rotation": Rotation.from_euler("y", tilt).as_rotvec().tolist(), "spin": whole.tolist()}
        found = modes(in_space({"top": top}, {"top": start}, GRAVITY, joints=held))
        assert found.ok, found.message
        # theta'' = -dV/dtheta with the momenta about the vertical and the axis kept; its second derivative in theta.
        p, n = about * precession * np.sin(tilt) ** 2 + polar * spin * np.cos(tilt), polar * spin
        x = np.cos(tilt)
        u, du, ddu = p - n * x, n * np.sin(tilt), n * x
        s, ds, dds = np.sin(tilt) ** 2, 2.0 * np.sin(tilt) * x, 2.0 * np.cos(2.0 * tilt)
        bent = (2.0 * (du**2 + u * ddu) / s - 4.0 * u * du * ds / s**2 + u**2 * (2.0 * ds**2 / s**3 - dds / s**2)) / (
            2.0 * about
        ) - GRAVITY * height * x
        (mode,) = [mode for mode in found.modes if mode.eigenvalue != 0]
        # Where the precession is fast, nearly all of the mode is one frequency at rest.
        turned = abs(mode.eigenvalue.imag + np.array([0.0] if mode.rotating else [-precession, precession]))
        assert np.min(np.abs(turned - np.sqrt(bent / about))) < 1e-6 * precession
        assert found.speed == pytest.approx(np.linalg.norm(whole), rel=1e-12)
        # Upright it sleeps above the critical spin and grows below.
        for factor in (1.3, 0.7):
            fast = factor * 2.0 * np.sqrt(about * GRAVITY * height) / polar
            upright = modes(in_space({"top": top}, {"top": {"spin": [0.0, 0.0, fast]}}, GRAVITY, joints=held))
            roots = np.roots([about, -1j * polar * fast, -GRAVITY * height])
            assert upright.status == ("ok" if factor > 1 else "unstable")
            growth = max(mode.eigenvalue.real for mode in upright.modes)
            assert growth == pytest.approx(max(roots.real), rel=1e-6, abs=1e-6)
            if factor > 1:
                matched(oscillating(upright), 1j * np.abs(roots.imag), fast)


def test_conical_pendulums_keep_to_their_circle() -> None:
    """Points and slender rods: at a tilt t their precession W has the frequency W (1 + 3 cos^2 t)^(1/2) beside it."""
    rng = np.random.default_rng(55)
    for _ in range(4):
        length, tilt = rng.uniform(0.3, 2.0), rng.uniform(0.3, 1.3)
        precession = np.sqrt(GRAVITY / (length * np.cos(tilt)))
        place = [length * np.sin(tilt), 0.0, -length * np.cos(tilt)]
        bob = {"m": {"kind": "point-mass", "mass": 1.3}}
        string = {"s": {"kind": "distance", "first": ORIGIN, "second": {"body": "m"}}}
        start = {"m": {"position": place, "velocity": [0.0, precession * place[0], 0.0]}}
        found = modes(in_space(bob, start, GRAVITY, joints=string), about="start")
        (value,) = oscillating(found)
        assert value == pytest.approx(1j * precession * np.sqrt(1 + 3 * np.cos(tilt) ** 2), rel=1e-7)
        assert [mode.frame for mode in found.modes] == ["rotating", "rotating"]
        # Faster or slower it moves up or down.
        start["m"]["velocity"] = [0.0, 1.1 * precession * place[0], 0.0]
        faster = modes(in_space(bob, start, GRAVITY, joints=string))
        assert faster.status == "moving"
        assert faster.codes[0] == "motion-left-out"


WRIGHT = {0: (3.5160, 22.0345), 3: (4.7973, 23.3203), 6: (7.3604, 26.8091), 12: (13.1702, 37.6031)}
"""First flapping frequencies of a rotating cantilever without a hub radius, over (EI/mu)^1/2/L^2, by its speed: Wright,
Smith, Thresher and Wang, Vibration modes of centrifugally stiffened beams, J. Applied Mechanics 49 (1982), table 1."""


@pytest.mark.parametrize("speed", WRIGHT)
@pytest.mark.by_day(1)
def test_rotating_blades_flap_as_in_the_tables_and_lag_as_southwell_says(speed: int) -> None:
    side, density, modulus = 0.02, 2700.0, 7e10
    unit = np.sqrt(modulus * side**2 / 12 / density)
    blade = {"kind": "rod", "length": 1.0, "height": side, "width": side, "density": density, "youngs_modulus": modulus,
             "element": "ancf-cable", "elements": 8}  # fmt: skip
    hub = {"kind": "rigid-body", "mass": 1.0, "inertia": 1.0}
    rate = max(speed * unit, 1e-3)
    joints = {
        "shaft": {"kind": "revolute", "first": ORIGIN, "second": {"body": "hub"}, "axis": [0.0, 0.0, 1.0]},
        "drive": {"kind": "driven-angle", "first": ORIGIN, "second": {"body": "hub"},
                  "angle": f"{float(rate)!r}*t", "axis": [0.0, 0.0, 1.0]},
        "root": {"kind": "weld", "first": {"body": "hub"}, "second": {"body": "blade"}},
    }  # fmt: skip
    start = {name: {"spin": [0.0, 0.0, rate]} for name in ("hub", "blade")}
    found = modes(in_space({"hub": hub, "blade": blade}, start, joints=joints), count=4)
    assert found.ok, found.message
    expected = sorted([*(flap * unit for flap in WRIGHT[speed]),
                       *(np.sqrt(flap**2 - speed**2) * unit for flap in WRIGHT[speed])])  # fmt: skip
    # The rod stretches, by up to a quarter of a percent.
    np.testing.assert_allclose(np.sort(oscillating(found).imag), expected, rtol=6e-3 if speed == 12 else 2e-3)
    if speed > 0:
        assert {mode.frame for mode in found.modes} == {"fixed", "rotating"}


def test_damping_that_turns_with_the_rotor_makes_it_whirl_above_its_critical_speed() -> None:
    """A point in the plane on springs and dampers of a driven hub: s^2 + c (s - i W) + k = 0 in a frame at rest."""
    rng = np.random.default_rng(56)
    for factor in (0.5, 0.9, 1.1, 2.0):
        mass, stiffness, damping = rng.uniform(0.5, 2.0), rng.uniform(1e3, 1e4), rng.uniform(1.0, 10.0)
        speed = factor * np.sqrt(2.0 * stiffness / mass)
        loads = {
            f"s{k}": {"kind": "spring", "first": {"body": "hub", "point": place}, "second": {"body": "m"},
                      "stiffness": stiffness, "damping": damping}
            for k, place in enumerate(([1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]))
        }  # fmt: skip
        ground = {"body": "ground", "point": [0.0, 0.0]}
        scene = Scene.parse({
            "name": "hub", "gravity": [0.0, 0.0], "loads": loads, "markers": {"m": {"body": "m"}},
            "bodies": {"hub": {"kind": "rigid-body", "mass": 1.0, "inertia": 1.0},
                       "m": {"kind": "point-mass", "mass": mass}},
            "joints": {"O": {"first": ground, "second": {"body": "hub"}},
                       "D": {"kind": "driven-angle", "first": ground, "second": {"body": "hub"},
                             "angle": f"{float(speed)!r}*t"}},
            "initial": {"hub": {"position": [0.0, 0.0], "rate": speed}, "m": {"position": [0.0, 0.0]}},
        })  # fmt: skip
        found = modes(scene)
        roots = np.roots([mass, 2.0 * damping, 2.0 * stiffness - 2j * damping * speed])
        expected = np.where(roots.imag < 0, roots.conj(), roots)
        values = np.array([mode.eigenvalue for mode in found.modes])
        matched(values, expected, speed)
        assert [mode.whirl for mode in sorted(found.modes, key=lambda one: -one.eigenvalue.real)] == [
            "forward", "backward"
        ]  # fmt: skip
        assert found.status == ("unstable" if factor > 1 else "ok")


def test_an_unbalanced_rotor_runs_off_its_centre_at_its_speed() -> None:
    """A disc in the plane whose centre of mass is off by e: it runs at r = W^2 e / (w^2 - W^2) from the bearing."""
    for factor in (0.5, 2.0):
        mass, stiffness, offset = 2.0, 5e3, 1e-3
        natural = np.sqrt(2.0 * stiffness / mass)
        speed = factor * natural
        ground = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]]
        loads = {f"s{k}": {"kind": "spring", "first": {"body": "ground", "point": place}, "second": {"body": "disc"},
                           "stiffness": stiffness} for k, place in enumerate(ground)}  # fmt: skip
        disc = {"kind": "rigid-body", "mass": mass, "inertia": 0.1, "centre_of_mass": [offset, 0.0]}
        scene = Scene.parse({"name": "disc", "gravity": [0.0, 0.0], "bodies": {"disc": disc}, "loads": loads,
                             "markers": {"bearing": {"body": "disc"}},
                             "initial": {"disc": {"position": [0.0, 0.0], "rate": speed}}})  # fmt: skip
        found = modes(scene)
        runs = abs(speed**2 * offset / (natural**2 - speed**2))
        assert found.findings[found.codes.index("steady-elsewhere")].numbers["distance"] == pytest.approx(
            runs, rel=0.05
        )
        values = [mode.eigenvalue.imag for mode in found.modes if mode.whirl]
        assert values == pytest.approx([natural, natural], rel=1e-4)


def test_a_light_shaft_with_an_overhung_disc_is_stodolas_rotor() -> None:
    """Flexible shaft on a hinged hub, free to turn: M z'' - i W G z' + K z = 0 with the flexibility of a cantilever."""
    side, length, mass, polar, diametral, modulus = 0.01, 0.4, 1.0, 0.004, 0.002, 2e11
    bend = modulus * side**4 / 12
    stiffness = bend * np.array([[12 / length**3, -6 / length**2], [-6 / length**2, 4 / length]])
    shaft = {"kind": "rod", "length": length, "height": side, "width": side, "density": 0.1, "youngs_modulus": modulus,
             "element": "director-rod", "elements": 3}  # fmt: skip
    bodies = {"hub": {"kind": "rigid-body", "mass": 1.0, "inertia": 0.01}, "shaft": shaft,
              "disc": {"kind": "rigid-body", "mass": mass, "inertia": [polar, diametral, diametral]}}  # fmt: skip
    joints = {
        "bearing": {"kind": "revolute", "first": ORIGIN, "second": {"body": "hub"}, "axis": [1.0, 0.0, 0.0]},
        "root": {"kind": "weld", "first": {"body": "hub"}, "second": {"body": "shaft"}},
        "seat": {"kind": "weld", "first": {"body": "shaft", "point": "end"}, "second": {"body": "disc"}},
    }
    scene = in_space(bodies, {name: {"spin": [1.0, 0.0, 0.0]} for name in bodies}, joints=joints)
    diagram = campbell(scene, [200.0, 800.0], count=6)
    assert diagram.ok
    for speed, found in zip(diagram.speeds, diagram.modes, strict=True):
        inertia, turning = np.diag([mass, diametral]), np.diag([0.0, polar * speed])
        linear = np.block([[np.zeros((2, 2)), np.eye(2)],
                           [-np.linalg.solve(inertia, stiffness), 1j * np.linalg.solve(inertia, turning)]])  # fmt: skip
        expected = np.linalg.eigvals(linear).imag
        assert found is not None
        told = [(1 if mode.whirl == "forward" else -1) * mode.eigenvalue.imag for mode in found.modes if mode.whirl]
        assert sorted(told) == pytest.approx(sorted(expected), rel=1e-4)


@pytest.mark.slow
def test_a_campbell_diagram_finds_the_critical_speed() -> None:
    """A disc on a ball and round springs: w^2 Id - w Ip W - k = 0 meets w = W at (k / (Id - Ip))^1/2."""
    polar, diametral, stiffness = 0.01, 0.03, 2e3
    loads = bearings(np.array([0.5]), np.full((1, 2), stiffness), np.zeros((1, 2)))
    held = {"ball": {"kind": "spherical", "first": ORIGIN, "second": {"body": "rotor"}}}
    body = {"kind": "rigid-body", "mass": 2.0, "inertia": [polar, diametral, diametral]}
    scene = in_space({"rotor": body}, {"rotor": {"spin": [-3.0, 0.0, 0.0]}}, loads=loads, joints=held)
    diagram = campbell(scene, np.linspace(0.0, 300.0, 16))
    critical = np.sqrt(stiffness * 0.25 / (diametral - polar))
    assert diagram.ok
    assert diagram.critical_speeds == pytest.approx([critical], rel=1e-2)
    for speed, found in zip(diagram.speeds[1:], diagram.modes[1:], strict=True):
        assert found is not None
        roots = np.roots([diametral, -polar * speed, -stiffness * 0.25])
        whirls = {mode.whirl: mode.eigenvalue.imag for mode in found.modes if mode.whirl}
        assert whirls == pytest.approx({"forward": max(roots), "backward": -min(roots)}, rel=1e-7)
    assert [mode.whirl for mode in diagram.modes[0].modes] == [""] * 3 if diagram.modes[0] else False
    table = diagram.to_pandas()
    assert list(table.index.names) == ["speed", "mode"]
    assert len(table) == 16 * 3


@pytest.mark.parametrize("name", ["single-pendulum", "rigid-double-pendulum", "flexible-double-pendulum"])
@pytest.mark.by_day(1)
def test_what_swings_has_no_steady_motion(name: str) -> None:
    scene = load_scene(name)
    moving = scene.with_values({f"initial.{body}.rate": 1.0 for body in scene.bodies})
    found = modes(moving)
    assert (found.status, found.ok) == ("moving", False)
    assert re.search(
        r"residual acceleration of \w+ is up to [\d.]+ m/s\^2 .*; these modes are those at rest", found.message
    )
    diagram = campbell(moving, [0.0, 1.0])
    assert [one is None for one in diagram.modes] == [False, True]
    assert diagram.codes == ["no-steady-motion"]
    for at_rest in (found, diagram.modes[0]):
        assert at_rest is not None
        assert [mode.eigenvalue for mode in at_rest.modes] == [mode.eigenvalue for mode in modes(scene).modes]


def test_speeds_need_something_that_turns_and_no_drive() -> None:
    with pytest.raises(InputError, match=r"speeds: nothing turns at the start; .*initial\.OA\.rate"):
        campbell(load_scene("single-pendulum"), [1.0])
    with pytest.raises(InputError, match="speeds: give speeds of at least 0 rad/s, found -1"):
        campbell(load_scene("single-pendulum"), [-1.0])
