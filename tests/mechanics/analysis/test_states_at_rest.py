"""States of the user in equilibria, modes and linear models, against closed forms and scipy."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from shoal.errors import InputError
from shoal.mechanics.analysis.modes import modes
from shoal.mechanics.analysis.statics import statics
from shoal.mechanics.linear_model import linearize
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene

sys.path.insert(0, str(Path(__file__).parents[1]))
from controlled import ground, pendulum, saturated

INERTIA, WEIGHT = 2.0 * 0.8**2 / 3, 2.0 * 9.81 * 0.4
PID = "60*(ref - phi) - 6*rate(hinge) + sum"


def with_states(torque: str, **states: Any) -> Scene:
    return Scene.parse({**pendulum(torque), "states": states})


def ordered(values: Any) -> list[complex]:
    return sorted(map(complex, values), key=lambda one: (round(abs(one), 9), one.imag))


@pytest.mark.parametrize(("gain", "size"), [(1.0, 1.0), (1e3, 1e-3), (1e-3, 1.0)])
def test_an_integrator_rests_where_the_error_vanishes_and_carries_the_weight(gain: float, size: float) -> None:
    """J s^3 + kd s^2 + (kp + G cos 1) s + ki = 0; also where the state is thousands of its size."""
    torque = PID.replace("sum", f"{gain}*sum")
    scene = with_states(torque, sum={"rate": f"{30 / gain}*(ref - phi)", "size": size})
    rest = statics(scene)
    assert rest.ok
    assert rest.stable
    assert rest.angles[0] == pytest.approx(1.0 - math.pi / 2, abs=1e-10)
    assert rest.q[-1] * size * gain == pytest.approx(WEIGHT * math.sin(1.0), rel=1e-9)
    exact = np.roots([INERTIA, 6.0, 60.0 + WEIGHT * math.cos(1.0), 30.0])
    found = [one.eigenvalue for one in modes(scene).modes]
    assert ordered([*found, found[-1].conjugate()]) == pytest.approx(ordered(exact), rel=1e-10)


def test_a_machine_with_states_that_starts_at_rest_stays_there() -> None:
    scene = with_states(PID, sum={"rate": "30*(ref - phi)"})
    started = scene.with_values({"initial.from": "statics"})
    still = simulate(started, np.array([2.0]))
    assert still.points[0, 0, :, 0] == pytest.approx(statics(scene).points[0], abs=1e-9)


def test_an_integrator_with_an_error_left_does_not_rest() -> None:
    """A torque of 2 N m holds the arm at sin(phi) = 2 / G, and the integral grows by 30 times the error."""
    scene = with_states(f"min(max({PID}, -2), 2)", sum={"rate": "30*(ref - phi)"})
    rest = statics(scene)
    assert rest.status == "no-rest"
    assert not rest.stable
    (finding,) = [one for one in rest.findings if one.kind.code == "state-does-not-rest"]
    assert finding.numbers["sum"] == pytest.approx(30 * (1.0 - math.asin(2.0 / WEIGHT)), rel=1e-6)
    assert "states.sum" in finding.text
    assert statics(with_states("0*phi", clock={"rate": "1 + 0*phi"})).status == "no-rest"


def test_states_that_act_on_nothing_rest_with_the_machine() -> None:
    """The work done has no equation at rest, and a filter has the value of what it filters."""
    scene = with_states("-6*rate(hinge)", work={"rate": "rate(hinge)**2"}, late={"rate": "(phi - late)/3"})
    rest = statics(scene)
    assert rest.ok
    assert rest.q[-2:] == pytest.approx([0.0, 0.0], abs=1e-10)
    assert -1 / 3 in [pytest.approx(one.eigenvalue, rel=1e-12) for one in modes(scene).modes]


def test_a_place_by_an_integral_of_a_rate_is_not_told_by_rest() -> None:
    assert statics(with_states("-20*turned - 6*rate(hinge)", turned={"rate": "rate(hinge)"})).status == "nothing-holds"


def test_an_integrator_without_damping_flutters() -> None:
    """J s^3 + G cos(1) s + k = 0 has a pair that grows."""
    rest = statics(with_states("sum", sum={"rate": "3*(ref - phi)"}))
    assert rest.status == "unstable"
    (finding,) = [one for one in rest.findings if one.kind.implies]
    growth = max(np.roots([INERTIA, 0.0, WEIGHT * math.cos(1.0), 3.0]).real)
    assert finding.numbers["rate"] == pytest.approx(growth, rel=1e-9)


@pytest.mark.parametrize("size", [1.0, 2.5])
def test_a_linear_model_about_an_equilibrium_has_the_states_of_the_user(size: float) -> None:
    """PID of a mass on a rail: at rest and by differences after a run."""
    data = saturated(size)
    data["signals"] |= {"ref": 0.0, "error": "1 + ref - slide(rail)"}
    scene = Scene.parse(data)
    found = linearize(scene, ["ref"], ["slide(rail)", "wanted"])
    np.testing.assert_allclose(found.a, [[0, 1, 0], [-20, -9.8 / 1.5, 1 / 1.5], [-40, 0, 0]], rtol=1e-13)
    np.testing.assert_allclose(found.b, [[0], [20], [40]], rtol=1e-13)
    np.testing.assert_allclose(found.c, [[1, 0, 0], [-30, -9, 1]], rtol=1e-13)
    np.testing.assert_allclose(found.d, [[0], [30]])
    assert ordered(found.poles) == pytest.approx(ordered(np.linalg.eigvals(found.a)), rel=1e-12)
    at_start = linearize(scene.with_values({"initial.mass.position": [1.0, 0.0]}), ["ref"], about="start")
    assert "by-differences" not in at_start.codes
    np.testing.assert_allclose(at_start.a, found.a, rtol=1e-13)


def test_a_torque_by_a_signal_that_is_a_number_has_a_potential() -> None:
    """With a contact, which statics takes where loads have one: the tip presses with (m g l/2 + T)/l."""
    data = pendulum("ref")
    data["signals"]["ref"] = -5.0
    data["contacts"] = {"floor": {"first": {"body": "arm", "point": "end"}, "second": {"body": "ground", "line": 0.0}}}
    data["initial"] = {"arm": {"angle": 0.5}}
    rest = statics(Scene.parse(data))
    assert rest.ok
    assert rest.contacts["contacts.floor"] == pytest.approx((WEIGHT + 5.0) / 0.8, rel=1e-9)


def test_a_joint_that_sticks_is_refused_by_its_own_words() -> None:
    data = pendulum("ref")
    data["joints"]["hinge"] = {"first": ground(0, 0), "second": {"body": "arm"}, "coulomb": 1.0, "stick": "exact"}
    with pytest.raises(InputError, match=r"joints.hinge.coulomb: a joint that sticks has no linear model"):
        linearize(Scene.parse(data), ["ref"], about="start")


@pytest.mark.parametrize(
    ("torque", "signals", "field"),
    [("1/0", {}, "loads.motor.torque"), ("x", {"x": "1/0 + angle(hinge)"}, "signals.x"),
     ("x", {"x": "1/a", "a": "2 - 2"}, "signals.x"), ("1/a", {"a": "2 - 2"}, "loads.motor.torque")],
)  # fmt: skip
def test_formulas_without_a_value_name_their_field(torque: str, signals: dict[str, Any], field: str) -> None:
    with pytest.raises(InputError, match=f"{field}: 1/0 has no finite value"):
        Scene.parse(pendulum(torque, **signals))
