"""Every integrator in the list: its order, its lanes, its largest step."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from shoal.errors import InputError
from shoal.mechanics import stability
from shoal.mechanics.integrators import INTEGRATORS, facts
from shoal.mechanics.model import build
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene, load_scene
from shoal.trajectory import Status

ALL = list(INTEGRATORS)
EXPLICIT = [name for name in ALL if facts(name).explicit]
every = pytest.mark.parametrize("integrator", ALL)
RIGID = load_scene("rigid-double-pendulum").with_values({"joints.A.friction": 0.5, "initial.AB.rate": 1.0})
# Cables soft enough that every frequency is resolved by the steps below (the highest are 59 and 116 rad/s).
SOFT = load_scene("flexible-double-pendulum").with_values(
    {"bodies.OA.youngs_modulus": 2e5, "bodies.AB.youngs_modulus": 2e5, "joints.O.friction": 0.5}
)
ONE_SOFT = SOFT.with_values({"bodies.OA.elements": 1, "bodies.AB.elements": 1, "bodies.AB.quadrature": "reduced"})


def _with(scene: Scene, integrator: str, step: float, **more: Any) -> Scene:
    return scene.with_values({"solver.integrator": integrator, "solver.step": step, **more})


@pytest.mark.parametrize(
    ("scene", "steps"),
    [
        pytest.param(RIGID, {2: (4e-3, 2e-3), 4: (2e-2, 1e-2)}, id="rigid"),
        pytest.param(ONE_SOFT, {2: (1e-3, 5e-4), 4: (2e-3, 1e-3)}, id="flexible"),
    ],
)
@every
def test_convergence_slope_is_the_declared_order(integrator: str, scene: Scene, steps: dict[int, Any]) -> None:
    times = np.array([0.2, 0.4])
    order = facts(integrator).order
    # Tight Newton steps, so that the iteration does not hide the order.
    tight = {"solver.newton_tolerance": 1e-12}
    reference = simulate(_with(scene, "rk4", min(steps[4]) / 16), times).points
    errors = [
        np.abs(simulate(_with(scene, integrator, step, **tight), times).points - reference).max()
        for step in steps[order]
    ]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.2)


@pytest.mark.parametrize("radius", [0.0, 0.5, 0.9])
def test_generalized_alpha_is_of_second_order_at_any_spectral_radius(radius: float) -> None:
    times = np.array([0.2, 0.4])
    reference = simulate(_with(RIGID, "rk4", 1e-3), times).points
    errors = [
        np.abs(
            simulate(_with(RIGID, "generalized-alpha", step, **{"solver.spectral_radius": radius}), times).points
            - reference
        ).max()
        for step in (2e-3, 1e-3)
    ]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2, abs=0.2)


FLEXIBLE = load_scene("flexible-double-pendulum")
FOUR_BAR = Scene.parse(
    {
        "name": "four-bar",
        "bodies": {
            name: {"kind": "rod", "length": length, "height": 0.02, "width": 0.02, "density": 1000.0}
            for name, length in {"crank": 1.0, "coupler": 2.0, "rocker": 1.6}.items()
        },
        "joints": {
            "O": {"first": {"body": "ground", "point": [0, 0]}, "second": {"body": "crank"}, "friction": 0.01},
            "A": {"first": {"body": "crank", "point": "end"}, "second": {"body": "coupler"}},
            "B": {"first": {"body": "coupler", "point": "end"}, "second": {"body": "rocker", "point": "end"}},
            "C": {"first": {"body": "ground", "point": [2.2, 0]}, "second": {"body": "rocker"}},
        },
        "markers": {"A": {"body": "crank", "point": "end"}, "B": {"body": "rocker", "point": "end"}},
        "initial": {"crank": {"angle": 1.1}, "coupler": {"angle": 0.272}},
    }
)


@pytest.mark.parametrize(
    ("scene", "values"),
    [
        pytest.param(RIGID, {"initial.OA.angle": (-1.0, 1.0), "bodies.OA.length": (0.8, 1.2)}, id="rigid"),
        pytest.param(RIGID, {"joints.A.friction": (0.0, 1.0), "gravity": None}, id="friction"),
        pytest.param(FLEXIBLE, {"initial.OA.angle": (0.6, 0.9), "initial.AB.angle": (0.4, 0.6)}, id="flexible"),
        pytest.param(FLEXIBLE, {"bodies.AB.youngs_modulus": (1e7, 2e7), "bodies.OA.height": (0.015, 0.02)}, id="stiff"),
        pytest.param(FOUR_BAR, {"initial.crank.rate": (-1.0, 1.0), "initial.crank.angle": (1.09, 1.11)}, id="loop"),
        pytest.param(FOUR_BAR, {"bodies.rocker.length": (1.59, 1.61), "joints.O.friction": (0.0, 0.1)}, id="lengths"),
    ],
)
@pytest.mark.parametrize("lanes", [2, 19])
@every
def test_lanes_equal_singles(integrator: str, scene: Scene, values: dict[str, Any], lanes: int) -> None:
    # 2 lanes fill a tile by repetition, 19 need a second tile.
    ranges = {path: np.linspace(*span, lanes) for path, span in values.items() if span}
    scene = _with(scene, integrator, 4e-4, **{"solver.newton_tolerance": 1e-12})
    times = np.array([0.01, 0.0333])
    run = simulate(scene, times, ranges)
    assert run.ok, run.message
    assert run.lanes == lanes
    assert run.points.shape == (2, 2, 2, lanes)
    for lane in (0, 1, lanes - 1):
        single = simulate(scene.with_values({path: float(span[lane]) for path, span in ranges.items()}), times)
        np.testing.assert_allclose(run.points[..., lane], single.points[..., 0], atol=1e-10)
        np.testing.assert_allclose(run.angles[..., lane], single.angles[..., 0], atol=1e-10)


def test_threads_change_nothing() -> None:
    scene, times = _with(FLEXIBLE, "leapfrog", 5e-4), np.array([0.05])
    ranges = {"initial.OA.angle": np.linspace(0.6, 0.9, 40)}
    one, two = (simulate(scene, times, ranges, threads=count).points for count in (1, 2))
    np.testing.assert_array_equal(one, two)


@pytest.mark.parametrize("bad", [0, 1, 2])
@pytest.mark.parametrize("scene", [RIGID, FLEXIBLE], ids=["rigid", "flexible"])
@every
def test_a_lane_that_diverges_leaves_its_neighbours_alone(integrator: str, scene: Scene, bad: int) -> None:
    scene, times = _with(scene, integrator, 4e-4), np.array([0.02, 0.04])
    rates = np.array([0.5, 1.0, 1.5])
    rates[bad] = 1e200
    run = simulate(scene, times, {"initial.AB.rate": rates})
    assert run.message
    for lane, rate in enumerate(rates):
        assert run.status[lane] == (Status.DIVERGED if lane == bad else Status.OK)
        if lane != bad:
            single = simulate(scene.with_values({"initial.AB.rate": float(rate)}), times)
            np.testing.assert_allclose(run.points[..., lane], single.points[..., 0], atol=1e-8)


@pytest.mark.parametrize(
    ("refinement", "frequency"),
    # Highest frequencies [rad/s] of the double pendulum of cables at 2/4, 4/8, 8/16, 16/32 elements,
    # as computed by other codes while the product was planned.
    [(1, 3015), (2, 5946), (4, 11885), (8, 23774)],
)
def test_highest_frequency(refinement: int, frequency: float) -> None:
    scene = FLEXIBLE.with_values({"bodies.OA.elements": 2 * refinement, "bodies.AB.elements": 4 * refinement})
    assert stability.highest_frequency(build(scene)) == pytest.approx(frequency, rel=5e-3)


@pytest.mark.parametrize("integrator", EXPLICIT)
def test_a_step_beyond_the_limit_is_refused_with_the_limit(integrator: str) -> None:
    limit = facts(integrator).stable_step_times_frequency / 3015
    with pytest.raises(InputError, match=r"^solver\.step: ") as refusal:
        simulate(_with(FLEXIBLE, integrator, 1.02 * limit), np.array([0.01]))
    assert "\n" not in str(refusal.value)
    stated = re.search(r"stability limit (\S+) s of (\S+)", str(refusal.value))
    assert stated
    assert float(stated[1]) == pytest.approx(limit, rel=5e-3)
    assert stated[2] == integrator
    simulate(_with(FLEXIBLE, integrator, 0.98 * limit), np.array([0.01]))


def test_leapfrog_limit_is_two_over_the_highest_frequency() -> None:
    limit = simulate(FLEXIBLE, np.array([0.01])).model["stability_limit"]
    assert limit == pytest.approx(2 / stability.highest_frequency(build(FLEXIBLE)), rel=1e-12)
    assert limit == pytest.approx(6.6e-4, rel=1e-2)  # 2 / 3015 rad/s


@pytest.mark.parametrize("lane", [0, 1])
def test_the_stiffest_lane_sets_the_limit(lane: int) -> None:
    moduli = np.array([2e8, 8e8])
    stiff = np.roll(moduli, lane)
    with pytest.raises(InputError, match="stability limit"):
        simulate(_with(FLEXIBLE, "leapfrog", 5e-4), np.array([0.01]), {"bodies.OA.youngs_modulus": stiff})


def test_rigid_and_implicit_runs_have_no_limit() -> None:
    for scene in (load_scene("rigid-double-pendulum"), _with(FLEXIBLE, "generalized-alpha", 5e-3)):
        run = simulate(scene, np.array([0.1]))
        assert run.ok, run.message
        assert run.model["stability_limit"] is None


DAMPED = Scene.parse(
    {
        "name": "damped",
        "gravity": [0.0, 0.0],
        "bodies": {"R": {"kind": "rigid-body", "mass": 1.0, "inertia": 1.0}},
        "joints": {"O": {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "R"}, "friction": 100.0}},
        "markers": {"R": {"body": "R"}},
        "initial": {"R": {"rate": 1.0}},
    }
)


@pytest.mark.parametrize("integrator", EXPLICIT)
def test_an_accepted_step_damps_and_does_not_excite(integrator: str) -> None:
    """A flywheel in a bearing, omega' = -100 omega: the angle ends at 0.01 rad and the step limit is honest."""
    limit = simulate(_with(DAMPED, integrator, 1e-4), np.array([1e-3])).model["stability_limit"]
    run = simulate(_with(DAMPED, integrator, 0.999 * limit), np.array([20.0]))
    assert run.angle("R")[0] == pytest.approx(0.01, abs=5e-3)
