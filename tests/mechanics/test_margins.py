"""Stability margins of open loops, against closed forms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import shoal
from controlled import on_rail
from shoal.errors import InputError
from shoal.mechanics.linear_model import linearize
from shoal.mechanics.margins import margins
from shoal.scene import Scene


def third(gain: float) -> Any:
    """k / (s + 1)^3."""
    a = np.array([[-1.0, 1.0, 0.0], [0.0, -1.0, 1.0], [0.0, 0.0, -1.0]])
    return a, np.array([0.0, 0.0, gain]), np.array([1.0, 0.0, 0.0]), 0.0


def test_a_triple_lag_has_the_gain_margin_eight() -> None:
    """It is -k/8 at sqrt(3) rad/s, and of size 1 at sqrt(k^(2/3) - 1)."""
    for gain in (0.5, 2.0, 4.0):
        found = margins(*third(gain), stable=True)
        assert found.gain_margin == pytest.approx(8.0 / gain, rel=1e-9)
        assert found.phase_crossovers == pytest.approx((math.sqrt(3.0),), rel=1e-9)
        if gain > 1.0:
            w = math.sqrt(gain ** (2 / 3) - 1.0)
            phase = 180.0 - 3.0 * math.degrees(math.atan(w))
            assert found.gain_crossovers == pytest.approx((w,), rel=1e-8)
            assert found.phase_margin == pytest.approx(phase, rel=1e-8)
            assert found.delay_margin == pytest.approx(math.radians(phase) / w, rel=1e-8)
        else:
            assert math.isinf(found.phase_margin)


def test_a_sharp_resonance_is_not_passed_over() -> None:
    """0.01 / (s^2 + 2e-6 s + 1): a gain of 1 at both sides of a resonance that is 1e-6 wide."""
    a, b = np.array([[0.0, 1.0], [-1.0, -2e-6]]), np.array([0.0, 0.01])
    found = margins(a, b, np.array([1.0, 0.0]), 0.0, stable=True)
    assert found.gain_crossovers == pytest.approx((math.sqrt(0.99), math.sqrt(1.01)), rel=1e-9)


def rail(kp: float = 20.0, kd: float = 4.0, lag: float = 0.05) -> Scene:
    """A mass of 2 kg under PD control by an actuator that lags: L = (kp + kd s) / (2 s^2 (lag s + 1))."""
    data = on_rail(2.0, 0.0, "push", signals={"u": "20*(1 - slide(rail)) - 4*slide_rate(rail)"})
    data["signals"] = {"kp": kp, "kd": kd, "u": "kp*(1 - slide(rail)) - kd*slide_rate(rail)"}
    data["states"] = {"push": {"rate": f"(u - push)/{lag}"}}
    data["loads"]["push"]["scale"] = "push"
    return Scene.parse(data)


def test_the_loop_of_a_controller_is_broken_at_its_output() -> None:
    found = linearize(rail(), [], loop="u")
    frequencies = np.array([0.3, 3.0, 30.0])
    s = 1j * frequencies
    assert found.response(frequencies)[:, 0, 0] == pytest.approx((20 + 4 * s) / (2 * s**2 * (0.05 * s + 1)), rel=1e-9)
    assert found.poles == pytest.approx([-20.0, 0.0, 0.0], rel=1e-9)
    (w,) = found.margins.gain_crossovers
    assert abs((20 + 4j * w) / (2 * w**2 * (0.05j * w + 1))) == pytest.approx(1.0, rel=1e-9)
    phase = math.degrees(math.atan(0.2 * w) - math.atan(0.05 * w))
    assert found.margins.phase_margin == pytest.approx(phase, rel=1e-7)
    assert found.margins.delay_margin == pytest.approx(math.radians(phase) / w, rel=1e-7)
    # 0.1 s^3 + 2 s^2 + kd k s + kp k has no positive root for any k: 2 kd > 0.1 kp
    assert math.isinf(found.margins.gain_margin)
    assert found.margins.gain_reduction == 0.0


def test_a_proportional_gain_alone_is_not_stable_and_has_no_margins() -> None:
    found = linearize(rail(kd=0.1), [], loop="u", require=["phase_margin > 30"])
    assert not found.ok
    assert found.codes[:2] == ["loop-unstable", "margin-below"]
    assert found.to_json()["margins"]["phase_margin"] is None


def test_margins_are_required_like_limits() -> None:
    assert linearize(rail(), [], loop="u", require=["phase_margin > 20", "gain_margin > 2"]).ok
    short = linearize(rail(), [], loop="u", require=["phase_margin > 60"])
    assert short.status == "requirement-violated"
    assert "phase_margin > 60 does not hold" in short.message
    for text, why in (("phase > 3", "there are gain_margin"), ("phase_margin > x", "a number is needed")):
        with pytest.raises(InputError, match=why):
            linearize(rail(), [], loop="u", require=[text])
    with pytest.raises(InputError, match="loop: no signal 'v'; there are kp, kd, u"):
        linearize(rail(), [], loop="v")
    with pytest.raises(InputError, match="name the signal where it is broken"):
        linearize(rail(), ["kp"], require=["phase_margin > 3"])
    with pytest.raises(InputError, match="inputs: name one or more signals or loads, or a loop"):
        shoal.linearize("single-pendulum")


def test_nyquist_is_drawn_beside_bode() -> None:
    from shoal.pictures.bode import bode

    figure = bode(linearize(rail(), [], loop="u"))
    assert [one.get_xlabel() for one in figure.axes][1:] == ["real part", "frequency [Hz]"]
