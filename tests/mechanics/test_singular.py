"""Machines that pass, start at and stop near singular positions, against their motion in one angle."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene, load_scene
from shoal_validation.problems import one_angle

Reference = Callable[[Any], Any]


def _end(reference: Reference, end: float) -> Any:
    """The marker at the end of a motion that is known in one angle (see the problem library)."""
    return reference(np.array([end])).points[-1]


def _at(scene: Scene, marker: str, end: float) -> Any:
    run = simulate(scene, np.array([end]))
    assert run.ok, run.message
    return run.marker(marker)[-1]


@pytest.mark.parametrize(
    ("loops", "end", "tolerance"), [(1, 10.0, 1e-9), (2, 10.0, 1e-9), (5, 20.0, 1e-8), (40, 20.0, 1e-8)]
)
@pytest.mark.by_day(2)
def test_n_four_bar_turns_through_its_singular_positions(loops: int, end: float, tolerance: float) -> None:
    scene = load_scene(f"n-four-bar-{loops}")
    np.testing.assert_allclose(_at(scene, "B0", end), _end(one_angle.four_bar(loops), end), atol=tolerance)


def test_n_four_bar_ends_where_its_elliptic_function_says() -> None:
    expected = [0.328458111540815, 0.944518538178601]  # phi = 2 am(t/2 | -4 kappa), N = 2, t = 10 s
    np.testing.assert_allclose(_at(load_scene("n-four-bar-2"), "B0", 10.0), expected, atol=1e-9)


@pytest.mark.parametrize("side", [0.0, 20.0])
def test_parallelogram_with_unequal_cranks(side: float) -> None:
    load = {"pull": {"kind": "force", "at": {"body": "left", "point": "end"}, "force": [side, 0.0]}}
    scene = load_scene("parallelogram").with_values({"loads": load})
    np.testing.assert_allclose(
        _at(scene, "A", 10.0), _end(one_angle.parallelogram(np.pi / 2, -1.0, side), 10.0), atol=1e-8
    )


def test_slider_crank_of_equal_rods_passes_the_bearing() -> None:
    scene = load_scene("equal-slider-crank")
    np.testing.assert_allclose(_at(scene, "B", 5.0), _end(one_angle.slider_crank(np.pi / 4, 6.0), 5.0), atol=1e-8)


def _flat(side: float, offset: float = 0.0) -> Scene:
    """The parallelogram with all bars on one line, or `offset` [rad] away from it, in motion."""
    angles = {f"initial.{name}.{field}": value for name in ("left", "right")
              for field, value in (("angle", offset), ("rate", -4.0))}  # fmt: skip
    load = {"pull": {"kind": "force", "at": {"body": "left", "point": "end"}, "force": [side, 0.0]}}
    return load_scene("parallelogram").with_values({**angles, "loads": load})


STARTS = {
    "parallelogram": (_flat(0.0), "A", one_angle.parallelogram(0.0, -4.0)),
    "parallelogram-pulled": (_flat(20.0), "A", one_angle.parallelogram(0.0, -4.0, 20.0)),
    "slider-crank": (
        load_scene("equal-slider-crank").with_values(
            {
                "initial.crank.angle": np.pi / 2,
                "initial.rod.angle": -np.pi / 2,
                "initial.crank.rate": 6.0,
                "initial.rod.rate": -6.0,
            }
        ),
        "B",
        one_angle.slider_crank(np.pi / 2, 6.0),
    ),
}


@pytest.mark.parametrize("name", list(STARTS))
@pytest.mark.parametrize(("integrator", "order"), [("leapfrog", 2), ("rk4", 4)])
def test_an_integrator_keeps_its_order_when_started_at_the_singular_position(
    name: str, integrator: str, order: int
) -> None:
    scene, marker, reference = STARTS[name]
    end, errors = 0.4, []
    for step in (0.02, 0.01, 0.005):
        run = scene.with_values({"solver.integrator": integrator, "solver.step": step, "solver.energy_tolerance": 0.1})
        errors.append(np.abs(_at(run, marker, end) - _end(reference, end)).max())
    slopes = np.diff(np.log(errors)) / np.log(0.5)
    assert slopes[-1] > order - 0.35, f"errors {errors}"


@pytest.mark.parametrize("offset", [0.0, 1e-12, 1e-9, 1e-7, 1e-6, 1e-5, 1e-4, 1e-2])
def test_started_at_any_distance_from_the_singular_position(offset: float) -> None:
    scene = _flat(20.0, offset)
    np.testing.assert_allclose(_at(scene, "A", 1.0), _end(one_angle.parallelogram(offset, -4.0, 20.0), 1.0), atol=1e-7)


@pytest.mark.parametrize("acceleration", ["kkt", "augmented-lagrangian", "proximal"])
def test_other_solvers_agree_while_drift_is_removed(acceleration: str) -> None:
    scene = load_scene("n-four-bar-2").with_values(
        {"solver.acceleration": acceleration, "solver.integrator": "rk4", "solver.step": 1e-3}
    )
    np.testing.assert_allclose(_at(scene, "B0", 10.0), _end(one_angle.four_bar(2), 10.0), atol=1e-6)


def test_andrews_squeezing_mechanism_ends_at_its_published_angles() -> None:
    """IVP test set (Mazzia and Magherini 2008), angles at 0.03 s."""
    beta, theta, gamma, phi, delta, omega, epsilon = (
        15.81077119629904, -15.75637105984298, 0.04082224013073101, -0.5347301163226948,
        0.5244099658805304, 0.5347301163226948, 1.048080741042263,
    )  # fmt: skip
    expected = [beta, beta + theta, gamma, phi + delta, delta, omega + epsilon, epsilon]
    run = simulate(load_scene("andrews-squeezer"), np.array([0.03]))
    assert run.ok, run.message
    np.testing.assert_allclose([run.angle(f"K{k}")[0] for k in range(1, 8)], expected, atol=1e-8)


def test_two_thousand_seconds_of_a_pendulum() -> None:
    """A mass point on 1 m, released horizontally: sin((angle + pi/2)/2) = k sn(K - omega t | k^2), k^2 = 1/2."""
    scene = load_scene("single-pendulum").with_values({"solver.duration": 2000.0, "initial.OA.angle": 0.0})
    np.testing.assert_allclose(_at(scene, "A", 2000.0), _end(one_angle.pendulum, 2000.0), atol=1e-6)
