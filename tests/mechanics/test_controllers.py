"""Controllers of a scene: templates that become signals and states."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from controlled import cart_pole, filtered, on_rail, saturated
from shoal.errors import InputError
from shoal.mechanics.analysis.statics import statics
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene


def controlled(base: dict[str, Any], **controllers: Any) -> Scene:
    """A machine whose loads follow controllers in place of signals and states of its own."""
    load = next(iter(base["loads"]))
    loads = {load: {**base["loads"][load], "scale": next(iter(controllers))}}
    return Scene.parse({**base, "signals": {}, "states": {}, "loads": loads, "controllers": controllers})


PID = {"kind": "pid", "of": "1 - slide(rail)", "kp": 30, "ki": 40, "kd": 9, "rate": "-slide_rate(rail)"}


def test_controllers_are_signals_and_states() -> None:
    pid = controlled(saturated(), pid={**PID, "limits": [-6, 6], "tracking": 0.25})
    times = np.array([0.3, 1.0, 4.0])
    x = [0.170772032337347, 1.06830184252287, 1.00107241343038]
    assert simulate(pid, times).points[:, 0, 0, 0] == pytest.approx(x, abs=1e-10)
    unwound = controlled(saturated(), pid={**PID, "limits": [-6, 6]})  # without anti-windup
    x = [0.1707720323373469, 1.4458033513685025, 1.0048772265727333]
    assert simulate(unwound, times).points[:, 0, 0, 0] == pytest.approx(x, abs=1e-10)
    assert Scene.parse(pid.model_dump(mode="json")) == pid
    assert pid.with_values({"signals.pid_kp": 20.0}).signals["pid_kp"].number == 20.0


def test_a_transfer_function_is_that_of_another_realisation() -> None:
    lead = {
        "kind": "transfer-function",
        "of": "1 - slide(rail)",
        "num": [1 / 60, 0.05, 20 / 3, 20],
        "den": [1 / 12000, 7 / 1200, 2 / 15, 1],
    }
    x = [0.20137211964410195, 1.1080838993989486, 0.6492363457029577, 0.9708607064948382]
    found = simulate(controlled(filtered(), lead=lead), np.array([0.1, 0.3, 1.0, 3.0]))
    assert found.points[:, 0, 0, 0] == pytest.approx(x, abs=1e-9)


def test_state_feedback_is_minus_the_gain_of_the_regulator() -> None:
    measures = ["slide(rail)", "pi/2 - angle(pole)", "slide_rate(rail)", "-rate(pole)"]
    lqr = {"kind": "state-feedback", "of": measures, "gain": [-10.0, -57.644549, -10.174577, -11.597209]}
    one = simulate(controlled(cart_pole(), lqr=lqr), np.array([0.5, 4.0]))
    assert one.points[:, 0, 0, 0] == pytest.approx([0.3311245978481899, -0.00048060257833727814], abs=1e-9)
    shifted = controlled(cart_pole(), lqr={**lqr, "about": [0.5, 0.0, 0.0, 0.0]})
    assert statics(shifted).points[0] == pytest.approx([0.5, 0.0], abs=1e-9)


def test_a_filtered_difference_is_the_rate_of_the_error_a_little_late() -> None:
    """Against the same filter as a transfer function, kp + kd s/(1 + T s)."""
    pid = {**PID, "ki": 0.0, "rate": None, "filter": 0.05}
    lead = {"kind": "transfer-function", "of": PID["of"], "num": [30 * 0.05 + 9, 30], "den": [0.05, 1]}
    times = np.array([0.1, 0.5])
    one, other = (simulate(controlled(saturated(), c=each), times) for each in (pid, lead))
    assert one.points == pytest.approx(other.points, abs=1e-10)


@pytest.mark.parametrize(
    ("controller", "why"),
    [
        ({"kind": "pid", "of": "1", "kd": 3}, "controllers.c.kd: state the `rate` of the error"),
        ({"kind": "pod"}, "controllers.c: no kind is called pod; there are 'pid', 'state-feedback'"),
        ({"kind": "pid", "of": "1", "kp": "a"}, "controllers.c.kp: needs a number, found 'a'"),
        ({"kind": "pid", "of": "1", "limits": [3, 1]}, "controllers.c.limits: must increase, found 3 and 1"),
        ({"kind": "pid", "of": "1", "tracking": 1.0}, "controllers.c.tracking: is of an integral"),
        ({"kind": "pid", "of": "slide(rial)", "kp": 1}, "signals.c_error: slide(rial): no joint 'rial'"),
        ({"kind": "pid", "of": "1", "kq": 2}, "controllers.c.kq: no such field"),
        ({"kind": "state-feedback", "of": ["1", "2"], "gain": [1]}, "controllers.c.gain: 1 numbers for 2 states"),
        ({"kind": "transfer-function", "of": "1", "num": [1, 2, 3], "den": [1, 2]}, "controllers.c.num: of degree 2"),
        ({"kind": "transfer-function", "of": "1", "num": [1], "den": [0, 2]}, "controllers.c.den: begins with 0"),
        (3, "controllers.c: needs entries with names, found 3"),
    ],
)
def test_controllers_are_refused_in_one_line(controller: Any, why: str) -> None:
    with pytest.raises(InputError) as caught:
        Scene.parse(on_rail(1.0, 0.0, "c", controllers={"c": controller}))
    assert why in str(caught.value)
    assert "\n" not in str(caught.value)


def test_names_that_controllers_make_clash_with_none() -> None:
    data = on_rail(1.0, 0.0, "c", controllers={"c": {"kind": "pid", "of": "1", "kp": 2}}, signals={"c_kp": 3})
    with pytest.raises(InputError, match=r"controllers.c: makes c_kp, which is there already"):
        Scene.parse(data)


def test_signals_states_and_loads_are_recorded_at_the_sampled_times() -> None:
    """As they are before a switch or a jump at that time; the integral by matrix exponentials."""
    times = np.array([0.1, 0.3, 0.6, 1.0, 2.0, 4.0])
    found = simulate(controlled(saturated(), pid={**PID, "limits": [-6, 6], "tracking": 0.25}), times)
    kept = found.model["signals"]
    integral = [-3.94634969730199, -4.47499825725630, 2.12490565007416, 4.12080343144426, -0.143195181566589]
    assert kept["pid_integral"][:5] == pytest.approx(integral, abs=1e-9)
    assert found.velocities is not None
    x, v = found.points[:, 0, 0, 0], found.velocities[:, 0, 0, 0]
    wanted = 30 * (1 - x) + np.array(kept["pid_integral"]) - 9 * v
    assert kept["pid_wanted"] == pytest.approx(wanted, abs=1e-9)
    assert kept["loads.push.scale"] == kept["pid"] == pytest.approx(np.clip(wanted, -6, 6), abs=1e-9)
