"""Every integrator in the list: its order, its energy, its lanes, its largest step, the motion inside a step."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.special import ellipj, ellipk
from shoal.engines.casadi import CasadiEngine
from shoal.errors import InputError
from shoal.mechanics import stability, workspace
from shoal.mechanics.assembly.build import build
from shoal.mechanics.integrators import INTEGRATORS, Choice, facts
from shoal.mechanics.runs import check_step
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene, load_scene
from shoal.trajectory import Status

Rods = Callable[..., Any]
ALL = list(INTEGRATORS)
FIXED = [name for name in ALL if not facts(name).adaptive]
ADAPTIVE = [name for name in ALL if facts(name).adaptive]
EXPLICIT = [name for name in FIXED if facts(name).explicit]
every = pytest.mark.parametrize("integrator", ALL)
# Tiles of lanes of the others are compiled here first, which takes its time.
every_in_lanes = pytest.mark.parametrize(
    "integrator", [pytest.param(name, marks=() if facts(name).warm_lanes else pytest.mark.slow) for name in ALL]
)
RIGID = load_scene("rigid-double-pendulum").with_values({"joints.A.friction": 0.5, "initial.AB.rate": 1.0})
# Cables soft enough that every frequency is resolved by the steps below (the highest are 59 and 116 rad/s).
SOFT = load_scene("flexible-double-pendulum").with_values(
    {"bodies.OA.youngs_modulus": 2e5, "bodies.AB.youngs_modulus": 2e5, "joints.O.friction": 0.5}
)
ONE_SOFT = SOFT.with_values({"bodies.OA.elements": 1, "bodies.AB.elements": 1, "bodies.AB.quadrature": "reduced"})
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
        "initial": {"crank": {"angle": 1.1}, "coupler": {"angle": 0.272, "guess": ["angle"]}},
    }
)
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
FLEXIBLE_AT_REST = FLEXIBLE.with_values({"initial.OA.angle": -1.4, "initial.AB.angle": -1.5})
LENGTHS, BASE = (1.0, 2.0, 1.6), 2.2


def _with(scene: Scene, integrator: str, step: float | None = None, **more: Any) -> Scene:
    values = {"solver.integrator": integrator} | ({} if step is None else {"solver.step": step})
    return scene.with_values(values | {f"solver.{key}": value for key, value in more.items()})


def _closed() -> tuple[float, float, float]:
    """Angles of the four-bar linkage: the coupler and the rocker that close the loop over the crank."""
    crank = np.exp(1.1j)
    gap = BASE - crank
    cosine = (LENGTHS[1] ** 2 + abs(gap) ** 2 - LENGTHS[2] ** 2) / (2 * LENGTHS[1] * abs(gap))
    coupler = np.angle(gap) + np.arccos(cosine)
    return 1.1, float(coupler), float(np.angle(crank + LENGTHS[1] * np.exp(1j * coupler) - BASE))


LOOP = FOUR_BAR.with_values(
    {f"initial.{name}.angle": angle for name, angle in zip(("crank", "coupler", "rocker"), _closed(), strict=True)}
)


@pytest.fixture(scope="module")
def truth(uniform_rods: Rods) -> Callable[[str, Any], Any]:
    """Marker positions (times, markers, 2) of the scenes below by other people's integrators on other equations."""

    def points(name: str, times: Any) -> Any:
        if name == "flexible":
            return CasadiEngine(tolerance=1e-12).simulate(ONE_SOFT, times).points[..., 0]
        if name == "rigid":
            friction = np.array([[0.5, -0.5], [-0.5, 0.5]])
            bodies = [RIGID.bodies["OA"], RIGID.bodies["AB"]]
            masses = [body.density * body.section_at(0.0).area * body.length for body in bodies]
            inertias = [mass * body.length**2 / 12 for mass, body in zip(masses, bodies, strict=True)]
            angles, _ = uniform_rods(
                masses,
                inertias,
                [[0.5, 0.0], [1.0, 1.0]],
                [np.pi / 4, np.pi / 6],
                [0.0, 1.0],
                times,
                friction=friction,
            )
            first = np.exp(1j * angles[0])
            ends = [first, first + 2 * np.exp(1j * angles[1])]
        else:
            density = 1000.0 * 0.02 * 0.02
            angles, _ = uniform_rods(
                [density * length for length in LENGTHS],
                [density * length**3 / 12 for length in LENGTHS],
                [[0.5, 0, 0], [1.0, 1.0, 0], [0, 0, 0.8]],
                _closed(),
                [0.0, 0.0, 0.0],
                times,
                friction=np.diag([0.01, 0.0, 0.0]),
                closure=[1.0, 2.0, -1.6],
            )
            ends = [np.exp(1j * angles[0]), BASE + 1.6 * np.exp(1j * angles[2])]
        return np.stack([np.column_stack([end.real, end.imag]) for end in ends], axis=1)

    return points


SCENES = {"rigid": RIGID, "flexible": ONE_SOFT, "loop": LOOP}
STEPS = {
    "rigid": (1e-3, 4e-3, 1e-2, 2e-2),
    "flexible": (5e-4, 1e-3, 1.5e-3, 2e-3),
    "loop": (1e-3, 4e-3, 1e-2, 2e-2),
}
"""The longer of two steps, by the order from 1 on; the last stands for all orders beyond."""


def _steps(name: str, order: int) -> tuple[float, float]:
    """A step at which the error of an order is seen in a scene, and its half."""
    step = STEPS[name][min(order, len(STEPS[name])) - 1]
    return step, step / 2


def _takes(integrator: str, scene: Scene) -> Scene:
    """The scene, if it does not vibrate or the integrator is stable where something does."""
    rigid = all(body.element == "rigid" for body in scene.bodies.values())
    if not rigid and facts(integrator).stable_step_times_frequency == 0.0:
        pytest.skip(f"{integrator} is stable for no vibration, and refuses it")
    return scene


@pytest.mark.parametrize("name", list(SCENES))
@pytest.mark.parametrize("integrator", FIXED)
def test_convergence_slope_is_the_declared_order(integrator: str, name: str, truth: Any) -> None:
    times = np.array([0.2, 0.4])
    order, scene = facts(integrator).order, _takes(integrator, SCENES[name])
    reference = truth(name, times)
    # Tight Newton steps, so that the iteration does not hide the order.
    errors = [
        np.abs(simulate(_with(scene, integrator, step, newton_tolerance=1e-12), times).points[..., 0] - reference).max()
        for step in _steps(name, order)
    ]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.2)


@pytest.mark.parametrize("name", list(SCENES))
@pytest.mark.parametrize("integrator", ADAPTIVE)
def test_error_falls_with_the_tolerance_at_the_declared_order(integrator: str, name: str, truth: Any) -> None:
    times = np.linspace(0, 0.5 if name == "flexible" else 1.0, 11)[1:]
    order = facts(integrator).order
    reference = truth(name, times)
    errors, steps = [], []
    for tolerance in (1e-6, 1e-7, 1e-8, 1e-9):
        scene = _with(SCENES[name], integrator, relative_tolerance=tolerance, absolute_tolerance=tolerance)
        run = simulate(scene, times)
        assert run.ok, run.message
        errors.append(np.abs(run.points[..., 0] - reference).max())
        steps.append(run.steps)
        assert 0.01 * tolerance < errors[-1] < 30 * tolerance
    # At least: with few steps the error of high orders falls unevenly.
    assert -np.polyfit(np.log(steps), np.log(errors), 1)[0] > order - 0.5


@pytest.mark.parametrize("integrator", [name for name in ALL if facts(name).conserves])
@pytest.mark.parametrize("scene", [RIGID, FLEXIBLE, LOOP], ids=["rigid", "flexible", "loop"])
def test_energy_is_conserved(integrator: str, scene: Scene) -> None:
    free = scene.with_values({f"joints.{name}.friction": 0.0 for name in scene.joints})
    run = simulate(_with(free, integrator, 1e-3, newton_tolerance=1e-12), np.array([1.0]))
    assert run.ok, run.message
    assert run.energy_drift[0] < 1e-10


@pytest.mark.parametrize("name", list(SCENES))
@pytest.mark.parametrize("integrator", [name for name in FIXED if not facts(name).conserves])
def test_energy_error_falls_with_the_step_at_least_at_the_declared_order(integrator: str, name: str) -> None:
    scene = _takes(integrator, SCENES[name])
    free = scene.with_values({f"joints.{joint}.friction": 0.0 for joint in scene.joints})
    order = facts(integrator).order
    first, second = (
        simulate(_with(free, integrator, step, newton_tolerance=1e-13), np.array([0.4])).energy_drift[0]
        for step in _steps(name, order)
    )
    assert np.log2(first / second) > order - 0.3


def test_the_energy_error_of_leapfrog_does_not_grow() -> None:
    early, late = (
        simulate(_with(FLEXIBLE_AT_REST, "leapfrog", 5e-4), np.array([end])).energy_drift[0] for end in (2.0, 20.0)
    )
    assert late < 3 * early  # ten times as long


@every
@pytest.mark.by_day(2)
def test_the_motion_inside_a_step_is_as_accurate_as_at_its_ends(integrator: str, truth: Any) -> None:
    known = facts(integrator)
    step = None if known.adaptive else 4e-3
    at_ends = np.linspace(0, 1, 51)[1:]
    inside = at_ends - 0.0017
    errors = [
        np.abs(simulate(_with(RIGID, integrator, step), times).points[..., 0] - truth("rigid", times)).max()
        for times in (at_ends, inside)
    ]
    assert errors[1] < 1.2 * errors[0] + 1e-12
    assert errors[0] < (1e-11 if known.adaptive else 0.1 * 0.0125 ** (known.order - 1))


@pytest.mark.parametrize(
    ("duration", "tolerance"), [(10.0, 1e-9), (2000.0, 1e-6)], ids=["ten-seconds", "two-thousand-seconds"]
)
def test_dop853_follows_the_pendulum_for_long(duration: float, tolerance: float) -> None:
    # sin(phi/2) = k sn(K - w t) for the angle phi from hanging, released at phi = pi/2, k = sin(pi/4).
    times = np.linspace(0, duration, 2001)[1:]
    run = simulate(_with(load_scene("single-pendulum"), "dop853"), times)
    assert run.ok, run.message
    sn = ellipj(ellipk(0.5) - np.sqrt(9.81) * times, 0.5)[0]
    angle = 2 * np.arcsin(np.sqrt(0.5) * sn) - np.pi / 2
    np.testing.assert_allclose(run.marker("A"), np.column_stack([np.cos(angle), np.sin(angle)]), atol=tolerance)


def test_radau5_is_not_slowed_down_by_strong_friction() -> None:
    """A flywheel, omega' = -1e6 omega: dop853 must take steps of microseconds, radau5 need not."""
    scene = DAMPED.with_values({"joints.O.friction": 1e6, "initial.R.rate": 1e3})
    run = simulate(_with(scene, "radau5", 1e-7), np.array([1.0]))
    assert run.ok, run.message
    assert run.angle("R")[0] == pytest.approx(1e-3, abs=1e-11)
    assert run.steps < 1000
    assert not simulate(_with(scene, "dop853", 1e-7, max_steps=10_000), np.array([1.0])).ok


def test_radau5_is_not_slowed_down_by_fast_vibrations() -> None:
    """Rods a million times stiffer, with vibrations of up to 3e6 rad/s, move as rigid ones do."""
    stiff = FLEXIBLE.with_values({"bodies.OA.youngs_modulus": 2e14, "bodies.AB.youngs_modulus": 2e14})
    run = simulate(_with(stiff, "radau5", relative_tolerance=1e-4, absolute_tolerance=1e-4), np.array([0.5]))
    assert run.ok, run.message
    np.testing.assert_allclose(run.marker("B")[-1], [2.859504, 0.605406], atol=1e-4)
    assert run.steps < 1000


@pytest.mark.parametrize("integrator", ADAPTIVE)
def test_too_many_steps_end_in_a_clear_status(integrator: str) -> None:
    times = np.array([0.1, 1.0])
    run = simulate(_with(RIGID, integrator, max_steps=20), times)
    assert run.status == (Status.FAILED,)
    assert run.codes == ["steps-exhausted"]
    assert run.findings[0].numbers["steps"] == 20
    assert run.steps == 20
    assert np.all(np.isnan(run.points[-1]))


@pytest.mark.parametrize("integrator", ADAPTIVE)
def test_an_adaptive_run_takes_steps_up_to_the_longest_and_ends_on_time(integrator: str) -> None:
    free = simulate(_with(RIGID, integrator), np.array([0.5]))
    bound = simulate(_with(RIGID, integrator, 1e-3, max_step=1e-3), np.array([0.5]))
    assert free.steps < 400
    assert bound.steps in (500, 501)
    assert free.model["evaluations"] > free.steps
    np.testing.assert_allclose(free.points, bound.points, atol=1e-10)
    np.testing.assert_array_equal(free.points[-1], simulate(_with(RIGID, integrator), np.array([0.2, 0.5])).points[-1])


@pytest.mark.parametrize("name", ["rigid", "loop"])
@pytest.mark.parametrize("integrator", ADAPTIVE)
def test_what_friction_takes_is_counted_as_exactly_as_the_motion(integrator: str, name: str) -> None:
    run = simulate(_with(SCENES[name], integrator), np.array([1.0]))
    assert run.energy_drift[0] < 1e-8


@pytest.mark.parametrize(
    ("scene", "step", "chosen", "why"),
    [
        (RIGID, 1e-3, "dop853", "nothing is stiff"),
        (DAMPED, 0.1, "radau5", "faster than the step"),
        (FLEXIBLE, 5e-4, "leapfrog", "within the stability limit"),
        (FLEXIBLE, 5e-3, "generalized-alpha", "beyond the stability limit"),
    ],
)
def test_auto_says_what_it_chose_and_why(scene: Scene, step: float, chosen: str, why: str) -> None:
    times = np.array([0.01])
    run = simulate(_with(scene, "auto", step), times)
    assert run.model["integrator"] == chosen
    assert why in run.model["integrator_reason"]
    np.testing.assert_array_equal(run.points, simulate(_with(scene, chosen, step), times).points)


@pytest.mark.parametrize("radius", [0.0, 0.5, 0.9])
def test_generalized_alpha_is_of_second_order_at_any_spectral_radius(radius: float) -> None:
    times = np.array([0.2, 0.4])
    reference = simulate(_with(RIGID, "rk4", 1e-3), times).points
    errors = [
        np.abs(
            simulate(_with(RIGID, "generalized-alpha", step, spectral_radius=radius), times).points - reference
        ).max()
        for step in (2e-3, 1e-3)
    ]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2, abs=0.2)


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
@every_in_lanes
@pytest.mark.by_day(8)
def test_lanes_equal_singles(integrator: str, scene: Scene, values: dict[str, Any], lanes: int) -> None:
    # 2 lanes fill a tile by repetition, 19 need a second tile.
    ranges = {path: np.linspace(*span, lanes) for path, span in values.items() if span}
    scene = _with(_takes(integrator, scene), integrator, 4e-4, newton_tolerance=1e-12, energy_tolerance=0.1)
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
@every_in_lanes
def test_a_lane_that_diverges_leaves_its_neighbours_alone(integrator: str, scene: Scene, bad: int) -> None:
    scene, times = _with(_takes(integrator, scene), integrator, 4e-4), np.array([0.02, 0.04])
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


@pytest.mark.parametrize("integrator", [name for name in EXPLICIT if facts(name).stable_step_times_frequency > 0.0])
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


def test_an_integrator_that_is_stable_for_no_vibration_refuses_it_and_asks_for_no_smaller_step() -> None:
    with pytest.raises(InputError, match=r"^solver\.integrator: heun is stable at no step") as refusal:
        check_step(FLEXIBLE, Choice("heun", "named by the scene", 0.0), build(FLEXIBLE))
    assert "smaller" not in str(refusal.value)


@every
def test_an_integrator_stays_within_the_room_of_four_states(integrator: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Beyond `w.stage` lies the memory of others; what needs more room has arrays in its settings."""
    work_space, gathered, rooms = workspace.work_space, workspace.gathered, []

    def roomier(*arguments: Any) -> Any:
        room = work_space(*arguments)
        return room._replace(stage=np.concatenate([room.stage, np.full(room.stage.size, 7.0)]))

    def kept(*arguments: Any) -> Any:
        block, found = gathered(*arguments)
        rooms.append(found[0])
        return block, found

    monkeypatch.setattr(workspace, "work_space", roomier)
    monkeypatch.setattr(workspace, "gathered", kept)
    scene = SOFT if facts(integrator).stable_step_times_frequency > 0.0 else RIGID
    assert simulate(_with(scene, integrator, 4e-4, energy_tolerance=0.123), np.array([0.0123])).ok
    assert [np.all(room.stage[room.stage.size // 2 :] == 7.0) for room in rooms] == [True]


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


@pytest.mark.parametrize("integrator", EXPLICIT)
def test_an_accepted_step_damps_and_does_not_excite(integrator: str) -> None:
    """A flywheel in a bearing, omega' = -100 omega: the angle ends at 0.01 rad and the step limit is honest."""
    limit = simulate(_with(DAMPED, integrator, 1e-4), np.array([1e-3])).model["stability_limit"]
    run = simulate(_with(DAMPED, integrator, 0.999 * limit), np.array([20.0]))
    # The first order is stable there, but at its limit the new rate is the old one turned round.
    assert run.angle("R")[0] == pytest.approx(0.01, abs=5e-3 if facts(integrator).order > 1 else 2.2e-2)


@pytest.mark.parametrize("integrator", [name for name in INTEGRATORS if not facts(name).adaptive])
@pytest.mark.parametrize("late", [1e-13, 1e-11, 1e-9, 1e-7])
def test_a_step_may_be_cut_as_short_as_a_jump_asks(integrator: str, late: float) -> None:
    """Accelerations as differences of places over the square of such a step would be round-off."""
    rod = {"kind": "rod", "length": 0.5, "height": 0.02, "width": 0.02, "density": 7850.0}
    data = {
        "name": "jump",
        "bodies": {"one": rod, "two": rod},
        "joints": {
            "O": {"kind": "revolute", "first": {"body": "ground", "point": [0.3, 0.1]}, "second": {"body": "one"}},
            "A": {"kind": "revolute", "first": {"body": "one", "point": "end"}, "second": {"body": "two"}},
        },
        "markers": {"tip": {"body": "two", "point": "end"}},
        "loads": {"motor": {"kind": "torque", "at": {"body": "two"}, "torque": f"4*step(t - 0.1 - {late!r})"}},
        "initial": {"one": {"angle": 0.5}, "two": {"angle": -0.8}},
    }
    step = 1e-4 if facts(integrator).order == 1 else 1e-3
    runs = [
        simulate(Scene.parse({**data, "solver": {"integrator": name, "step": step, "duration": 0.3}}), np.array([0.3]))
        for name in (integrator, "dop853")
    ]
    assert runs[0].ok, runs[0].message
    bound = 10.0 * step if facts(integrator).order == 1 else 100.0 * step**2
    np.testing.assert_allclose(runs[0].marker("tip"), runs[1].marker("tip"), atol=bound)
