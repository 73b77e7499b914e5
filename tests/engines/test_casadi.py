"""The CasADi engine against closed forms, textbook equations and published positions; shooting against its own data."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipj, ellipk
from shoal.engines.casadi import CasadiEngine
from shoal.engines.casadi.element import cable_element
from shoal.engines.casadi.model import casadi_model
from shoal.engines.casadi.shooting import identify_initial_angles
from shoal.errors import InputError
from shoal.scene import Scene, load_scene
from shoal.trajectory import Status

ENGINE = CasadiEngine()
PATHS = ("initial.OA.angle", "initial.AB.angle")
TIMES = np.linspace(0.0, 0.5, 51)[1:]


def _flexible(name: str = "flexible-double-pendulum", refinement: int = 1, quadrature: str = "full") -> Scene:
    return load_scene(name).with_values(
        {
            "bodies.OA.elements": 2 * refinement,
            "bodies.AB.elements": 4 * refinement,
            "bodies.OA.quadrature": quadrature,
            "bodies.AB.quadrature": quadrature,
        }
    )


def _mixed(friction: float = 0.0) -> Scene:
    """A cable that carries a rigid rod at its end, a reversed cable in its middle and a body behind the rod."""
    rod = {"kind": "rod", "height": 0.02, "width": 0.05, "density": 1000.0, "youngs_modulus": 2e8}
    joint = {"kind": "revolute", "friction": friction}
    data: dict[str, Any] = {
        "name": "mixed",
        "bodies": {
            "C": rod | {"length": 1.0, "element": "ancf-cable", "elements": 2},
            "R": rod | {"length": 0.8, "element": "rigid"},
            "D": rod | {"length": 0.7, "element": "ancf-cable", "elements": 2, "quadrature": "reduced"},
            "W": {"kind": "rigid-body", "mass": 0.5, "inertia": 0.02, "centre_of_mass": [0.1, 0.05]},
        },
        "joints": {
            "W": joint | {"first": {"body": "W"}, "second": {"body": "R", "point": "end"}},
            "D": joint | {"first": {"body": "C", "point": [0.6, 0.0]}, "second": {"body": "D", "point": [0.5, 0.0]}},
            "R": joint | {"first": {"body": "C", "point": "end"}, "second": {"body": "R"}},
            "O": joint | {"first": {"body": "ground", "point": [0.3, -0.2]}, "second": {"body": "C"}},
        },
        "markers": {
            "on_C": {"body": "C", "point": [0.6, 0.0]},
            "on_D": {"body": "D", "point": [0.5, 0.0]},
            "W": {"body": "W", "point": [0.2, -0.1]},
        },
        "initial": {
            "C": {"angle": 0.1, "rate": 1.0},
            "R": {"angle": -1.0, "rate": -0.5},
            "D": {"angle": 2.0, "rate": 0.3},
            "W": {"angle": -2.0, "rate": 2.0},
        },
        "solver": {"duration": 0.4, "samples": 40, "energy_tolerance": 1e-9},
    }
    return Scene.parse(data)


def test_element_energy_of_a_stretched_straight_element() -> None:
    # eps = 0.1 everywhere and kappa = 0, so int eps^2 ds = 0.01 h; a unit velocity has int |v|^2 ds = h.
    for quadrature in ("full", "reduced"):
        element = cable_element(quadrature)
        h, c, s = 0.5, np.cos(0.4), np.sin(0.4)
        e = [0.2, 0.3, 1.1 * c, 1.1 * s, 0.2 + 0.55 * c, 0.3 + 0.55 * s, 1.1 * c, 1.1 * s]
        axial, bending = (float(value) for value in element.strain(e, h))
        assert axial == pytest.approx(0.01 * h, rel=1e-13)
        assert bending == pytest.approx(0.0, abs=1e-25)
        assert float(element.square([1, 0, 0, 0, 1, 0, 0, 0], h)) == pytest.approx(h, rel=1e-14)


@pytest.mark.parametrize(
    ("name", "quadrature", "expected"),
    [
        # The first is known to five digits from other codes, (2.67616, 0.57868); ten digits are what CVODES'
        # Adams (tolerance 1e-9 to 1e-13) and BDF (1e-12) methods agree on.
        ("flexible-double-pendulum", "full", (2.6761612551, 0.5786753311)),
        ("flexible-double-pendulum", "reduced", (2.6541208441, 0.5621187737)),
        ("flexible-double-pendulum-hanging", "full", (1.5846621373, -2.4658202511)),
    ],
)
@pytest.mark.by_day(1)
def test_flexible_double_pendulum(name: str, quadrature: str, expected: tuple[float, float]) -> None:
    run = ENGINE.simulate(_flexible(name, quadrature=quadrature))
    assert run.ok, run.message
    assert run.energy_drift[0] < 1e-12
    assert run.points.shape == (51, 2, 2, 1)
    assert run.model["unknowns"] == 28
    np.testing.assert_allclose(run.marker("B")[-1], expected, atol=2e-10)


@pytest.mark.slow
def test_refined_flexible_double_pendulum_reaches_the_published_position() -> None:
    # Independent codes agree on (2.646223, 0.572009) at 16/32 elements.
    run = CasadiEngine(tolerance=1e-9).simulate(_flexible(refinement=8))
    assert run.ok, run.message
    np.testing.assert_allclose(run.marker("B")[-1], (2.646223, 0.572009), atol=1e-6)


def test_runge_kutta_converges_to_cvodes() -> None:
    scene = _flexible()
    exact = ENGINE.simulate(scene).marker("B")
    errors = [
        np.abs(CasadiEngine("rk4").simulate(scene.with_values({"solver.step": step})).marker("B") - exact).max()
        for step in (2e-4, 1e-4)
    ]
    assert errors[1] < 1e-8
    assert errors[0] / errors[1] > 8


def test_rigid_double_pendulum_against_textbook_equations() -> None:
    """Two uniform rods, absolute angles from +X: moment m l^2 / 3 about an end, centre of mass at l / 2."""
    (m1, l1), (m2, l2), g = (1.0, 1.0), (2.0, 2.0), 9.81

    def rate(_t: float, y: Any) -> Any:
        a, b, da, db = y
        inertia = np.array(
            [
                [(m1 / 3 + m2) * l1**2, m2 * l1 * l2 / 2 * np.cos(a - b)],
                [m2 * l1 * l2 / 2 * np.cos(a - b), m2 * l2**2 / 3],
            ]
        )
        torque = np.array(
            [
                -m2 * l1 * l2 / 2 * np.sin(a - b) * db**2 - (m1 / 2 + m2) * g * l1 * np.cos(a),
                m2 * l1 * l2 / 2 * np.sin(a - b) * da**2 - m2 * g * l2 / 2 * np.cos(b),
            ]
        )
        return [da, db, *np.linalg.solve(inertia, torque)]

    scene = load_scene("rigid-double-pendulum").with_values({"initial.AB.rate": 1.5})
    run = ENGINE.simulate(scene)
    reference = solve_ivp(
        rate, (0, 2), [np.pi / 4, np.pi / 6, 0, 1.5], method="DOP853", t_eval=run.times, rtol=1e-13, atol=1e-13
    )
    assert run.ok, run.message
    np.testing.assert_allclose(run.angle("A"), reference.y[0], atol=5e-9)
    np.testing.assert_allclose(run.angle("B"), reference.y[1], atol=5e-9)
    tip = l1 * np.array([np.cos(reference.y[0]), np.sin(reference.y[0])])
    tip += l2 * np.array([np.cos(reference.y[1]), np.sin(reference.y[1])])
    np.testing.assert_allclose(run.marker("B"), tip.T, atol=5e-9)


def test_single_pendulum_against_the_elliptic_closed_form() -> None:
    # sin(phi/2) = k sn(K - w t) for the angle phi from hanging, released at phi = pi/2, k = sin(pi/4).
    run = ENGINE.simulate(load_scene("single-pendulum"))
    sn = ellipj(ellipk(0.5) - np.sqrt(9.81) * run.times, 0.5)[0]
    np.testing.assert_allclose(run.angle("A"), 2 * np.arcsin(np.sqrt(0.5) * sn) - np.pi / 2, atol=5e-9)


def test_friction_against_the_damped_pendulum_and_its_energy_balance() -> None:
    scene = load_scene("single-pendulum").with_values({"joints.O.friction": 0.4})
    run = ENGINE.simulate(scene)
    reference = solve_ivp(
        lambda _t, y: [y[1], -9.81 * np.cos(y[0]) - 0.4 * y[1]],
        (0, 5),
        [0, 0],
        "DOP853",
        run.times,
        rtol=1e-13,
        atol=1e-13,
    )
    np.testing.assert_allclose(run.angle("A"), reference.y[0], atol=5e-9)
    assert run.energy_drift[0] < 1e-8


@pytest.mark.parametrize("friction", [pytest.param(0.0, marks=pytest.mark.slow), 0.05])
def test_mixed_tree_keeps_its_energy_and_its_joints(friction: float) -> None:
    run = ENGINE.simulate(_mixed(friction), np.linspace(0, 0.4, 41))
    assert run.ok, run.message
    assert run.energy_drift[0] < 1e-10
    np.testing.assert_allclose(run.marker("on_C"), run.marker("on_D"), atol=1e-13)
    # At the start the bodies are straight: ground, rod C, rod R and the place on W, added up by hand.
    turned = np.array([0.2 * np.cos(-2.0) + 0.1 * np.sin(-2.0), 0.2 * np.sin(-2.0) - 0.1 * np.cos(-2.0)])
    place = np.array([0.3 + np.cos(0.1) + 0.8 * np.cos(-1), -0.2 + np.sin(0.1) + 0.8 * np.sin(-1)]) + turned
    np.testing.assert_allclose(run.marker("W")[0], place, atol=1e-14)


def test_a_cable_hung_by_its_other_end_moves_the_same() -> None:
    scene = _flexible()
    data = scene.model_dump()
    data["joints"]["A"]["second"]["point"] = "end"
    data["markers"]["B"]["point"] = "start"
    data["initial"]["AB"]["angle"] += np.pi
    run = ENGINE.simulate(Scene.parse(data), [0.25, 0.5])
    np.testing.assert_allclose(run.marker("B"), ENGINE.simulate(scene, [0.25, 0.5]).marker("B"), atol=1e-10)


@pytest.mark.slow
def test_angles_count_turns_even_between_rare_samples() -> None:
    # Without gravity straight stiff cables turn like one rod: 20 rad/s for 0.5 s.
    turning = {"initial.OA.angle": 0.0, "initial.OA.rate": 20.0, "initial.AB.angle": 0.0, "initial.AB.rate": 20.0}
    stiff = {"bodies.OA.youngs_modulus": 2e10, "bodies.AB.youngs_modulus": 2e10, "gravity": [0.0, 0.0]}
    run = ENGINE.simulate(_flexible().with_values(turning | stiff), [0.5])
    assert run.ok, run.message
    assert run.angle("A")[0] == pytest.approx(10.0, abs=0.2)
    assert run.angle("B")[0] == pytest.approx(10.0, abs=0.2)


def test_lanes_equal_single_runs_and_share_the_model() -> None:
    scene = _flexible()
    angles = np.array([0.7, 0.8])
    run = ENGINE.simulate_many(scene, {PATHS[0]: angles}, [0.1, 0.2])
    assert run.status == (Status.OK, Status.OK)
    for lane, angle in enumerate(angles):
        other = scene.with_values({PATHS[0]: float(angle)})
        assert casadi_model(other) is casadi_model(scene)
        np.testing.assert_array_equal(run.points[..., lane], ENGINE.simulate(other, [0.1, 0.2]).points[..., 0])


def test_a_failed_lane_leaves_the_others_alone() -> None:
    # The square of the second lane's rate overflows.
    scene = load_scene("rigid-double-pendulum")
    run = ENGINE.simulate_many(scene, {"initial.AB.rate": np.array([0.0, 1e200])}, [0.5])
    assert run.status == (Status.OK, Status.FAILED)
    assert run.codes == ["engine-stopped"]
    assert np.all(np.isfinite(run.points[..., 0]))
    assert np.all(np.isnan(run.points[..., 1]))


@pytest.mark.parametrize("step", [1e-3, 2e-3, 1e-2])
def test_an_unstable_step_is_not_believed(step: float) -> None:
    # The highest frequency is 3015 rad/s, so Runge-Kutta's limit is 2.83 / 3015 = 9.4e-4 s.
    run = CasadiEngine("rk4").simulate(_flexible().with_values({"solver.step": step}))
    assert run.status[0] in (Status.ENERGY, Status.OUT_OF_REACH, Status.DIVERGED)
    assert run.message


def test_a_closed_loop_is_refused_in_one_line() -> None:
    data = load_scene("rigid-double-pendulum").model_dump()
    data["joints"]["B"] = {"first": {"body": "ground", "point": [2.0, 0.0]}, "second": {"body": "AB", "point": "end"}}
    with pytest.raises(InputError, match=r"^joints\.B: engine casadi cannot do closed loops; use gauss .*$"):
        ENGINE.simulate(Scene.parse(data))


@pytest.mark.parametrize("solver", [pytest.param("ipopt", marks=pytest.mark.slow), "sqpmethod"])
def test_shooting_finds_the_angles_of_the_paper(solver: Any, capfd: pytest.CaptureFixture[str]) -> None:
    scene = _flexible()
    measured = CasadiEngine("rk4").simulate(scene, TIMES).marker("B")
    found = identify_initial_angles(scene, PATHS, (0.6, 0.4), (-3, -3), (3, 3), TIMES, "B", measured, solver=solver)
    assert found.status is Status.OK, found.message
    np.testing.assert_allclose(found.values, [np.pi / 4, np.pi / 6], atol=1e-8)
    assert found.fitness < 1e-16
    assert found.evaluations < 100
    assert capfd.readouterr().out == ""


def test_shooting_finds_a_rate_and_keeps_the_bounds() -> None:
    scene = load_scene("rigid-double-pendulum").with_values({"initial.OA.rate": 0.7, "solver.step": 5e-3})
    measured = CasadiEngine("rk4").simulate(scene, TIMES).marker("B")
    paths = ("initial.OA.rate", "initial.AB.angle")
    found = identify_initial_angles(scene, paths, (0.0, 0.0), (-2, -1), (2, 1), TIMES, "B", measured)
    np.testing.assert_allclose(found.values, [0.7, np.pi / 6], atol=1e-8)
    bounded = identify_initial_angles(scene, paths, (0.0, 0.0), (-2, -1), (0.5, 1), TIMES, "B", measured)
    assert bounded.values[0] == pytest.approx(0.5, abs=1e-6)
    assert bounded.values[0] <= 0.5


@pytest.mark.slow
def test_shooting_into_data_of_a_finer_mesh_is_biased() -> None:
    # Mesh error, not time error: 2/4 elements with full quadrature fit 4/8 elements about a degree off.
    measured = CasadiEngine(tolerance=1e-9).simulate(_flexible(refinement=2), TIMES).marker("B")
    found = identify_initial_angles(_flexible(), PATHS, (0.6, 0.4), (-3, -3), (3, 3), TIMES, "B", measured)
    assert found.status is Status.OK
    assert 0.005 < np.abs(found.values - [np.pi / 4, np.pi / 6]).max() < 0.05
    assert found.fitness > 1e-5


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"paths": ("initial.XY.angle", PATHS[1])}, "initial.XY.angle"),
        ({"paths": (PATHS[0], PATHS[0])}, "paths"),
        ({"marker": "Z"}, "marker"),
        ({"start": (9.0, 0.0)}, "start"),
        ({"measured": np.zeros((3, 2))}, "measured"),
    ],
)
def test_shooting_refuses_what_it_cannot_do(change: dict[str, Any], message: str) -> None:
    request: dict[str, Any] = {
        "paths": PATHS,
        "start": (0.6, 0.4),
        "lower": (-3, -3),
        "upper": (3, 3),
        "times": TIMES,
        "marker": "B",
        "measured": np.zeros((50, 2)),
    }
    with pytest.raises(InputError, match=f"^{message}"):
        identify_initial_angles(_flexible(), **(request | change))


def _sprung(kind: str, **more: Any) -> Scene:
    data = _mixed().model_dump(mode="json")
    sides = {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "C", "point": "end"}}
    data["loads"] = {"S": {"kind": kind, **sides, "stiffness": 1.0, **more}}
    return Scene.parse(data)


@pytest.mark.slow
def test_a_spring_rests_where_it_starts() -> None:
    free = ENGINE.simulate(_mixed(), [0.0])
    rest = float(np.hypot(0.3 + np.cos(0.1), -0.2 + np.sin(0.1)))
    told, untold = (ENGINE.simulate(scene) for scene in (_sprung("spring", length=rest), _sprung("spring")))
    assert told.ok
    np.testing.assert_allclose(told.points, untold.points, atol=1e-12)
    np.testing.assert_allclose(free.points[0], ENGINE.simulate(_sprung("spring"), [0.0]).points[0])


def test_shooting_needs_a_spring_that_says_where_it_rests() -> None:
    scene = _sprung("torsion-spring")
    with pytest.raises(InputError, match=r"^loads\.S\.angle: shooting moves the start"):
        identify_initial_angles(scene, ("initial.C.angle",), (0.1,), (-1,), (1,), [0.1], "on_C", np.zeros((1, 2)))


def test_a_cable_is_not_wound_up() -> None:
    with pytest.raises(InputError, match=r"^loads\.S\.angle: engine casadi winds up no cable"):
        ENGINE.simulate(_sprung("torsion-spring", angle=4.0))
