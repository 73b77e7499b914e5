"""Figures in space that others published or that have closed forms: gyroscopes, linkages, frames, springs, shafts."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation
from shoal.mechanics.analysis.modes import modes
from shoal.mechanics.analysis.settled import settled
from shoal.mechanics.analysis.statics import statics
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene

ORIGIN = {"body": "ground", "point": [0.0, 0.0, 0.0]}


def scene(**parts: Any) -> Scene:
    return Scene.parse({"name": "figure", "dimensions": 3, "gravity": [0.0, 0.0, 0.0], **parts})


def at(body: str, point: Any = "start") -> dict[str, Any]:
    return {"body": body, "point": point}


def joint(kind: str, first: Any, second: Any, **more: Any) -> dict[str, Any]:
    return {"kind": kind, "first": first, "second": second, **more}


def rod(elements: int, **more: Any) -> dict[str, Any]:
    return {"kind": "rod", "element": "director-rod", "elements": elements, "density": 1.0, "poisson_ratio": 0.3} | more


def clamped(body: dict[str, Any], force: Any) -> Scene:
    """A rod that the ground holds at its start, along x, loaded at its end."""
    return scene(bodies={"rod": body}, joints={"foot": joint("weld", ORIGIN, at("rod"))},
                 loads={"P": {"kind": "force", "at": at("rod", "end"), "force": list(force)}},
                 markers={"tip": at("rod", "end")})  # fmt: skip


# --- rigid machines


def test_a_gyroscope_in_two_gimbals_moves_as_lagrange_says() -> None:
    """A rotor off its suspension's centre; gimbals with inertia of their own (Arnold and Maunder, Gyrodynamics)."""
    frame, a, b, c, across, along, mass, off = 0.02, 0.004, 0.005, 0.006, 0.01, 0.018, 0.8, 0.05
    tilt, spin = 0.3, 120.0
    axis = [0.0, math.cos(tilt), math.sin(tilt)]
    turned, fast = {"rotation": [tilt, 0.0, 0.0]}, {"spin": [spin * part for part in axis]}
    machine = scene(
        gravity=[0.0, 0.0, -9.81],
        bodies={
            "outer": {"kind": "rigid-body", "mass": 1.0, "inertia": [0.02, 0.02, frame]},
            "inner": {"kind": "rigid-body", "mass": 0.5, "inertia": [a, b, c]},
            "rotor": {"kind": "rigid-body", "mass": mass, "inertia": [across, along, across],
                      "centre_of_mass": [0.0, off, 0.0], "named_points": {"tip": [0.0, 1.0, 0.0]}},
        },
        joints={"yaw": joint("revolute", ORIGIN, at("outer"), axis=[0, 0, 1]),
                "pitch": joint("revolute", at("outer"), at("inner"), axis=[1, 0, 0]),
                "spin": joint("revolute", at("inner"), at("rotor"), axis=axis)},
        markers={"tip": at("rotor", "tip")},
        initial={"outer": {"spin": [0, 0, 0]}, "inner": turned, "rotor": turned | fast},
    )  # fmt: skip
    whole, momentum = across + mass * off**2, along * spin

    def rate(_: float, y: Any) -> Any:
        sine, cosine = math.sin(y[1]), math.cos(y[1])
        about = frame + b * sine**2 + (c + whole) * cosine**2
        yaw = momentum * (math.sin(tilt) - sine) / about
        pull = yaw**2 * sine * cosine * (b - c - whole) + momentum * yaw * cosine - mass * 9.81 * off * cosine
        return [yaw, y[2], pull / (a + whole)]

    times = [0.1, 0.5, 2.0]
    exact = solve_ivp(rate, (0, 2), [0, tilt, 0], "DOP853", t_eval=times, rtol=1e-12, atol=1e-13).y
    yaw, pitch = exact[0], exact[1]
    tip = np.stack([-np.sin(yaw) * np.cos(pitch), np.cos(yaw) * np.cos(pitch), np.sin(pitch)], axis=1)
    found = simulate(machine, np.array(times))
    assert found.ok
    assert found.marker("tip") == pytest.approx(tip, abs=1e-9)


def test_a_driven_rssr_linkage_turns_as_its_closure_says_and_nothing_of_it_is_redundant() -> None:
    """|B(out) - A(in)| is the coupler's length (Denavit and Hartenberg 1955)."""
    crank, rocker, coupler, base = 0.2, 0.5, 0.9, np.array([0.1, 0.7, 0.3])

    def tip(angle: float) -> Any:
        return base + rocker * np.array([0.0, math.cos(angle), math.sin(angle)])

    def gap(angle: float, turn: float) -> float:
        return float(np.linalg.norm(tip(angle) - crank * np.array([math.cos(turn), math.sin(turn), 0.0])) - coupler)

    begin = brentq(gap, 1.5, 2.5, args=(0.0,))
    bar = {"kind": "rod", "height": 0.01, "width": 0.01, "density": 7850.0}
    machine = scene(
        gravity=[0.0, 0.0, -9.81],
        bodies={"crank": bar | {"length": crank}, "coupler": bar | {"length": coupler},
                "rocker": {"kind": "rigid-body", "mass": 0.5, "inertia": [0.02, 0.001, 0.02],
                           "named_points": {"tip": [0.0, rocker, 0.0]}}},
        joints={"in": joint("revolute", ORIGIN, at("crank"), axis=[0, 0, 1]),
                "A": joint("spherical", at("crank", "end"), at("coupler")),
                "B": joint("spherical", at("coupler", "end"), at("rocker", "tip")),
                "out": joint("revolute", at("ground", base.tolist()), at("rocker"), axis=[1, 0, 0]),
                "drive": joint("driven-angle", ORIGIN, at("crank"), axis=[0, 0, 1], angle="6*t")},
        markers={"tip": at("rocker", "tip")},
        initial={"crank": {"angle": 0.0}, "rocker": {"rotation": [begin, 0.0, 0.0]}},
    )  # fmt: skip
    times = np.linspace(0.0, 1.0, 51)
    angles = [begin]
    for t in times[1:]:
        angles.append(brentq(gap, angles[-1] - 0.2, angles[-1] + 0.2, args=(6 * t,), xtol=1e-14))
    found = simulate(machine, times)
    assert found.ok
    assert found.marker("tip") == pytest.approx(np.array([tip(angle) for angle in angles]), abs=1e-10)
    assert found.model["redundant_joints"] == []


# --- flexible rods


def test_macneal_and_harders_twisted_beam_bends_as_published() -> None:
    """A right angle of twist; 0.005424 in the load's direction, with shear (MacNeal and Harder 1985, table 9)."""
    beam = rod(4, length=12.0, height=0.32, width=1.1, youngs_modulus=29e6, poisson_ratio=0.22,
               twist=[math.pi / 24])  # fmt: skip
    found = [settled(clamped(beam, force), 1e-5) for force in ((0, 1, 0), (0, 0, 1))]
    assert all(one.ok for one in found)
    assert found[0].marker("tip")[1] == pytest.approx(0.005424, rel=1e-3)
    assert found[1].marker("tip")[2] == pytest.approx(0.001754, rel=6e-3)  # the stout way: 0.5 % of it is shear


@pytest.mark.slow
@pytest.mark.parametrize(
    ("load", "tip"), [(300, (58.84, 22.33, 40.08)), (450, (52.32, 18.62, 48.39)), (600, (47.23, 15.79, 53.37))]
)
def test_the_bend_of_45_degrees_ends_as_published(load: float, tip: Any) -> None:
    """Bathe and Bolourchi 1979; the digits are those of Simo and Vu-Quoc 1986, on eight linear elements."""
    bend = rod(4, length=25 * math.pi, height=1.0, width=1.0, youngs_modulus=1e7, poisson_ratio=0.0,
               curvature=[0.01], torsion_constant=1 / 6)  # fmt: skip
    found = settled(clamped(bend, (0, 0, load)), 1e-2)
    assert found.ok
    assert found.marker("tip") == pytest.approx(tip, abs=0.13)


def frame(load: float, elements: int = 8) -> Scene:
    """Two strips at a right angle, loaded along the first at the end of the second [N]."""
    strip = rod(elements, length=0.24, height=0.03, width=0.0006, density=2700.0, youngs_modulus=71.24e9,
                poisson_ratio=0.31)  # fmt: skip
    return scene(
        bodies={"leg": strip, "arm": strip},
        joints={"foot": joint("weld", ORIGIN, at("leg")), "corner": joint("weld", at("leg", "end"), at("arm"))},
        loads={"P": {"kind": "force", "at": at("arm", "end"), "force": [load, 0.0, 0.0]}},
        markers={"tip": at("arm", "end")}, initial={"arm": {"angle": -math.pi / 2}},
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("critical", [1.088, -0.68])
def test_a_right_angled_frame_buckles_out_of_its_plane_at_the_published_load(critical: float) -> None:
    """Argyris et al. 1979 and Simo and Vu-Quoc 1986: 1.088 N, and 0.68 N the other way."""
    below, above = (statics(frame(share * critical), leave_unstable=False) for share in (0.99, 1.01))
    assert below.ok
    assert above.balanced
    assert not above.ok


@pytest.mark.slow
def test_a_frame_buckles_to_the_same_side_on_every_mesh() -> None:
    coarse, fine = (statics(frame(1.3, elements)).marker("tip") for elements in (4, 8))
    assert coarse[2] > 0.03
    assert fine == pytest.approx(coarse, abs=2e-3)


@pytest.mark.slow
def test_a_clamped_shaft_buckles_under_torque_as_greenhill_says() -> None:
    """M L/EI = 8.9868 for ends that keep their direction (Greenhill 1883; Timoshenko and Gere, Stability, 2.21)."""
    bending = 2e11 * math.pi * 0.01**4 / 64
    for share in (0.98, 1.02):
        shaft = rod(16, length=1.0, height=0.01, section="round", density=7850.0, youngs_modulus=2e11)
        found = statics(scene(
            bodies={"shaft": shaft, "head": {"kind": "rigid-body", "mass": 0.1, "inertia": 1e-4}},
            joints={"foot": joint("weld", ORIGIN, at("shaft")), "end": joint("weld", at("shaft", "end"), at("head")),
                    "guide": joint("cylindrical", at("ground", [1.0, 0.0, 0.0]), at("head"), axis=[1, 0, 0])},
            loads={"T": {"kind": "torque", "at": at("head"), "axis": [1, 0, 0], "torque": share * 8.9868 * bending}},
            markers={"middle": at("shaft", "centre")},
        ))  # fmt: skip
        assert found.ok == (share < 1)
        assert found.balanced


@pytest.mark.slow
def test_a_helical_spring_is_as_stiff_as_its_wire_says() -> None:
    """Its plate guided along the axis; the stiffness is that of the wire's compliances, integrated along the helix."""
    radius, pitch, turns, wire = 0.01, math.radians(8), 5, 0.002
    c, s = math.cos(pitch), math.sin(pitch)
    length, young = 2 * math.pi * radius * turns / c, 2.06e11
    bending, twisting = young * math.pi * wire**4 / 64, young / 2.6 * math.pi * wire**4 / 32
    points, weights = np.polynomial.legendre.leggauss(200)
    compliance = np.zeros((6, 6))
    for here, weight in zip((points + 1) / 2 * length, weights * length / 2, strict=True):
        angle = here * c / radius
        tangent = np.array([-math.sin(angle) * c, math.cos(angle) * c, s])
        x, y, z = -radius * math.cos(angle), -radius * math.sin(angle), (length - here) * s
        arms = np.hstack([[[0, -z, y], [z, 0, -x], [-y, x, 0]], np.eye(3)])
        along = np.outer(tangent, tangent)
        compliance += weight * arms.T @ (along / twisting + (np.eye(3) - along) / bending) @ arms
    stiffness = np.linalg.inv(compliance)[2, 2]
    axes = np.stack([[0, c, s], [-1, 0, 0], np.cross([0, c, s], [-1, 0, 0])], axis=1)
    machine = scene(
        bodies={"wire": rod(60, length=length, height=wire, section="round", density=7900.0, youngs_modulus=young,
                            curvature=[c * c / radius], twist=[s * c / radius]),
                "plate": {"kind": "rigid-body", "mass": 0.01, "inertia": 1e-6}},
        joints={"foot": joint("weld", at("ground", [radius, 0.0, 0.0]), at("wire")),
                "head": joint("weld", at("wire", "end"), at("plate", [radius, 0.0, 0.0])),
                "guide": joint("slider", ORIGIN, at("plate"), axis=[0, 0, 1], rotation="locked")},
        loads={"F": {"kind": "force", "at": at("plate"), "force": [0.0, 0.0, 0.01]}}, markers={"plate": at("plate")},
        initial={"wire": {"rotation": Rotation.from_matrix(axes).as_rotvec().tolist()},
                 "plate": {"position": [0.0, 0.0, length * s], "rotation": [0.0, 0.0, 0.0]}},
    )  # fmt: skip
    found = statics(machine)
    assert found.ok
    assert 0.01 / (found.marker("plate")[2] - length * s) == pytest.approx(stiffness, rel=5e-4)


@pytest.mark.slow
def test_a_ring_of_two_halves_rings_in_its_plane_and_out_of_it() -> None:
    """n^2 (n^2 - 1)^2/(n^2 + 1) and /(n^2 + EI/GJ) times EI/(rho A R^4) (Love, Theory of Elasticity, 293)."""
    radius, thick, young, rho = 0.5, 0.02, 7e10, 2700.0
    half = rod(16, length=math.pi * radius, height=thick, section="round", density=rho, youngs_modulus=young,
               curvature=[1 / radius])  # fmt: skip
    ring = scene(
        bodies={"one": half, "two": half},
        joints={"a": joint("weld", at("one", "end"), at("two")), "b": joint("weld", at("two", "end"), at("one"))},
        markers={"m": at("one", "centre")},
        initial={"one": {"position": [0.0, 0.0, 0.0]}, "two": {"angle": math.pi}},
    )  # fmt: skip
    found = modes(ring, about="start", count=16).frequencies
    unit = math.sqrt(young * thick**2 / (16 * rho * radius**4)) / (2 * math.pi)
    closed = [n * (n * n - 1) / math.sqrt(n * n + by) * unit for n in (2, 3) for by in (1.3, 1.0)]
    assert np.all(found[:6] < 1e-3)
    assert found[6:14] == pytest.approx(np.repeat(closed, 2), rel=2e-3)


@pytest.mark.parametrize("rotation", [[0.0, 0.0, 0.0], [0.3, -0.5, 0.7]])
def test_a_free_thin_wire_has_six_free_motions_and_the_frequencies_of_a_beam_however_it_lies(rotation: Any) -> None:
    """0.3 mm thick and 1 m long: its bending is nine orders below its stretching. cos x cosh x = 1."""
    wire = rod(24, length=1.0, height=3e-4, section="round", density=7850.0, youngs_modulus=2e11)
    lying = {"wire": {"position": [0.0, 0.0, 0.0], "rotation": rotation}}
    free = scene(bodies={"wire": wire}, markers={"m": at("wire", "end")}, initial=lying)
    found = modes(free, about="start", count=10)
    assert [mode.kind for mode in found.modes] == 6 * ["free"] + 4 * ["oscillating"]
    closed = [x**2 / (2 * math.pi) * math.sqrt(2e11 / 7850.0) * 3e-4 / 4 for x in (4.7300407, 7.8532046)]
    assert found.frequencies[6:] == pytest.approx(np.repeat(closed, 2), rel=1e-3)
