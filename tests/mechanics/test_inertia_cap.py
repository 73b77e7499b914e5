"""Raised inertia of axial vibrations: what it slows, what it leaves alone, what it costs, and that it is told."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigh
from shoal.engines.casadi import CasadiEngine
from shoal.errors import InputError
from shoal.mechanics import inertia_cap
from shoal.mechanics.assembly.build import build
from shoal.mechanics.model import Model
from shoal.mechanics.numerics import sparse
from shoal.mechanics.simulate import simulate, stable_step
from shoal.scene import Scene, load_scene

CAPPED = {"solver.integrator": "leapfrog", "solver.inertia_cap": True}
FREE = Scene.parse(
    {
        "name": "free-rod",
        "gravity": [0, 0],
        "bodies": {
            "A": {
                "kind": "rod",
                "length": 1.0,
                "height": 0.02,
                "width": 0.02,
                "density": 7800,
                "youngs_modulus": 2e9,
                "element": "ancf-quintic",
                "elements": 3,
            }
        },
        "markers": {"end": {"body": "A", "point": "end"}},
        "initial": {"A": {"position": [0, 0], "angle": 0.3, "rate": 4.0}},
        "solver": {"duration": 0.2, "step": 1e-4},
    }
)
DOUBLE = load_scene("flexible-double-pendulum")
every_element = pytest.mark.parametrize("element", ["ancf-cable", "ancf-quintic"])


def _mass(model: Model) -> Any:
    return sparse.dense(model.mass_pattern[0], model.mass_values[:, 0])


def _stretching(model: Model) -> Any:
    matrix = np.zeros((model.unknowns, model.unknowns))
    for (i, j), value in model.stretching_entries.items():
        matrix[i, j] = matrix[j, i] = float(np.max(value))
    return matrix


def _models(scene: Scene) -> tuple[Model, Model]:
    plain = build(scene)
    return plain, inertia_cap.capped(plain, plain.scene.solver.step)


@every_element
def test_fast_axial_modes_are_slowed_to_the_step_and_the_others_left_alone(element: str) -> None:
    step = 3 * stable_step(FREE.with_values({"bodies.A.element": element}), "leapfrog")
    scene = FREE.with_values({**CAPPED, "bodies.A.element": element, "solver.step": step})
    plain, capped = _models(scene)
    stiffness = _stretching(plain)
    before, after = (np.sqrt(np.abs(eigh(stiffness, _mass(model), eigvals_only=True))) for model in (plain, capped))
    cap = 2 * inertia_cap.SHARE / step
    assert 0 < capped.slowed == np.count_nonzero(before > cap) < len(before)
    np.testing.assert_allclose(np.sort(after), np.sort(np.minimum(before, cap)), rtol=1e-7, atol=1e-2)


@every_element
def test_translations_keep_their_inertia_and_rotations_gain_little(element: str) -> None:
    """Of a free rod's turn about its middle the axial modes beyond the first hold 1 - 96/pi^4 = 1.4 %."""
    step = 2 * stable_step(FREE.with_values({"bodies.A.element": element}), "leapfrog")
    plain, capped = _models(FREE.with_values({**CAPPED, "bodies.A.element": element, "solver.step": step}))
    assert capped.slowed > 0
    translation = np.zeros(plain.unknowns)
    translation[0 :: 4 if element == "ancf-cable" else 6] = 1.0
    np.testing.assert_allclose(_mass(capped) @ translation, _mass(plain) @ translation, rtol=0, atol=1e-11)
    turn = plain.v0[:, 0]
    gain = turn @ _mass(capped) @ turn / (turn @ _mass(plain) @ turn) - 1
    assert 0 < gain < 0.014 * (2 / inertia_cap.SHARE) ** 2


def test_a_spinning_rod_flies_as_a_rigid_one() -> None:
    """Its stretch, about rho w^2 L^3/(12 E) = 5e-6 m, is below what is allowed."""
    step = 2 * stable_step(FREE, "leapfrog")
    run = simulate(FREE.with_values({**CAPPED, "solver.step": step}), np.linspace(0.01, 0.2, 20))
    assert run.ok
    assert run.model["slowed_modes"] > 0
    rate, first = 4.0, np.array([np.cos(0.3), np.sin(0.3)])
    angle = 0.3 + rate * run.times
    centre = first / 2 + np.outer(run.times, rate / 2 * np.array([-first[1], first[0]]))
    expected = centre + np.stack([np.cos(angle), np.sin(angle)], axis=1) / 2
    np.testing.assert_allclose(run.marker("end"), expected, atol=1e-5)


def test_the_error_is_of_second_order_in_the_step() -> None:
    """Against CVODES on CasADi's own model of the same mesh."""
    scene = DOUBLE.with_values({"bodies.OA.elements": 2, "bodies.AB.elements": 4, "solver.duration": 0.2})
    times = np.linspace(0.05, 0.2, 4)
    exact = CasadiEngine(tolerance=1e-11).simulate(scene, times)
    stable = stable_step(scene, "leapfrog")
    errors = []
    for stride in (3.0, 1.5):
        steps = int(np.ceil(0.2 / (stride * stable)))
        run = simulate(scene.with_values({**CAPPED, "solver.step": 0.2 / steps}), times)
        assert run.ok
        assert run.model["slowed_modes"] > 0
        errors.append(run.distance(exact))
    assert errors[0] < 0.01
    assert np.log2(errors[0] / errors[1]) > 1.5


def test_only_leapfrog_raises_inertia_and_only_where_the_step_needs_it() -> None:
    times = np.linspace(0.01, 0.05, 5)
    step = 0.5 * stable_step(DOUBLE, "leapfrog")
    for integrator in ("leapfrog", "rk4", "generalized-alpha", "auto"):
        settings = {"solver.integrator": integrator, "solver.step": step}
        plain, capped = (simulate(DOUBLE.with_values({**settings, "solver.inertia_cap": cap}), times) for cap in (0, 1))
        np.testing.assert_array_equal(capped.points, plain.points)
        assert "slowed_modes" not in capped.model


def test_where_bending_is_as_fast_the_step_is_refused() -> None:
    """Of a rod that is one thick element."""
    thick = DOUBLE.with_values({"bodies.OA.elements": 1, "bodies.OA.height": 0.3, "bodies.OA.element": "ancf-quintic"})
    scene = thick.with_values({**CAPPED, "solver.step": 1.3 * stable_step(thick, "leapfrog")})
    with pytest.raises(InputError, match=r"solver.step: .* s is beyond the stability limit"):
        simulate(scene, np.array([0.1]))


def test_lanes_equal_singles() -> None:
    """Of one mass matrix, and of several."""
    times = np.linspace(0.02, 0.1, 5)
    scene = DOUBLE.with_values({**CAPPED, "solver.step": 2 * stable_step(DOUBLE, "leapfrog")})
    for path, values in (
        ("initial.OA.angle", np.array([0.1, 0.4, 0.7])),
        ("bodies.AB.youngs_modulus", DOUBLE.bodies["AB"].youngs_modulus * np.array([0.5, 1.0, 2.0])),  # type: ignore[union-attr]
    ):
        lanes = simulate(scene, times, {path: values})
        for lane, value in enumerate(values):
            single = simulate(scene.with_values({path: float(value)}), times)
            assert single.ok
            np.testing.assert_allclose(lanes.points[..., lane], single.points[..., 0], rtol=0, atol=1e-9)
