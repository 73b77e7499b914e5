"""Whole runs against closed forms, textbook equations, another engine and published positions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.special import ellipj, ellipk
from shoal.engines.casadi import CasadiEngine
from shoal.mechanics.integrators import INTEGRATORS, facts
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene, load_scene
from shoal.trajectory import Trajectory

Rods = Callable[..., Any]
RIGID = load_scene("rigid-double-pendulum")
ROD = {"kind": "rod", "height": 0.02, "width": 0.05, "density": 1000.0, "youngs_modulus": 2e8}


def _run(scene: Scene, times: Any, **settings: Any) -> Trajectory:
    values = {f"solver.{key}": value for key, value in settings.items()}
    run = simulate(scene.with_values(values), np.atleast_1d(np.asarray(times, dtype=float)))
    assert run.ok, run.message
    return run


def test_single_pendulum_against_the_elliptic_closed_form() -> None:
    # sin(phi/2) = k sn(K - w t) for the angle phi from hanging, released at phi = pi/2, k = sin(pi/4).
    times = np.linspace(0, 5, 101)
    run = _run(load_scene("single-pendulum"), times)
    sn = ellipj(ellipk(0.5) - np.sqrt(9.81) * times, 0.5)[0]
    np.testing.assert_allclose(run.angle("A"), 2 * np.arcsin(np.sqrt(0.5) * sn) - np.pi / 2, atol=1e-8)
    assert run.energy_drift[0] < 1e-9
    assert run.constraint_drift[0] < 1e-13


@pytest.mark.parametrize("integrator", list(INTEGRATORS))
def test_every_integrator_swings_the_single_pendulum(integrator: str) -> None:
    times = np.linspace(0, 2, 21)
    run = _run(load_scene("single-pendulum"), times, integrator=integrator, step=1e-3, energy_tolerance=0.1)
    sn = ellipj(ellipk(0.5) - np.sqrt(9.81) * times, 0.5)[0]
    np.testing.assert_allclose(
        run.angle("A"),
        2 * np.arcsin(np.sqrt(0.5) * sn) - np.pi / 2,
        atol=5e-2 if facts(integrator).order == 1 else 5e-5,
    )


@pytest.mark.parametrize(
    ("outer", "inner"), [(0.0, 0.0), (0.7, 0.0), (0.0, 0.4), (0.7, 0.4)], ids=["free", "O", "A", "O-and-A"]
)
def test_rigid_double_pendulum_against_textbook_equations(uniform_rods: Rods, outer: float, inner: float) -> None:
    times = np.linspace(0, 2, 41)[1:]
    rates = (0.5, -1.5)
    angles, omegas = uniform_rods(
        [1.0, 2.0],
        [1.0 / 12, 2.0 * 4 / 12],
        [[0.5, 0.0], [1.0, 1.0]],
        [np.pi / 4, np.pi / 6],
        rates,
        times,
        friction=np.array([[outer + inner, -inner], [-inner, inner]]),
    )
    scene = RIGID.with_values(
        {
            "joints.O.friction": outer,
            "joints.A.friction": inner,
            "initial.OA.rate": rates[0],
            "initial.AB.rate": rates[1],
        }
    )
    run = _run(scene, times, step=5e-4)
    np.testing.assert_allclose(run.angle("A"), angles[0], atol=1e-7)
    np.testing.assert_allclose(run.angle("B"), angles[1], atol=1e-7)
    tip = np.exp(1j * angles[0]) + 2 * np.exp(1j * angles[1])
    np.testing.assert_allclose(run.marker("B"), np.column_stack([tip.real, tip.imag]), atol=1e-7)
    assert run.energy_drift[0] < 1e-6
    assert run.constraint_drift[0] < 1e-13
    assert omegas.shape == (2, 40)


def test_four_bar_linkage_against_multipliers(uniform_rods: Rods) -> None:
    """Crank, coupler, rocker of 1, 2 and 1.6 m on a base of 2.2 m, with friction in one joint on the ground."""
    lengths, base, start = (1.0, 2.0, 1.6), 2.2, 1.1
    # The rocker and the coupler that close the loop: circles about the crank's end and the rocker's foot.
    crank = np.exp(1j * start)
    gap = base - crank
    cosine = (lengths[1] ** 2 + abs(gap) ** 2 - lengths[2] ** 2) / (2 * lengths[1] * abs(gap))
    coupler = np.angle(gap) + np.arccos(cosine)
    rocker = np.angle(crank + lengths[1] * np.exp(1j * coupler) - base)
    # Rates that keep it closed, for a crank at 2 rad/s.
    directions = [1j * length * np.exp(1j * a) for length, a in zip(lengths, (start, coupler, rocker), strict=True)]
    matrix = [[d.real for d in (directions[1], -directions[2])], [d.imag for d in (directions[1], -directions[2])]]
    others = np.linalg.solve(matrix, [-2 * directions[0].real, -2 * directions[0].imag])
    times = np.linspace(0, 1.5, 31)[1:]
    angles, _ = uniform_rods(
        lengths,
        [length**3 / 12 for length in lengths],
        [[0.5, 0, 0], [1.0, 1.0, 0], [0, 0, 0.8]],
        [start, coupler, rocker],
        [2.0, *others],
        times,
        friction=np.diag([0.3, 0.0, 0.0]),
        closure=[1.0, 2.0, -1.6],
    )
    scene = Scene.parse(
        {
            "name": "four-bar",
            "bodies": {
                name: ROD | {"length": length, "element": "rigid"}
                for name, length in zip(("crank", "coupler", "rocker"), lengths, strict=True)
            },
            "joints": {
                "O": {
                    "first": {"body": "ground", "point": [0, 0]},
                    "second": {"body": "crank"},
                    "friction": 0.3,
                },
                "A": {"first": {"body": "crank", "point": "end"}, "second": {"body": "coupler"}},
                "B": {"first": {"body": "coupler", "point": "end"}, "second": {"body": "rocker", "point": "end"}},
                "C": {"first": {"body": "ground", "point": [base, 0]}, "second": {"body": "rocker"}},
            },
            "markers": {name: {"body": name, "point": "end"} for name in ("crank", "coupler", "rocker")},
            "initial": {
                "crank": {"angle": start, "rate": 2.0},
                "coupler": {"angle": coupler, "rate": others[0]},
                "rocker": {"angle": rocker, "rate": others[1]},
            },
        }
    )
    run = _run(scene, times, integrator="rk4", step=1e-3)
    for name, angle in zip(("crank", "coupler", "rocker"), angles, strict=True):
        np.testing.assert_allclose(run.angle(name), angle, atol=1e-8)
    np.testing.assert_allclose(run.marker("coupler"), run.marker("rocker"), atol=1e-12)
    assert run.constraint_drift[0] < 1e-12
    assert run.energy_drift[0] < 1e-6
    # The implicit integrator closes the loop with its own multipliers.
    implicit = _run(scene, times, integrator="generalized-alpha", step=5e-4)
    np.testing.assert_allclose(implicit.marker("rocker"), run.marker("rocker"), atol=1e-5)
    np.testing.assert_allclose(implicit.marker("coupler"), implicit.marker("rocker"), atol=1e-9)


def _flexible(name: str, quadrature: str, refinement: int = 1) -> Scene:
    return load_scene(name).with_values(
        {
            "bodies.OA.quadrature": quadrature,
            "bodies.AB.quadrature": quadrature,
            "bodies.OA.elements": 2 * refinement,
            "bodies.AB.elements": 4 * refinement,
        }
    )


@pytest.mark.parametrize(
    ("name", "quadrature", "expected"),
    [
        # CasADi's CVODES at a tolerance of 1e-11, on an element derived symbolically from its energy.
        ("flexible-double-pendulum", "full", (2.6761612551, 0.5786753311)),
        ("flexible-double-pendulum", "reduced", (2.6541208441, 0.5621187737)),
        ("flexible-double-pendulum-case-2", "full", (2.0894908009, 1.1660744218)),
        ("flexible-double-pendulum-hanging", "full", (1.5846621373, -2.4658202511)),
    ],
)
def test_flexible_double_pendulum_at_the_mesh_of_the_paper(name: str, quadrature: str, expected: Any) -> None:
    run = _run(_flexible(name, quadrature), 0.5, integrator="rk4", step=1e-4)
    np.testing.assert_allclose(run.marker("B")[-1], expected, atol=1e-8)
    assert run.energy_drift[0] < 1e-8
    assert run.model["unknowns"] == 28


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        # Where independent codes agree for 16/32 Bernoulli-Euler cables.
        ("flexible-double-pendulum", (2.646223, 0.572009)),
        ("flexible-double-pendulum-hanging", (1.593280, -2.451881)),
    ],
)
@pytest.mark.parametrize(("quadrature", "tolerance"), [("full", 1e-6), ("reduced", 1e-5)])
def test_refined_flexible_double_pendulum(name: str, quadrature: str, tolerance: float, expected: Any) -> None:
    run = _run(_flexible(name, quadrature, 8), 0.5, integrator="rk4", step=5e-5)
    np.testing.assert_allclose(run.marker("B")[-1], expected, atol=tolerance)
    assert run.energy_drift[0] < 1e-9


def test_leapfrog_at_the_step_of_the_paper() -> None:
    # Its time error at 5e-4 s is 4e-6 m.
    exact = _run(_flexible("flexible-double-pendulum", "full"), 0.5, integrator="rk4", step=1e-4).marker("B")
    found = _run(_flexible("flexible-double-pendulum", "full"), 0.5, integrator="leapfrog", step=5e-4).marker("B")
    assert 1e-6 < np.abs(found - exact).max() < 1e-5


def test_generalized_alpha_at_the_step_of_the_paper() -> None:
    exact = _run(_flexible("flexible-double-pendulum", "full"), 0.5, integrator="rk4", step=1e-4).marker("B")
    found = _run(_flexible("flexible-double-pendulum", "full"), 0.5, integrator="generalized-alpha", step=5e-4)
    np.testing.assert_allclose(found.marker("B"), exact, atol=1e-3)


def _joint(first: Any, second: Any, friction: float = 0.0) -> dict[str, Any]:
    return {
        "first": {"body": first[0], "point": first[1]},
        "second": {"body": second[0], "point": second[1]},
        "friction": friction,
    }


def _mixed(name: str, friction: float) -> Scene:
    """Trees of cables and rigid bodies."""
    cable = ROD | {"element": "ancf-cable", "elements": 2}
    weight = {"kind": "rigid-body", "mass": 0.5, "inertia": 0.02, "centre_of_mass": [0.1, 0.05]}
    ground = ("ground", [0.3, -0.2])
    rod_then_cable = (
        {"R": ROD | {"length": 0.8, "element": "rigid"}, "C": cable | {"length": 1.0}},
        {"O": _joint(ground, ("R", "start"), friction), "A": _joint(("R", "end"), ("C", "start"), friction)},
        {"R": {"body": "R", "point": [0.4, 0.0]}, "C": {"body": "C", "point": "end"}},
    )
    cable_then_body = (
        {"C": cable | {"length": 1.0}, "W": weight},
        {"O": _joint(ground, ("C", "start"), friction), "A": _joint(("C", "end"), ("W", "start"), friction)},
        {"C": {"body": "C", "point": [0.3, 0.0]}, "W": {"body": "W", "point": [0.2, -0.1]}},
    )
    branched = (
        {
            "C": cable | {"length": 1.0},
            "R": ROD | {"length": 0.8, "element": "rigid"},
            "D": cable | {"length": 0.8, "quadrature": "reduced"},
            "W": weight,
        },
        {
            # Declared from the tip back to the ground; the second cable hangs at its middle node.
            "W": _joint(("W", "start"), ("R", "end"), friction),
            "D": _joint(("C", [0.5, 0.0]), ("D", [0.4, 0.0]), friction),
            "R": _joint(("C", "end"), ("R", [0.1, 0.05]), friction),
            "O": _joint(ground, ("C", "start"), friction),
        },
        {"C": {"body": "C", "point": [0.6, 0.0]}, "D": {"body": "D", "point": "end"}, "W": {"body": "W"}},
    )
    bodies, joints, markers = {"rod": rod_then_cable, "cable": cable_then_body, "branched": branched}[name]
    start = {
        "C": {"angle": 0.1, "rate": 1.0},
        "R": {"angle": -1.0, "rate": -0.5},
        "D": {"angle": 2.0, "rate": 0.3},
        "W": {"angle": -2.0, "rate": 2.0},
    }
    return Scene.parse(
        {
            "name": name,
            "bodies": bodies,
            "joints": joints,
            "markers": markers,
            "initial": {body: start[body] for body in bodies},
            "solver": {"duration": 0.3, "samples": 10, "integrator": "rk4", "step": 5e-5},
        }
    )


@pytest.mark.parametrize("friction", [0.0, 0.01])
@pytest.mark.parametrize("name", ["rod", "cable", "branched"])
@pytest.mark.by_day(2)
def test_mixed_trees_against_casadi(name: str, friction: float) -> None:
    """A rod that carries a cable, a cable that carries a body, and both with branches."""
    scene = _mixed(name, friction)
    times = np.linspace(0, 0.3, 11)[1:]
    run, other = _run(scene, times), CasadiEngine().simulate(scene, times)
    assert other.ok, other.message
    np.testing.assert_allclose(run.points, other.points, atol=1e-7)
    np.testing.assert_allclose(run.angles, other.angles, atol=1e-6)
    assert run.energy_drift[0] < 1e-6


@pytest.mark.parametrize("integrator", ["leapfrog", "generalized-alpha"])
def test_the_other_integrators_follow_the_branched_tree(integrator: str) -> None:
    scene, times = _mixed("branched", 0.01), np.linspace(0, 0.1, 5)[1:]
    fine = _run(scene, times)
    np.testing.assert_allclose(_run(scene, times, integrator=integrator).points, fine.points, atol=2e-5)


@pytest.mark.parametrize(
    ("scene", "integrator", "step", "tolerance"),
    [
        pytest.param(RIGID, "rk4", 1e-2, 1e-5, id="rigid-rk4"),
        pytest.param(RIGID, "leapfrog", 1e-3, 1e-6, id="rigid-leapfrog"),
        pytest.param(RIGID, "generalized-alpha", 1e-3, 1e-5, id="rigid-generalized-alpha"),
        pytest.param(load_scene("flexible-double-pendulum"), "leapfrog", 4e-4, 1e-5, id="flexible-leapfrog"),
        pytest.param(load_scene("flexible-double-pendulum"), "rk4", 4e-4, 1e-5, id="flexible-rk4"),
    ],
)
def test_requested_times_off_the_grid_agree_with_a_finer_run(
    scene: Scene, integrator: str, step: float, tolerance: float
) -> None:
    # Several between two steps, one just before and one just after a step, the last inside the last step.
    times = np.array([0.21, 0.25, 0.61, 9.999, 10.0, 10.001, 17.3, 23.0, 23.5]) * step
    run = _run(scene, times, integrator=integrator, step=step)
    fine = _run(scene, times, integrator="rk4", step=step / 100)
    np.testing.assert_allclose(run.points, fine.points, atol=tolerance)
    np.testing.assert_allclose(run.angles, fine.angles, atol=10 * tolerance)


@pytest.mark.parametrize("integrator", list(INTEGRATORS))
def test_sampling_does_not_change_the_motion(integrator: str) -> None:
    scene = load_scene("flexible-double-pendulum")
    few = _run(scene, [0.02], integrator=integrator, energy_tolerance=0.1)
    many = _run(scene, np.linspace(0, 0.02, 97), integrator=integrator, energy_tolerance=0.1)
    np.testing.assert_array_equal(few.points[-1], many.points[-1])
    # At time zero the rods are straight.
    np.testing.assert_allclose(
        many.marker("B")[0],
        [np.cos(np.pi / 4) + 2 * np.cos(np.pi / 6), np.sin(np.pi / 4) + 2 * np.sin(np.pi / 6)],
        atol=1e-15,
    )


def test_angles_are_counted_on_through_full_turns() -> None:
    spinning = {"gravity": [0.0, 0.0], "initial.OA.rate": 20.0, "initial.OA.angle": 0.3}
    times = np.linspace(0, 2, 41)
    run = _run(load_scene("single-pendulum").with_values(spinning), times, step=5e-4)
    np.testing.assert_allclose(run.angle("A"), 0.3 + 20 * times, atol=1e-8)
