"""Stops of joints against closed forms: times of impacts, accumulations, rest, order of the integrators, energy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from shoal.engines import get_engine
from shoal.errors import InputError
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene
from shoal.scene.ended import End

DOWN = -np.pi / 2
IMPACTS = {1: 0.3869629747639665, 2: 1.112658251636977, 3: 1.794281882363803, 5: 3.0194688911902183,
           10: 5.122573189376642}  # fmt: skip
"""Times [s] at which a uniform rod of 1 m, let go at 60 degrees, strikes a stop at 0.2 rad, restitution 0.8: elliptic
integrals to 40 digits."""
RESTS = 6.456691947419185
"""When it comes to rest on the stop [s]."""
SECTION = {"kind": "rigid-body", "mass": 1.0, "inertia": 1 / 12, "centre_of_mass": [0.5, 0.0],
           "named_points": {"end": [1.0, 0.0]}}  # fmt: skip


def rod(restitution: float = 0.8, *, duration: float = 10.0, **solver: Any) -> Scene:
    """The rod, hanging on a pin of the ground."""
    pin = {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "B"},
           "stops": {"min": DOWN + 0.2, "restitution": restitution}}  # fmt: skip
    return Scene.parse({"name": "rod", "gravity": [0.0, -9.81], "bodies": {"B": SECTION}, "joints": {"O": pin},
                        "markers": {"P": {"body": "B", "point": "end"}},
                        "initial": {"B": {"angle": DOWN + np.pi / 3, "rate": 0.0}},
                        "solver": {"duration": duration, **solver}})  # fmt: skip


def impacts(scene: Scene) -> np.ndarray[Any, Any]:
    found = simulate(scene, np.array([scene.solver.duration]))
    assert found.ok, found.message
    return np.array([event["time"] for event in found.model["events"] if event["kind"] == "impact"])


@pytest.mark.compiles("kernels of contacts, which few machines need")
def test_impacts_accumulate_and_the_rod_rests_on_the_stop() -> None:
    found = simulate(rod(), np.array([10.0]))
    times = [event["time"] for event in found.model["events"]]
    for number, time in IMPACTS.items():
        assert times[number - 1] == pytest.approx(time, abs=1e-11)
    assert 40 < len(times) < 80
    # Hops that are left out are lower than 1e-12 rad.
    assert times[-1] == pytest.approx(RESTS, abs=2e-5)
    assert found.angles[0, 0, 0] == pytest.approx(DOWN + 0.2, abs=1e-15)
    assert found.rates is not None
    assert abs(found.rates[0, 0, 0]) < 1e-15
    assert found.energy_drift[0] < 1e-11


@pytest.mark.parametrize(("integrator", "step", "order"), [("leapfrog", 0.01, 2), ("rk4", 0.02, 4)])
def test_an_integrator_keeps_its_order_through_impacts(integrator: str, step: float, order: int) -> None:
    errors = [abs(impacts(rod(duration=3.5, integrator=integrator, step=h))[4] - IMPACTS[5]) for h in (step, step / 2)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.3)


@pytest.mark.slow  # compiles kernels of lanes
def test_lanes_with_events_of_their_own_move_as_they_would_alone() -> None:
    values = np.array([0.0, 0.3, 0.5, 0.8, 0.9, 1.0])
    times = np.linspace(0.1, 3.0, 30)
    scene = rod(relative_tolerance=1e-12)
    together = get_engine("gauss").simulate_many(scene, {"joints.O.stops.restitution": values}, times)
    assert together.ok
    for lane, value in enumerate(values):
        alone = simulate(rod(float(value), relative_tolerance=1e-12), times)
        np.testing.assert_allclose(together.points[..., lane], alone.points[..., 0], atol=1e-9)
        assert [what for _, what in together.words[lane]] == [what for _, what in alone.words[0]]


def test_a_perfect_stop_loses_nothing_and_repeats() -> None:
    times = impacts(rod(1.0, duration=8.0))
    np.testing.assert_allclose(np.diff(times), 2 * IMPACTS[1], atol=1e-10)


@pytest.mark.parametrize("dimensions", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_a_slider_bounces_between_two_stops(dimensions: int) -> None:
    """On a line of 30 degrees, against a lower and an upper stop, in the plane and in space."""
    slope, kept = np.pi / 6, 0.9
    line = {"direction": slope} if dimensions == 2 else {"axis": [np.cos(slope), np.sin(slope), 0.0]}
    body: dict[str, Any] = {"kind": "rigid-body", "mass": 2.0, "inertia": 0.1 if dimensions == 2 else [0.1, 0.1, 0.1]}
    slider = {"kind": "slider", "rotation": "locked", "first": {"body": "ground", "point": [0.0] * dimensions},
              "second": {"body": "B"}, "stops": {"min": -0.5, "max": 0.3, "restitution": kept}, **line}  # fmt: skip
    along = np.array([np.cos(slope), np.sin(slope), 0.0][:dimensions])
    scene = Scene.parse({"name": "slider", "dimensions": dimensions, "gravity": [0.0, -9.81, 0.0][:dimensions],
                         "bodies": {"B": body}, "joints": {"S": slider}, "markers": {"P": {"body": "B"}},
                         "initial": {"B": {"velocity": (3.0 * along).tolist()}},
                         "solver": {"duration": 2.0}})  # fmt: skip
    found = simulate(scene, np.array([2.0]))
    assert found.ok, found.message
    x, v, t, pull, expected = 0.0, 3.0, 0.0, -9.81 * np.sin(slope), []
    while t < 2.0:
        roots = [r.real for stop in (-0.5, 0.3) for r in np.roots([pull / 2, v, x - stop]) if abs(r.imag) < 1e-9]
        step = min(r for r in roots if r > 1e-9)
        t, x, v = t + step, x + v * step + pull / 2 * step**2, -kept * (v + pull * step)
        expected.append(t)
    assert [e["time"] for e in found.model["events"]] == pytest.approx([t for t in expected if t < 2.0], abs=1e-10)


def test_a_linkage_strikes_as_the_pendulum_it_is() -> None:
    """A parallelogram moves as one pendulum; its stop is on one crank, its joints take part in the impact."""
    bar = SECTION | {"named_points": {"end": [1.0, 0.0]}}
    joints: dict[str, Any] = {}
    for k, name in enumerate(("a", "b")):
        joints[f"foot-{name}"] = {"first": {"body": "ground", "point": [1.0 * k, 0.0]}, "second": {"body": name}}
        head = {"body": "c", "point": "end" if k else "start"}
        joints[f"head-{name}"] = {"first": {"body": name, "point": "end"}, "second": head}
    joints["foot-b"]["stops"] = {"min": DOWN - 0.3, "max": DOWN + 0.4, "restitution": 0.6}
    start = {"a": {"angle": DOWN - 0.1, "rate": 4.0}, "b": {"angle": DOWN - 0.1, "rate": 4.0}}
    scene = Scene.parse({"name": "p", "gravity": [0.0, -9.81], "bodies": dict.fromkeys("abc", bar), "joints": joints,
                         "markers": {"P": {"body": "c"}}, "initial": start, "solver": {"duration": 1.5}})  # fmt: skip
    found = simulate(scene, np.array([1.5]))
    assert found.ok, found.message
    assert found.energy_drift[0] < 1e-10
    # Two cranks and the coupler about the angle x from the downward vertical.
    inertia, moment, x, v, t, expected = 2 / 3 + 1.0, 2 * 0.5 + 1.0, -0.1, 4.0, 0.0, []
    while True:
        way = solved(lambda _, y: [y[1], -9.81 * moment / inertia * np.sin(y[0])], (t, 1.6), [x, v], rtol=1e-12,
                        atol=1e-13, dense_output=True, events=[_at(-0.3, -1), _at(0.4, 1)])  # fmt: skip
        times = [e[0] for e in way.t_events if len(e)]
        if not times or min(times) > 1.5:
            break
        t = min(times)
        x, v = way.sol(t)
        v *= -0.6
        expected.append(t)
    assert len(expected) >= 3
    assert [e["time"] for e in found.model["events"]] == pytest.approx(expected, abs=1e-8)


def solved(*arguments: Any, **options: Any) -> Any:
    """`scipy.integrate.solve_ivp`."""
    return solve_ivp(*arguments, **options)


def _at(place: float, direction: int) -> Any:
    def event(_: float, y: Any) -> float:
        return float(y[0] - place)

    event.terminal, event.direction = True, direction  # type: ignore[attr-defined]
    return event


def test_a_motor_lifts_the_rod_off_its_stop_when_its_torque_is_large_enough() -> None:
    """At rest on the stop until t = 0.5 s, when the torque that grows with t balances the weight."""
    pin = {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "B"}, "stops": {"min": DOWN + 0.2}}
    weight = 9.81 * 0.5 * np.sin(0.2)
    scene = Scene.parse({"name": "lifted", "gravity": [0.0, -9.81], "bodies": {"B": SECTION}, "joints": {"O": pin},
                         "loads": {"M": {"kind": "torque", "at": {"body": "B"}, "torque": f"{2 * weight}*t"}},
                         "markers": {"P": {"body": "B", "point": "end"}},
                         "initial": {"B": {"angle": DOWN + 0.2, "rate": 0.0}},
                         "solver": {"duration": 0.8}})  # fmt: skip
    found = simulate(scene, np.array([0.3, 0.8]))
    assert found.ok, found.message
    assert found.angles[0, 0, 0] == pytest.approx(DOWN + 0.2, abs=1e-14)
    (lift,) = [event["time"] for event in found.model["events"] if event["kind"] == "opens"]
    assert lift == pytest.approx(0.5, abs=1e-9)
    way = solved(lambda t, y: [y[1], 3 * (2 * weight * t - 9.81 * 0.5 * np.sin(y[0]))], (0.5, 0.8), [0.2, 0.0],
                    rtol=1e-12, atol=1e-14)  # fmt: skip
    assert found.angles[1, 0, 0] - DOWN == pytest.approx(way.y[0, -1], abs=1e-9)


@pytest.mark.slow  # compiles kernels of lanes
def test_derivatives_through_impacts_are_those_of_the_closed_form() -> None:
    """The angle after two impacts by the restitution: central differences of lanes against those of solved times."""
    lanes = 0.8 + np.array([-1e-4, 1e-4])
    scene = rod(duration=1.5, relative_tolerance=1e-13)
    found = get_engine("gauss").simulate_many(scene, {"joints.O.stops.restitution": lanes}, np.array([1.5]))
    expected = [_angle_after_two(float(value), 1.5) for value in lanes]
    ours = (found.angles[0, 0, 1] - found.angles[0, 0, 0]) / 2e-4
    assert ours == pytest.approx((expected[1] - expected[0]) / 2e-4, rel=1e-6)


def _angle_after_two(kept: float, end: float) -> float:
    """The angle [rad] by scipy's integrator and root finder."""
    t, state = 0.0, np.array([np.pi / 3, 0.0])
    for _ in range(2):
        way = solved(lambda _, y: [y[1], -1.5 * 9.81 * np.sin(y[0])], (t, t + 2.0), state, "DOP853", rtol=1e-13,
                        atol=1e-14, dense_output=True)  # fmt: skip
        grid = np.linspace(t + 0.05, t + 2.0, 200)
        first = int(np.argmax(way.sol(grid)[0] < 0.2))
        hit = brentq(lambda s, way=way: way.sol(s)[0] - 0.2, grid[first - 1], grid[first], xtol=1e-15)
        t, state = hit, way.sol(hit) * [1.0, -kept]
    way = solved(lambda _, y: [y[1], -1.5 * 9.81 * np.sin(y[0])], (t, end), state, "DOP853", rtol=1e-13, atol=1e-14)
    return float(way.y[0, -1] + DOWN)


BAD: dict[str, tuple[dict[str, Any], str]] = {
    "empty": ({}, "joints.O.stops: min or max is missing"),
    "crossed": ({"min": 1.0, "max": 0.5}, "joints.O.stops: min: must be below max, found 1 and 0.5"),
    "gains": ({"min": -2.0, "restitution": 1.5}, r"joints.O.stops.restitution.*1\.5"),
}


@pytest.mark.parametrize("stops", BAD)
def test_a_stop_that_is_none_is_refused_by_name(stops: str) -> None:
    value, message = BAD[stops]
    pin = {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "B"}, "stops": value}
    with pytest.raises(InputError, match=message):
        Scene.parse({"name": "p", "bodies": {"B": SECTION}, "joints": {"O": pin}})


def test_a_start_beyond_a_stop_is_refused_by_name() -> None:
    with pytest.raises(InputError, match=r"joints\.O\.stops\.min: the machine starts beyond this limit, at -1\.5"):
        simulate(rod().with_values({"initial.B.angle": -1.5}), np.array([1.0]))


def test_what_knows_no_stops_says_so() -> None:
    end = simulate(rod(), np.array([1.0])).end
    with pytest.raises(InputError, match=r"joints\.O\.stops: motions, .* take one-sided constraints, but not yet"):
        simulate(rod().model_copy(update={"initial_from": End.model_validate(dict(end))}), np.array([1.0]))
    with pytest.raises(InputError, match=r"solver\.integrator: radau5 knows no contacts, as of joints\.O\.stops"):
        simulate(rod(integrator="radau5"), np.array([1.0]))
    with pytest.raises(InputError, match=r"joints\.O\.stops: engine tree cannot do stops; use "):
        get_engine("tree").simulate(rod(), np.array([1.0]))


JUMPS = {
    "name": "jumps",
    "bodies": {"b": {"kind": "rigid-body", "mass": 1.0, "inertia": 0.1}},
    "contacts": {"floor": {"first": {"body": "b"}, "second": {"body": "ground", "line": 0.0}, "mu": 0.3}},
    "loads": {
        "push": {"kind": "force", "at": {"body": "b"}, "force": [1.0, 0.0], "scale": "10*step(t - 0.1)"},
        "up": {"kind": "force", "at": {"body": "b"}, "force": [0.0, 1.0], "scale": "20*step(t - 0.4)"},
    },
    "markers": {"b": {"body": "b"}},
    "initial": {"b": {"position": [0.0, 0.0], "velocity": [0.0, 0.0]}},
    "solver": {"duration": 0.5},
}


@pytest.mark.compiles("kernels of contacts, which few machines need")
@pytest.mark.parametrize("masses", [[1.0], np.linspace(0.5, 1.5, 5)])
def test_a_force_that_jumps_lets_a_block_slip_and_lifts_it(masses: Any) -> None:
    """It sticks up to 0.1 s, slips up to 0.4 s, and flies."""
    run = simulate(Scene.parse(JUMPS), np.array([0.5]), {"bodies.b.mass": np.array(masses)})
    assert all(status == "ok" for status in run.status)
    for lane, mass in enumerate(masses):
        slips, flies = 10.0 / mass - 0.3 * 9.81, 10.0 / mass
        x = 0.5 * slips * 0.3**2 + slips * 0.3 * 0.1 + 0.5 * flies * 0.1**2
        y = 0.5 * (20.0 / mass - 9.81) * 0.1**2
        np.testing.assert_allclose(run.points[0, 0, :2, lane], [x, y], atol=1e-9)


@pytest.mark.compiles("kernels of contacts, which few machines need")
def test_a_rope_does_not_push_where_a_torque_jumps() -> None:
    data = {
        "name": "winch",
        "bodies": {
            "drum": {"kind": "rigid-body", "mass": 5.0, "inertia": 0.06},
            "load": {"kind": "point-mass", "mass": 7.0},
        },
        "joints": {
            "axle": {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "drum"}},
            "rope": {"kind": "rope", "second": {"body": "load"},
                     "first": {"body": "drum", "point": [0.0, 0.0], "radius": 0.3, "side": "right"}},
        },
        "loads": {"m": {"kind": "torque", "at": {"body": "drum"}, "torque": "10 - 165*step(t - 0.1)"}},
        "markers": {"load": {"body": "load"}},
        "initial": {"drum": {"position": [0.0, 0.0]}, "load": {"position": [0.3, -2.2]}},
        "solver": {"duration": 0.3},
    }  # fmt: skip
    run = simulate(Scene.parse(data), np.array([0.3]))
    held = (10.0 / 0.3 - 7.0 * 9.81) / (7.0 + 0.06 / 0.3**2)
    y = -2.2 + held * (0.5 * 0.1**2 + 0.1 * 0.2) - 0.5 * 9.81 * 0.2**2
    assert run.marker("load")[0, 1] == pytest.approx(y, abs=1e-9)


@pytest.mark.compiles("kernels of contacts, which few machines need")
@pytest.mark.parametrize("masses", [[1.0], np.linspace(0.5, 1.5, 5)])
@pytest.mark.parametrize(
    ("ground", "kept", "expected"),
    [
        ({"y": "0.5*max(t - 0.1, 0)"}, 0.0, [0.0, 0.5 * 0.05]),
        ({"y": "0.5*max(t - 0.1, 0)"}, 0.6, [0.0, 0.8 * 0.05 - 0.5 * 9.81 * 0.05**2]),
        ({"y": "-2*max(t - 0.1, 0)"}, 0.0, [0.0, -0.5 * 9.81 * 0.05**2]),
        ({"x": "0.5*max(t - 0.1, 0)"}, 0.0, [0.5 * 0.3 * 9.81 * 0.05**2, 0.0]),
        ({"x": "0.5*max(t - 0.05, 0) - 1.2*max(t - 0.1, 0)"}, 0.0, [0.3 * 9.81 * 0.05**2, 0.0]),
    ],
    ids=["lifted", "thrown", "left", "dragged", "dragged-back"],
)
def test_a_block_on_ground_whose_speed_jumps(
    ground: dict[str, str], kept: float, expected: list[float], masses: Any
) -> None:
    """It is struck from below, left behind, or slips until the friction has the speed of the ground."""
    floor = {"first": {"body": "b"}, "second": {"body": "ground", "point": "table", "line": 0.0}, "mu": 0.3}
    data = JUMPS | {
        "loads": {}, "contacts": {"floor": floor | {"restitution": kept}},
        "ground_points": {"table": {"x": 0.0, "y": 0.0} | ground}, "solver": {"duration": 0.15},
    }  # fmt: skip
    run = simulate(Scene.parse(data), np.array([0.15]), {"bodies.b.mass": np.array(masses)})
    assert all(status == "ok" for status in run.status), run.message
    for lane in range(len(masses)):
        np.testing.assert_allclose(run.points[0, 0, :2, lane], expected, atol=1e-9)
