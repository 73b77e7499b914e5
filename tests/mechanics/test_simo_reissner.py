"""Simo and Reissner's rod: derivatives, Timoshenko's closed forms, an arc, cantilevers by Reissner's equations."""

from __future__ import annotations

import math
from typing import Any

import element_doors as doors
import numpy as np
import pytest
from reissner import end_of_cantilever
from scipy.optimize import brentq
from shoal.mechanics.analysis.modes import modes
from shoal.mechanics.analysis.statics import statics
from shoal.mechanics.dynamics import ELEMENT_ROOM
from shoal.mechanics.elements import families, simo_reissner
from shoal.mechanics.elements.beam import CUBIC, mass_matrix
from shoal.mechanics.numerics.tile import SINGLE, packed
from shoal.scene import Scene
from shoal.scene.sections import Rectangle

YOUNG, SHEARING, AREA, MOMENT, LENGTH, ETA = 2e6, 6e2, 1e-3, 1e-6, 0.4, 0.01
FREE = [0.01, 0.0, -0.02, 0.0, 0.03, 0.0, 0.2, 0.3]
E, NU, RHO, L, H, B = 2.1e11, 0.3, 7850.0, 2.0, 0.4, 0.1
G, K = E / (2 * (1 + NU)), 10 * (1 + NU) / (12 + 11 * NU)
AXIAL, SHEAR, BENDING = E * B * H, K * G * B * H, E * B * H**3 / 12


def _elements(count: int) -> Any:
    found = families.Collected()
    for number in range(count):
        part = simo_reissner.entry(YOUNG, SHEARING, AREA, MOMENT, LENGTH, FREE, ETA)
        found.add("rod", [*range(12 * number, 12 * (number + 1))], part)
    return packed(found.family(simo_reissner.ShearRods), slice(0, 1), SINGLE)


def _energy(z: Any) -> float:
    out = np.zeros(1)
    doors.energy(SINGLE, _elements(z.size // 12), z.ravel().copy(), np.zeros(ELEMENT_ROOM), out)
    return float(out[0])


def _force(z: Any, rate: Any) -> tuple[Any, float]:
    f, power = np.zeros(z.size), np.zeros(1)
    room = np.zeros(ELEMENT_ROOM)
    doors.force(SINGLE, _elements(z.size // 12), z.ravel().copy(), rate.ravel().copy(), f, room, power)
    return f.reshape(z.shape), float(power[0])


def _matrix(z: Any, *, viscous: bool) -> Any:
    out = np.zeros(144)
    doors.matrix(SINGLE, _elements(1), viscous, z.ravel().copy(), np.zeros(ELEMENT_ROOM), out)
    return out.reshape(12, 12)


def _state(seed: int, length: float = LENGTH) -> Any:
    """r, r' and d of both nodes of an element that is bent, stretched and sheared, and pressed to a length [m]."""
    rng = np.random.default_rng(seed)
    nodes = []
    for node in range(2):
        normal = np.array([1.0, 0.0]) + rng.uniform(-0.3, 0.3, 2)
        along = length / LENGTH * normal
        nodes += [
            np.array([length * node, 0.0]) + rng.uniform(-0.02, 0.02, 2),
            along,
            normal + rng.uniform(-0.2, 0.2, 2),
        ]
    return np.array(nodes)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "length"), [(0, LENGTH), (1, LENGTH), (2, LENGTH), (3, 0.5 * LENGTH), (4, 0.1 * LENGTH)]
)
def test_force_stiffness_and_damping_are_derivatives_and_turn_with_the_rod(seed: int, length: float) -> None:
    z, rate, still = _state(seed, length), np.random.default_rng(seed + 9).normal(size=(6, 2)), np.zeros((6, 2))
    force, lost = _force(z, still)
    assert lost == 0
    gradient = doors.differences(_energy, z.ravel(), 1e-3)
    np.testing.assert_allclose(force.ravel(), -gradient, atol=1e-7 * np.abs(force).max())
    stiffness = _matrix(z, viscous=False)
    columns = doors.differences(lambda at: -_force(at.reshape(6, 2), still)[0].ravel(), z.ravel(), 1e-3)
    np.testing.assert_allclose(stiffness, columns, atol=1e-7 * np.abs(stiffness).max())
    damped, lost = _force(z, rate)
    viscosity = _matrix(z, viscous=True)
    np.testing.assert_allclose(damped - force, -(viscosity @ rate.ravel()).reshape(6, 2), rtol=1e-9)
    assert lost == pytest.approx(-np.sum((damped - force) * rate), rel=1e-10)
    turn = np.array([[math.cos(2.0), -math.sin(2.0)], [math.sin(2.0), math.cos(2.0)]])
    other, power = _force(z @ turn.T, rate @ turn.T)
    np.testing.assert_allclose(other, damped @ turn.T, atol=1e-11 * np.abs(damped).max())
    assert power == pytest.approx(lost, rel=1e-11)
    assert np.abs(damped[0] + damped[3]).max() < 1e-12 * np.abs(damped).max()
    assert abs(np.sum(z[:, 0] * damped[:, 1] - z[:, 1] * damped[:, 0])) < 1e-12 * np.abs(damped).max()
    many, _ = _force(np.array([z, _state(7)] * 5), np.array([rate, rate] * 5))
    np.testing.assert_allclose(many[8], damped, atol=1e-12 * np.abs(damped).max())


def test_the_mass_is_that_of_a_rigid_bar_and_of_the_cable() -> None:
    section = Rectangle(0.1, 0.05)
    mass = np.array(simo_reissner.ELEMENT.mass(RHO, section, LENGTH))
    per_length = RHO * section.area
    turning = np.array([0.0, 1.0, 1.0, LENGTH, 1.0, 1.0])
    inertia = per_length * LENGTH**3 / 3 + RHO * section.bending * LENGTH
    assert turning @ mass @ turning == pytest.approx(inertia, rel=1e-13)
    cable = [0, 1, 3, 4]
    thin = np.array(simo_reissner.ELEMENT.mass(RHO, Rectangle(1e-9, 5e6), LENGTH))[np.ix_(cable, cable)]
    np.testing.assert_allclose(thin, mass_matrix(CUBIC, per_length, LENGTH), rtol=1e-12)


def rod(elements: int, **more: Any) -> dict[str, Any]:
    return {"kind": "rod", "length": L, "height": H, "width": B, "density": RHO, "youngs_modulus": E,
            "poisson_ratio": NU, "element": "simo-reissner", "elements": elements} | more  # fmt: skip


def cantilever(elements: int, force: Any = (0.0, 0.0), torque: float = 0.0, **more: Any) -> Scene:
    end = {"body": "B", "point": "end"}
    return Scene.parse({
        "name": "cantilever", "gravity": [0, 0], "bodies": {"B": rod(elements, **more)},
        "joints": {"W": {"kind": "weld", "first": {"body": "ground", "point": [0, 0]}, "second": {"body": "B"}}},
        "loads": {"P": {"kind": "force", "at": end, "force": list(force)},
                  "M": {"kind": "torque", "at": end, "torque": torque}},
        "markers": {"e": end},
    })  # fmt: skip


def test_small_loads_on_one_element_bend_it_as_timoshenko_says() -> None:
    found = statics(cantilever(1, (0.0, -100.0)))
    assert found.marker("e")[1] == pytest.approx(-100.0 * (L**3 / (3 * BENDING) + L / SHEAR), rel=1e-8)


def timoshenko(count: int) -> list[float]:
    """Frequencies of a cantilever with shear and rotary inertia [Hz], from the boundary conditions of its waves."""

    def determinant(w: float) -> float:
        # (w, psi) ~ exp(k x): rho A w^2 W = kGA (psi - W')' and EI psi'' + kGA (W' - psi) + rho I w^2 psi = 0.
        m, j = RHO * B * H * w**2, RHO * B * H**3 / 12 * w**2
        k = np.sqrt(np.roots([BENDING * SHEAR, BENDING * m + SHEAR * j, m * (j - SHEAR)]).astype(complex))
        k = np.concatenate([k, -k])
        psi = (m + SHEAR * k**2) / (SHEAR * k)
        rows = np.array([1 + 0 * k, psi, psi * k * np.exp(k * L), (k - psi) * np.exp(k * L)])
        d = np.linalg.det(rows / np.abs(rows).max(axis=1)[:, None])
        return float(d.real if abs(d.real) > abs(d.imag) else d.imag)

    grid = 2 * np.pi * np.linspace(5.0, 1500.0, 3000)
    values = np.array([determinant(w) for w in grid])
    roots = [brentq(determinant, a, b) for a, b, u, v in zip(grid, grid[1:], values, values[1:], strict=False)
             if u * v < 0]  # fmt: skip
    return [w / (2 * np.pi) for w in roots[:count]]


def test_frequencies_are_timoshenkos_with_the_fourth_order() -> None:
    exact = np.array(timoshenko(3))
    errors = []
    for elements in (4, 8):
        found = np.array([mode.frequency for mode in modes(cantilever(elements), count=6).modes])
        errors.append([np.min(np.abs(found / one - 1)) for one in exact])
    assert errors[1][0] < 5e-6
    assert errors[1][2] < 1e-3
    assert np.all(np.log2(np.array(errors[0]) / np.array(errors[1])) > 3.5)


@pytest.mark.slow
def test_kelvin_voigt_damps_a_mode_by_half_its_angular_frequency_times_the_retardation() -> None:
    for mode in modes(cantilever(4, retardation=1e-6), count=3).modes:
        assert mode.damping_ratio == pytest.approx(0.5e-6 * mode.angular_frequency, rel=1e-6)


def test_a_moment_bends_the_rod_to_an_arc() -> None:
    """No force, so no shear: a circle of radius EI/M, and the axis is as long as it was."""
    turn = 2.0
    stiffness = E * B * 0.05**3 / 12
    found = statics(cantilever(16, torque=turn * stiffness / L, height=0.05))
    assert found.ok
    np.testing.assert_allclose(
        found.marker("e"), [L * math.sin(turn) / turn, L * (1 - math.cos(turn)) / turn], atol=1e-5
    )


@pytest.mark.parametrize("height", [0.1, 0.5])
def test_shear_cantilevers_under_large_loads_meet_reissners_equations(height: float) -> None:
    """The load of Gerstmayr, Matikainen and Mikkola (2008), 5e8 h^3, on L = 2 m."""
    force = 5e8 * height**3
    exact = end_of_cantilever(-force, L, E, height, B, NU)
    errors = []
    for elements in (4, 8, 16):
        found = statics(cantilever(elements, (0.0, -force), height=height))
        assert found.ok
        errors.append(np.abs(found.marker("e") - exact).max())
    assert errors[-1] < 1e-5
    assert np.log2(errors[0] / errors[1]) > 3.0
