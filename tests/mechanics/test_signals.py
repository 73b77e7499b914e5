"""Loads that follow signals: feedback, computed torques, wind and friction laws, against closed forms and scipy.

The references were made with DOP853 of scipy at 3e-14 and Gauss's collocation of order 12, which agree to 1e-13.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from controlled import (
    AXIS,
    FINE,
    POST,
    ball,
    cart_pole,
    filtered,
    ground,
    in_space,
    on_rail,
    pendulum,
    rod,
    saturated,
    stribeck,
    two_link,
)
from shoal.engines import get_engine
from shoal.errors import InputError, UnstableStepError
from shoal.mechanics.analysis.evaluate import Evaluator
from shoal.mechanics.analysis.modes import modes
from shoal.mechanics.analysis.statics import statics
from shoal.mechanics.assembly.build import build
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene


def test_proportional_and_derivative_feedback() -> None:
    found = simulate(Scene.parse(pendulum()), np.array([0.05, 0.2, 0.5, 1.0, 2.0]))
    angle = [0.3056879204592912, 0.8738106876494041, 0.9033422410592403, 0.8984726148687577, 0.8977255510239434]
    assert found.angles[:, 0, 0] + math.pi / 2 == pytest.approx(angle, abs=1e-10)
    assert found.ok
    assert found.energy_drift[0] < 1e-8


def test_a_regulator_holds_a_pole_upright() -> None:
    found = simulate(Scene.parse(cart_pole()), np.array([0.1, 0.5, 1.0, 2.0, 4.0]))
    x = [0.054421503591930626, 0.3311245978481899, 0.2553229658667395, 0.022357501561871062, -0.00048060257833727814]
    phi = [0.203453150425277, -0.13251302386155114, -0.03207946693879945, 0.021851891840485433, -0.0003074070613766779]
    assert found.points[:, 0, 0, 0] == pytest.approx(x, abs=1e-9)
    assert math.pi / 2 - found.angles[:, 1, 0] == pytest.approx(phi, abs=1e-9)


def test_computed_torques_leave_the_errors_that_they_promise() -> None:
    """A sign, or a relative angle that is taken for an absolute one, breaks the closed form."""
    t = np.array([0.05, 0.2, 0.5, 1.0])
    found = simulate(Scene.parse(two_link()), t)
    w = math.sqrt(84.0)
    first = 0.3 * np.sin(2 * t) + 0.2 * (1 + 10 * t) * np.exp(-10 * t)
    second = 0.5 - 0.4 * np.cos(3 * t) - 0.1 * np.exp(-4 * t) * (np.cos(w * t) + 4 / w * np.sin(w * t))
    assert found.angles[:, 0, 0] == pytest.approx(first, abs=1e-10)
    assert found.angles[:, 1, 0] - found.angles[:, 0, 0] == pytest.approx(second, abs=1e-10)


def test_drag_against_wind() -> None:
    found = simulate(Scene.parse(ball()), np.array([0.5, 1.0, 2.0, 4.0]))
    x = [12.441461318754053, 22.177665001725835, 38.209733318697495, 61.66035906778614]
    y = [8.119339932872448, 11.26460937820482, 9.623920302995554, -14.426549520960473]
    assert found.points[:, 0, 0, 0] == pytest.approx(x, abs=1e-9)
    assert found.points[:, 0, 1, 0] == pytest.approx(y, abs=1e-9)


def test_friction_by_a_law_of_its_own() -> None:
    found = simulate(Scene.parse(stribeck()), np.array([0.2, 0.5, 1.0, 2.0]))
    x = [0.04483970252600786, 0.04461792965559237, 0.04730800166176655, 0.06782904008090142]
    assert found.points[:, 0, 0, 0] == pytest.approx(x, abs=1e-8)
    assert found.energy_drift[0] < 1e-6


@pytest.mark.parametrize("size", [1.0, 5.0])
def test_a_saturated_controller_with_an_integral(size: float) -> None:
    """Piecewise linear: by matrix exponentials between the switches."""
    found = simulate(Scene.parse(saturated(size)), np.array([0.1, 0.3, 0.6, 1.0, 2.0, 4.0]))
    x = [
        0.0196491350633744,
        0.170772032337347,
        0.6145868678721135,
        1.06830184252287,
        1.031480501193049,
        1.00107241343038,
    ]
    assert found.points[:, 0, 0, 0] == pytest.approx(x, abs=1e-10)
    assert found.energy_drift[0] < 1e-7


def test_a_transfer_function_as_states() -> None:
    found = simulate(Scene.parse(filtered()), np.array([0.1, 0.3, 1.0, 3.0]))
    x = [0.20137211964410195, 1.1080838993989486, 0.6492363457029577, 0.9708607064948382]
    assert found.points[:, 0, 0, 0] == pytest.approx(x, abs=1e-9)


@pytest.mark.parametrize(("integrator", "order"), [("rk4", 4), ("leapfrog", 2), ("semi-implicit-euler", 1)])
def test_states_keep_the_order_of_the_integrator(integrator: str, order: int) -> None:
    """x' = cos(3 t) - x from 0.5, beside a machine that it pushes."""
    errors = []
    for step in (2e-3, 1e-3):
        data = on_rail(1.0, 0.2, "x", states={"x": {"rate": "cos(3*t) - x + 0*slide(rail)", "start": 0.5}})
        solver = {"integrator": integrator, "step": step, "duration": 1.0}
        errors.append(float(simulate(Scene.parse({**data, "solver": solver}), np.array([1.0])).points[0, 0, 0, 0]))
    fine = simulate(Scene.parse(data), np.array([1.0]))
    rate = math.log2(abs(errors[0] - fine.points[0, 0, 0, 0]) / abs(errors[1] - fine.points[0, 0, 0, 0]))
    assert rate == pytest.approx(order, abs=0.4)


def test_lanes_may_start_with_states_and_have_sizes_of_their_own() -> None:
    scene = Scene.parse(on_rail(1.0, 0.0, "x", states={"x": {"rate": "-3*x", "start": 1.0}}))
    starts, sizes, times = np.array([1.0, -2.0]), np.array([1.0, 4.0]), np.array([1.0])
    found = simulate(scene, times, {"states.x.start": starts, "states.x.size": sizes})
    exact = starts * (1.0 / 3 - (1 - math.exp(-3.0)) / 9)
    assert found.points[0, 0, 0] == pytest.approx(exact, abs=1e-10)


@pytest.mark.parametrize("integrator", ["rk4", "leapfrog", "dop853"])
def test_lanes_are_single_runs(integrator: str) -> None:
    """Gains that lanes differ in are registers of the tape, in single runs as well; tiles round a mass otherwise."""
    solver = {**FINE, "integrator": integrator, "step": 1e-3, "duration": 0.1}
    scene = Scene.parse({**pendulum("kp*(ref - phi)*tanh(t + phi) - 6*rate(hinge)", kp=60.0), "solver": solver})
    times, gains = np.array([0.05, 0.1]), np.linspace(40.0, 60.0, 16)
    side_by_side = simulate(scene, times, {"signals.kp": gains})
    for lane in (0, 7, 15):
        alone = simulate(scene.with_values({"signals.kp": gains[lane]}), times)
        assert side_by_side.points[..., lane] == pytest.approx(alone.points[..., 0], abs=1e-11)


def swung() -> dict[str, Any]:
    """Two rods with a motor in each hinge and a spring between places by formulas, without time."""
    data = two_link()
    data["signals"] = {"k": 30.0, "aim": "0.3 - tanh(angle(elbow))", "lever": "position(elbow, x)"}
    data["loads"] = {
        "first": {"kind": "torque", "at": {"body": "upper"}, "torque": "k*(aim - angle(shoulder)) - 2*rate(shoulder)"},
        "second": {
            "kind": "torque", "at": {"body": "fore"}, "reaction": {"body": "upper"},
            "torque": "min(max(5*(0.2 - angle(fore)) - rate(fore), -2), 2)",
        },
        "pull": {
            "kind": "force", "at": {"body": "fore", "point": "end"}, "force": [0.3, 1], "follows": True,
            "scale": "3*distance(hand, ground) - velocity(hand, y)*abs(distance_rate(hand, ground)) + lever",
        },
    }  # fmt: skip
    return data


def test_casadi_agrees_on_what_loads_follow() -> None:
    """Its equations are those of Lagrange in angles, with the formulas as its own expressions, by CVODES."""
    pytest.importorskip("casadi")
    scene, times = Scene.parse(swung()), np.array([0.5, 1.0])
    ours, theirs = simulate(scene, times), get_engine("casadi").simulate(scene, times)
    assert theirs.ok
    assert theirs.points == pytest.approx(ours.points, abs=1e-7)
    with pytest.raises(InputError, match=r"loads.first.torque: engine casadi cannot do functions of time"):
        get_engine("casadi").simulate(Scene.parse(two_link()))


@pytest.mark.parametrize(("integrator", "order"), [("rk4", 4), ("leapfrog", 2)])
def test_fixed_steps_keep_their_order(integrator: str, order: int) -> None:
    times, exact = np.array([0.5]), 0.9033422410592403 - math.pi / 2
    solver = {"integrator": integrator, "duration": 0.5}
    errors = []
    for step in (2e-3, 1e-3):
        found = simulate(Scene.parse({**pendulum(), "solver": {**solver, "step": step}}), times)
        errors.append(abs(float(found.angles[0, 0, 0]) - exact))
    assert math.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.3)


def bounced(t: float) -> float:
    """Place under a force of 1 N below 0.1 m and of -5 N above, from rest at 0 m: 1 kg comes and goes for ever."""
    arrives = rate = math.sqrt(0.2)
    if t < arrives:
        return t * t / 2
    above = 2 * rate / 5
    since = (t - arrives) % (above + 2 * rate)
    if since < above:
        return 0.1 + rate * since - 2.5 * since**2
    return 0.1 - rate * (since - above) + (since - above) ** 2 / 2


@pytest.mark.parametrize("integrator", ["rk4", "leapfrog", "generalized-alpha", "dop853", "radau5"])
def test_steps_end_where_a_signal_jumps(integrator: str) -> None:
    """All of these are exact between the jumps: nothing is lost at a jump, however long the step."""
    times = np.linspace(0.3, 6.0, 12)
    data = on_rail(1.0, 0.0, "1 - 6*step(slide(rail) - 0.1)")
    data["solver"] = {"integrator": integrator, "step": 1e-2, "duration": 6.0}
    found = simulate(Scene.parse(data), times)
    exact = [bounced(t) for t in times]
    assert found.points[:, 0, 0, 0] == pytest.approx(exact, abs=1e-8)
    assert found.energy_drift[0] < 1e-8


def test_a_saturation_costs_no_order() -> None:
    x, errors = [0.6145868678721135, 1.06830184252287], []
    for step in (4e-3, 2e-3):
        solver = {"integrator": "rk4", "step": step, "duration": 1.0}
        found = simulate(Scene.parse({**saturated(), "solver": solver}), np.array([0.6, 1.0]))
        errors.append(float(np.max(np.abs(found.points[:, 0, 0, 0] - x))))
    assert math.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.3)


@pytest.mark.parametrize(
    "scale",
    [
        "-2 - 3*sign(slide(rail) - 0.1)",
        "1 - 6*step(step(slide(rail) - 0.1) - 0.5)",
        "1 - 6*max(min(step(slide(rail) - 0.1), 3), 0.5) + 3*low",
    ],
)
def test_switches_that_depend_on_switches(scale: str) -> None:
    data = on_rail(1.0, 0.0, scale, signals={"low": "1 - step(slide(rail) - 0.1)"})
    data["solver"] = {"integrator": "rk4", "step": 1e-2, "duration": 2.0}
    found = simulate(Scene.parse(data), np.array([1.0, 2.0]))
    assert found.points[:, 0, 0, 0] == pytest.approx([bounced(1.0), bounced(2.0)], abs=1e-8)


def test_jumps_of_time_and_of_the_state_meet() -> None:
    """A switch whose argument jumps with time is set anew there."""
    data = on_rail(1.0, 0.0, "step(aim - slide(rail))", signals={"aim": "-1 + 2*step(t - 0.5)"})
    data["solver"] = {"integrator": "rk4", "step": 0.03, "duration": 1.5}
    found = simulate(Scene.parse(data), np.array([0.5, 1.5]))
    assert found.points[:, 0, 0, 0] == pytest.approx([0.0, 0.5], abs=1e-12)


@pytest.mark.parametrize(
    ("scale", "place"), [("step(slide(rail))", 0.5), ("sign(slide(rail))", 0.0), ("-step(-slide(rail))", -0.5)]
)
def test_a_switch_at_zero_at_the_start_is_above(scale: str, place: float) -> None:
    """As step(0) is 1 and sign(0) is 0."""
    data = on_rail(1.0, 0.0, scale)
    for integrator in ("rk4", "dop853"):
        data["solver"] = {"integrator": integrator, "step": 1e-2, "duration": 1.0}
        found = simulate(Scene.parse(data), np.array([1.0]))
        assert found.points[0, 0, 0, 0] == pytest.approx(place, abs=1e-10)


def test_lanes_that_switch_are_run_one_by_one() -> None:
    scene = Scene.parse(on_rail(1.0, 0.0, "1 - jump*step(slide(rail) - 0.1)", signals={"jump": 6.0}))
    found = simulate(scene, np.array([1.0, 2.0]), {"signals.jump": np.array([6.0, 2.0])})
    assert found.points[:, 0, 0, 0] == pytest.approx([bounced(1.0), bounced(2.0)], abs=1e-10)
    alone = simulate(scene.with_values({"signals.jump": 2.0}), np.array([1.0, 2.0]))
    assert np.array_equal(found.points[..., 1], alone.points[..., 0])


def test_a_relay_that_slides_along_its_line_chatters() -> None:
    """It reaches the line x + v = 0 at 1 - 5 t - 2.5 t^2 = 0, and both laws lead back there."""
    data = on_rail(1.0, 0.0, "-5*(2*step(slide(rail) + slide_rate(rail)) - 1)")
    data["initial"] = {"mass": {"position": [1.0, 0.0]}}
    for integrator in ("rk4", "dop853"):
        found = simulate(Scene.parse({**data, "solver": {"integrator": integrator, "duration": 1.0}}), np.array([1.0]))
        assert not found.ok
        assert found.findings[0].kind.code == "chatters"
        assert found.findings[0].numbers["time"] == pytest.approx((math.sqrt(35.0) - 5.0) / 5.0, abs=1e-6)


@pytest.mark.parametrize("make", [cart_pole, two_link, saturated, filtered, in_space])
def test_implicit_integrators_follow_signals(make: Any) -> None:
    """Newton's method takes their exact derivatives: where all is linear, one change and one to see that it was all."""
    times, data = np.array([0.2, 0.5]), make()
    exact = simulate(Scene.parse(data), times)
    solver = {"duration": 0.5, "relative_tolerance": 1e-9, "absolute_tolerance": 1e-9}
    radau = simulate(Scene.parse({**data, "solver": {**solver, "integrator": "radau5"}}), times)
    assert radau.ok
    assert radau.points == pytest.approx(exact.points, abs=1e-7)
    errors = []
    for step in (2e-3, 1e-3):
        alpha = Scene.parse({**data, "solver": {**solver, "integrator": "generalized-alpha", "step": step}})
        found = simulate(alpha, times)
        errors.append(float(np.max(np.abs(found.points - exact.points))))
        assert found.model["evaluations"] <= (2 if make is filtered else 4) * found.steps
    assert math.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.5 if make is saturated else 0.3)  # a kink


def test_feedback_much_faster_than_the_step() -> None:
    """Of a controller with a million times the gains, and a filter of a microsecond, nothing is left but its aim."""
    data = on_rail(
        1.0,
        0.0,
        "1e8*(wanted - slide(rail)) + 2e4*(wanted_rate - slide_rate(rail))",
        signals={"wanted": "0.1*sin(3*t)", "wanted_rate": "0.3*cos(3*t) + lag - lag_now", "lag_now": "sin(2*t)"},
        states={"lag": {"rate": "1e6*(sin(2*t) - lag)"}},
    )
    data["initial"] = {"mass": {"position": [0.0, 0.0], "velocity": [0.3, 0.0]}}
    for integrator in ("radau5", "generalized-alpha", "auto"):
        data["solver"] = {"integrator": integrator, "duration": 1.0, "step": 1e-2}
        found = simulate(Scene.parse(data), np.array([0.5, 1.0]))
        assert found.ok
        assert found.points[:, 0, 0, 0] == pytest.approx(0.1 * np.sin([1.5, 3.0]), abs=1e-5)
        assert found.steps < 500
    assert found.model["integrator"] == "radau5"
    with pytest.raises(UnstableStepError, match=r"solver.step: 0.01 s is beyond the stability limit"):
        simulate(Scene.parse({**data, "solver": {"integrator": "rk4", "step": 1e-2}}), np.array([1.0]))


def test_a_spring_that_is_stated_as_a_signal_is_that_spring() -> None:
    """Whole turns of an angle are counted, and distances are those of markers."""
    stated, turned = pendulum("3*(20 - angle(hinge))"), pendulum("0*t")
    spring = {"kind": "torsion-spring", "first": ground(0, 0), "second": {"body": "arm"}, "stiffness": 3, "angle": 20}
    turned["loads"] = {"motor": spring}
    times = np.linspace(0.0, 4.0, 9)
    one, other = (simulate(Scene.parse(each), times) for each in (stated, turned))
    assert np.max(one.angles) > 2 * math.pi
    assert one.points == pytest.approx(other.points, abs=1e-8)


def test_a_hinge_in_space_with_a_motor_is_one_with_a_spring_and_a_damper() -> None:
    spring = {
        "kind": "torsion-spring", "first": ground(0, 0, 0), "second": {"body": "arm"}, "axis": AXIS,
        "stiffness": 8, "damping": 0.5, "angle": 0.3,
    }  # fmt: skip
    times = np.linspace(0.0, 1.0, 5)
    one, other = (
        simulate(Scene.parse(in_space(turn=each, post=POST)), times) for each in (in_space()["loads"]["turn"], spring)
    )
    assert one.points == pytest.approx(other.points, abs=1e-9)


def test_what_depends_on_time_alone_is_a_function_of_time() -> None:
    """Its jumps are ends of steps, and nothing of it is evaluated by the tape."""
    scene = Scene.parse(pendulum("2*late + 1", late="step(t - 0.3)"))
    model = build(scene, horizon=1.0)
    assert not model.signals
    assert 0.3 in model.kinks[0]
    of_both: Any = build(Scene.parse(pendulum("late*phi", late="step(t - 0.3)*sin(t)")), horizon=1.0)
    assert of_both.signals.size == 2  # of angle + pi/2, times the function
    assert 0.3 in of_both.kinks[0]


def test_equal_parts_are_evaluated_once() -> None:
    scene = Scene.parse(pendulum("a + b + a", a="sin(phi)*rate(hinge)", b="sin(phi)*3"))
    found: Any = build(scene).signals
    assert found.size <= 7


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"signals": {"a": "2*b", "b": "a + 1"}}, "signals.a: depends on itself: a -> b -> a"),
        ({"signals": {"a": "a"}}, "signals.a: depends on itself: a -> a"),
        ({"signals": {"sin": 1.0}}, "signals.sin: the name is taken by formulas"),
        ({"signals": {"angle": 1.0}}, "signals.angle: the name is taken"),
        ({"signals": {"t": 1.0}}, "signals.t: the name is taken"),
        ({"signals": {"a-b": 1.0}}, "signals.a-b"),
        ({"torque": "kp*t"}, "loads.motor.torque: 'kp*t' has 'kp', which is not known"),
        ({"torque": "angle(knee)"}, "loads.motor.torque: angle(knee): no joint or body 'knee'"),
        ({"torque": "slide(hinge)"}, "loads.motor.torque: slide(hinge): joint 'hinge' is revolute"),
        ({"torque": "angle(hinge, x)"}, "angle takes the name of a part"),
        ({"torque": "angle(2*hinge)"}, "angle takes the name of a part"),
        ({"torque": "angle(" + "-" * 300 + "x)"}, "angle takes the name of a part"),
        ({"torque": "force(hinge, x)"}, "force depends on the forces of the same instant"),
        ({"torque": "position(tip, z)"}, "the axis is x or y, found 'z'"),
        ({"torque": "distance(tip, tip)"}, "both are one place"),
        ({"torque": "velocity(top, x)"}, "no marker, body or point of the ground 'top'; there are tip"),
        ({"bodies": {"hinge": rod(0.1, 1.0)}}, "'hinge' is the name of a joint and of a body"),
        ({"markers": {"arm": {"body": "arm", "point": "end"}}, "torque": "position(arm, x)"}, "of another place"),
        ({"signals": {f"s{k}": f"s{k + 1}*s{k + 1}" for k in range(20)} | {"s20": "t"}}, "too long where signals"),
        ({"signals": {f"s{k}": f"s{k + 1} + 1" for k in range(300)} | {"s300": "t"}}, "too long where signals"),
        ({"states": {"x": {"rate": "-y"}}}, "states.x.rate: '-y' has 'y', which is not known; there are ref, phi, x"),
        ({"states": {"phi": {"rate": 1.0}}}, "states.phi: there is a signal of this name"),
        ({"states": {"max": {"rate": 1.0}}}, "states.max: the name is taken by formulas"),
        ({"states": {"x": {"rate": 1.0, "size": 0.0}}}, "states.x.size"),
        ({"joints": {"drive": {"kind": "driven-angle", "angle": "phi"}}}, "'phi', which is not known; the time is `t`"),
    ],
)
def test_refused_in_one_line(changes: dict[str, Any], why: str) -> None:
    data = pendulum(changes.get("torque", "phi"))
    data["states"] = {}
    for part in ("signals", "markers", "bodies", "states"):
        data[part] |= changes.get(part, {})
    for name, joint in changes.get("joints", {}).items():
        data["joints"][name] = {"first": {"body": "ground"}, "second": {"body": "arm"}, **joint}
    with pytest.raises(InputError) as caught:
        Scene.parse(data)
    assert why in str(caught.value)
    assert "\n" not in str(caught.value)


def test_names_of_parts_may_hold_hyphens() -> None:
    data = pendulum('angle("left-hinge") - rate(left-hinge)')
    data["joints"] = {"left-hinge": data["joints"]["hinge"]}
    data["signals"] = {}
    assert Scene.parse(data).value("loads.motor.torque").expression == 'angle("left-hinge") - rate(left-hinge)'


def test_a_regulated_machine_rests_and_has_the_poles_of_its_design() -> None:
    """The force on the cart depends on the pole's angle: the stiffness is not symmetric. Poles of A - B K by scipy."""
    data = cart_pole()
    scene = Scene.parse(data)
    assert statics(scene).ok
    found = {complex(one.eigenvalue) for one in modes(scene).modes}
    poles = [-10.228790759344744, -3.660592544780669, -2.016472871746828 + 1.4737089005978206j]
    assert sorted(found, key=abs) == pytest.approx(sorted(poles, key=abs), rel=1e-9)
    data["loads"] = {}
    assert not statics(Scene.parse(data), leave_unstable=False).ok


def test_rest_under_feedback_is_that_of_the_balance_and_where_the_motion_ends() -> None:
    scene = Scene.parse(pendulum())
    rest = statics(scene)
    assert rest.angles[0] + math.pi / 2 == pytest.approx(0.8977259964356257, abs=1e-9)
    started = Scene.parse({**pendulum(), "initial": {"from": "statics", "arm": {"angle": 0.0}}})
    still = simulate(started, np.array([1.0]))
    assert still.points[0, 0, :, 0] == pytest.approx(rest.points[0], abs=1e-9)


@pytest.mark.parametrize("dimensions", [2, 3])
def test_derivatives_of_loads_that_follow_signals(dimensions: int) -> None:
    """Stiffness and damping are minus the differences of forces, of all kinds of loads and measures."""
    data = in_space() if dimensions == 3 else two_link()
    if dimensions == 2:
        tip = {"body": "fore", "point": "end"}
        data["loads"]["along"] = {
            "kind": "force", "at": tip, "force": [2, 1], "follows": True,
            "scale": "sin(u1) + distance(hand, elbow)**2 + distance_rate(hand, ground) + position(hand, y)",
        }  # fmt: skip
    model = build(Scene.parse(data), horizon=1.0)
    evaluator = Evaluator(model)
    rng, n = np.random.default_rng(3), model.unknowns
    q = model.q0[:, 0] + 0.05 * rng.standard_normal(n)
    none, h = np.zeros(n), 1e-6
    stiffness = np.stack(
        [(evaluator.force(q - x, none) - evaluator.force(q + x, none)) / (2 * h) for x in h * np.eye(n)], 1
    )
    damping = np.stack([(evaluator.force(q, -x) - evaluator.force(q, x)) / (2 * h) for x in h * np.eye(n)], 1)
    for found, exact in ((evaluator.stiffness(q), stiffness), (evaluator.damping(q), damping)):
        assert found.toarray() == pytest.approx(exact, abs=1e-6 * np.max(np.abs(exact)))
    assert np.max(np.abs(stiffness - stiffness.T)) > 1e-3 * np.max(np.abs(stiffness))


def test_what_a_swarm_cannot_weigh_is_refused() -> None:
    swarm = {"solver.acceleration": "afsa", "solver.duration": 0.01, "solver.integrator": "auto"}
    with pytest.raises(InputError, match=r"solver.acceleration: swarms know no states, as states.integral"):
        get_engine("gauss").simulate(Scene.parse(saturated()).with_values(swarm))


@pytest.mark.parametrize("integrator", ["dop853", "radau5", "rk4"])
def test_a_formula_without_a_value_from_the_start_ends_the_motion_there(integrator: str) -> None:
    data = pendulum("log(-1 - angle(hinge)**2)")
    data["solver"] = {"integrator": integrator, "duration": 2.0}
    found = simulate(Scene.parse(data), np.array([2.0]))
    assert found.findings[0].code == "not-finite"
    assert found.findings[0].numbers["time"] == 0.0
