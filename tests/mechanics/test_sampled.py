"""Sampled controllers, against parabolas from instant to instant, and the reference of a quantised PID."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from controlled import on_rail, pendulum
from shoal.engines import get_engine
from shoal.engines.verification import verified
from shoal.errors import InputError
from shoal.mechanics.analysis.modes import modes
from shoal.mechanics.analysis.reactions import reactions
from shoal.mechanics.analysis.statics import statics
from shoal.mechanics.linear_model import linearize
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene

INTEGRATORS = ["dop853", "rk4", "leapfrog", "generalized-alpha", "radau5"]
"""All of these are exact under a constant force."""
PID = {"kind": "pid", "of": "1 - slide(rail)", "kp": 40, "ki": 30, "kd": 12}
CLOCK = {"period": 0.01, "delay": 0.004}


def driven(mass: float = 2.0, integrator: str = "dop853", step: float = 1e-3, **parts: Any) -> Scene:
    """A mass on a rail that is pushed by `u`, whatever that is."""
    data = on_rail(mass, 0.0, "u", **parts)
    return Scene.parse({**data, "solver": {"integrator": integrator, "step": step, "duration": 3.0}})


def followed(
    law: Callable[[int, float, float], float], times: list[float], period: str, delay: str = "0", mass: float = 2.0
) -> list[float]:
    """Places under commands law(k, x, v) of the instants k period, held from a delay later on."""
    x = v = u = 0.0
    now, found, commands = Fraction(0), list[float](), dict[Fraction, float]()
    end, step, late = Fraction(repr(times[-1])), Fraction(period), Fraction(delay)
    instants = [k * step for k in range(int(end / step) + 1)]
    stops = sorted({*instants, *(t + late for t in instants), *(Fraction(repr(t)) for t in times)})
    for stop in (one for one in stops if one <= end):
        h = float(stop - now)
        x, v, now = x + h * v + h * h * u / (2 * mass), v + h * u / mass, stop
        if stop in instants:
            commands[stop + late] = law(instants.index(stop), x, v)
        u = commands.get(stop, u)
        if any(Fraction(repr(t)) == stop for t in times):
            found.append(x)
    return found


def pid(period: float, limit: float = math.inf, tracking: float = math.inf) -> Callable[[int, float, float], float]:
    """A PID controller in its usual discrete form."""
    memory = {"integral": 0.0, "last": 0.0}

    def law(k: int, x: float, v: float) -> float:
        error = 1 - x
        rate = (error - memory["last"]) / period if k else 0.0
        wanted = 40 * error + memory["integral"] + 12 * rate
        output = min(max(wanted, -limit), limit)
        memory["integral"] += period * (30 * error + (output - wanted) / tracking)
        memory["last"] = error
        return output

    return law


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_pid_controller_that_rounds_what_it_measures(integrator: str) -> None:
    """Measured in steps of 2^-11 m; the reference was made in double and in extended precision."""
    times = [0.01, 0.02, 0.1, 0.5, 1.0, 3.0]
    x = [0.00035999999999999997, 0.00255725078125, 0.08255514506835937, 0.950802836181642, 1.261836839160159]
    u = {**PID, "sampled": {**CLOCK, "quantum": 2.0**-11}}
    found = simulate(driven(integrator=integrator, controllers={"u": u}), np.array(times))
    assert found.points[:, 0, 0, 0] == pytest.approx([*x, 1.0230410072754028], abs=1e-12)
    assert found.ok
    assert found.energy_drift[0] < 1e-12
    tie = found.model["nearest_tie"]
    assert tie["signal"] == "u_error"
    assert tie["quanta"] == pytest.approx(0.0005654000206050114, abs=1e-9)


def test_a_rounding_that_the_run_is_too_coarse_for_is_said() -> None:
    u = {**PID, "sampled": {**CLOCK, "quantum": 2.0**-11}}
    coarse, fine = (
        verified(get_engine("gauss"), driven(integrator=name, controllers={"u": u}), [3.0])
        for name in ("semi-implicit-euler", "dop853")
    )
    assert "sensitive-samples" in coarse.codes
    assert fine.codes == []


@pytest.mark.parametrize("delay", ["0", "0.004", "0.01", "0.025"])
def test_commands_come_a_delay_after_their_samples(delay: str) -> None:
    """Also when that is a period or more, so that several are on their way."""
    times = [0.031, 0.5, 1.0]
    u = {**PID, "sampled": {"period": 0.01, "delay": float(delay)}}
    found = simulate(driven(mass=5.0, controllers={"u": u}), np.array(times))
    exact = followed(pid(0.01), times, "0.01", delay, mass=5.0)
    assert found.points[:, 0, 0, 0] == pytest.approx(exact, abs=1e-11)


def test_limits_and_tracking_of_a_sampled_controller() -> None:
    times = [0.1, 0.5, 2.0]
    u = {**PID, "limits": [-10, 10], "tracking": 0.2, "sampled": {"period": 0.02}}
    found = simulate(driven(controllers={"u": u}), np.array(times))
    exact = followed(pid(0.02, 10.0, 0.2), times, "0.02")
    assert found.points[:, 0, 0, 0] == pytest.approx(exact, abs=1e-12)


def test_a_rate_may_be_measured_and_filtered() -> None:
    """By backward differences: T r_k' + r_k = rate becomes r_k = (T r_(k-1) + h rate)/(T + h)."""
    memory = {"rate": 0.0}

    def law(k: int, x: float, v: float) -> float:
        memory["rate"] = (0.05 * memory["rate"] - 0.01 * v) / 0.06
        return 40 * (1 - x) + 12 * memory["rate"]

    times = [0.1, 1.0]
    u = {**PID, "ki": 0, "rate": "-slide_rate(rail)", "filter": 0.05, "sampled": {"period": 0.01}}
    found = simulate(driven(controllers={"u": u}), np.array(times))
    assert found.points[:, 0, 0, 0] == pytest.approx(followed(law, times, "0.01"), abs=1e-12)


def test_a_transfer_function_of_z_is_its_difference_equation() -> None:
    """(2 z^2 - 3.4 z + 1.42)/(z^2 - 1.1 z + 0.24) of the error."""
    errors, outputs = [0.0, 0.0], [0.0, 0.0]

    def law(k: int, x: float, v: float) -> float:
        errors.append(1 - x)
        outputs.append(2 * errors[-1] - 3.4 * errors[-2] + 1.42 * errors[-3] + 1.1 * outputs[-1] - 0.24 * outputs[-2])
        return outputs[-1]

    times = [0.05, 0.2, 1.0]
    u = {"kind": "transfer-function", "of": "1 - slide(rail)", "num": [2, -3.4, 1.42], "den": [1, -1.1, 0.24]}
    found = simulate(driven(controllers={"u": {**u, "sampled": {"period": 0.02}}}), np.array(times))
    assert found.points[:, 0, 0, 0] == pytest.approx(followed(law, times, "0.02"), abs=1e-12)


def test_laws_of_ones_own_are_samples_of_signals() -> None:
    """Measured states, a signal between two samples, and a controller behind a controller at once."""
    signals = {
        "wanted": {"sample": "3*(1 - slide(rail))", "period": 0.01},
        "twice": "2*wanted",
        "u": {"sample": "min(5*(twice/2 - slide_rate(rail)), 9)", "period": 0.01, "delay": 0.002},
    }
    times = [0.1, 1.0]
    found = simulate(driven(signals=signals), np.array(times))
    exact = followed(lambda _, x, v: min(5 * (3 * (1 - x) - v), 9), times, "0.01", "0.002")
    assert found.points[:, 0, 0, 0] == pytest.approx(exact, abs=1e-12)
    feedback = {"kind": "state-feedback", "of": ["slide(rail)", "slide_rate(rail)"], "gain": [15, 5], "about": [1, 0]}
    found = simulate(driven(controllers={"u": {**feedback, "sampled": {"period": 0.01}}}), np.array(times))
    exact = followed(lambda _, x, v: -(15 * (x - 1) + 5 * v), times, "0.01")
    assert found.points[:, 0, 0, 0] == pytest.approx(exact, abs=1e-12)


@pytest.mark.parametrize("integrator", ["dop853", "leapfrog", "generalized-alpha"])
def test_an_accelerometer_shows_what_the_command_before_did(integrator: str) -> None:
    """u_k = 3 - 0.4 m a_k with a_k = u_(k-1)/m, and 0 at the start; of a body that a command does not move at first."""
    signals = {"a": "acceleration(mass, x)", "u": {"sample": "3 - 0.8*a", "period": 0.1}}
    commands = [0.0]

    def law(k: int, x: float, v: float) -> float:
        commands.append(3 - 0.4 * commands[-1])
        return commands[-1]

    times = [0.25, 0.5, 1.0]
    found = simulate(driven(integrator=integrator, signals=signals), np.array(times))
    assert found.points[:, 0, 0, 0] == pytest.approx(followed(law, times, "0.1"), abs=1e-11)
    assert "a" not in found.model["signals"]
    with pytest.raises(
        InputError, match=r"loads.push.scale: acceleration\(mass, x\) depends on the forces of the same"
    ):
        driven(signals={"u": "3 - 0.4*acceleration(mass, x)"})


def test_an_acceleration_is_that_of_the_place() -> None:
    """The tip of a rod that is let go falls with 3/2 g."""
    data = pendulum("1e-12*u", u={"sample": "acceleration(tip, y)", "period": 1})
    data["initial"] = {"arm": {"angle": 0.0}}
    found = simulate(Scene.parse(data), np.array([0.1]))
    assert found.model["signals"]["u"][0] == pytest.approx(-1.5 * 9.81, abs=1e-9)
    with pytest.raises(InputError, match="only samples know it"):
        linearize(Scene.parse(pendulum()), ["motor"], ["acceleration(tip, x)"], about="start")


def test_clocks_of_different_periods_meet_without_an_error() -> None:
    """A slow one sets what a fast one follows: 30 samples in 0.3 s, as no sum of floating numbers has them."""
    signals = {
        "slow": {"sample": "1 + t", "period": 0.3},
        "u": {"sample": "40*(slow - slide(rail)) - 12*slide_rate(rail)", "period": 0.1},
    }

    def law(k: int, x: float, v: float) -> float:
        return 40 * (1 + float(Fraction(3, 10) * (k // 3)) - x) - 12 * v

    times = [0.3, 0.9, 2.7]
    found = simulate(driven(mass=10.0, signals=signals), np.array(times))
    assert found.points[:, 0, 0, 0] == pytest.approx(followed(law, times, "0.1", mass=10.0), abs=1e-11)


def test_states_take_their_next_values_together() -> None:
    """Fibonacci's numbers, which are recorded as they are before an instant."""
    states = {"a": {"next": "b", "period": 0.1}, "b": {"next": "a + b", "period": 0.1, "start": 1.0}}
    found = simulate(driven(states=states, signals={"u": "a"}), np.array([0.05, 0.45, 0.75]))
    assert found.model["signals"]["a"] == [1.0, 5.0, 21.0]


def test_a_jump_at_an_instant_is_seen_and_before_the_first_command_there_is_none() -> None:
    signals = {"u": {"sample": "2*step(t - 0.5) + 1", "period": 0.25, "first": 0.25}}
    found = simulate(driven(mass=1.0, signals=signals), np.array([0.25, 0.5, 0.75]))
    assert found.points[:, 0, 0, 0] == pytest.approx([0.0, 1 / 32, 1 / 32 + 1 / 16 + 3 / 32], abs=1e-12)


@pytest.mark.parametrize("integrator", ["dop853", "rk4"])
def test_impacts_between_samples(integrator: str) -> None:
    """A ball that a sampled thruster throws up whenever it falls; parabolas up to the floor and to the instants."""
    data = on_rail(1.0, 0.0, "u", signals={"u": {"sample": "4 - 20*step(-slide_rate(rail))", "period": 0.1}})
    data["joints"]["rail"] |= {"stops": {"min": 0.0, "restitution": 0.5}}
    data["initial"] = {"mass": {"position": [0.2, 0.0], "velocity": [-1.0, 0.0]}}
    data["solver"] = {"integrator": integrator, "step": 1e-2, "duration": 1.0}
    x, v = 0.2, -1.0
    for _ in range(10):
        u, left = 4.0 - (20.0 if v <= 0.0 else 0.0), 0.1
        while left > 0.0:
            roots = [r.real for r in np.roots([u / 2, v, x]) if abs(r.imag) < 1e-12 and 1e-9 < r.real < left]
            h = min(roots, default=left)
            x, v, left = x + h * v + h * h * u / 2, v + h * u, left - h
            v = -0.5 * v if roots else v
    found = simulate(Scene.parse(data), np.array([1.0]))
    assert found.ok
    assert found.points[0, 0, 0, 0] == pytest.approx(x, abs=1e-9)


def test_lanes_share_their_instants() -> None:
    scene = driven(integrator="rk4", controllers={"u": {**PID, "sampled": CLOCK}})
    times, gains = np.array([0.5, 1.0]), np.linspace(30.0, 50.0, 16)
    found = simulate(scene, times, {"signals.u_kp": gains})
    for lane in (0, 9):
        alone = simulate(scene.with_values({"signals.u_kp": gains[lane]}), times)
        assert found.points[..., lane] == pytest.approx(alone.points[..., 0], abs=1e-13)
    with pytest.raises(InputError, match=r"signals.u.period: u_error, u_rate, u_last, u_begun, u_integral is sampled"):
        scene.with_values({"signals.u.period": 0.02})


def test_lanes_with_instants_of_their_own_are_run_one_by_one() -> None:
    scene = driven(signals={"u": {"sample": "9*(1 - slide(rail)) - 4*slide_rate(rail)", "period": 0.01}})
    times, periods = np.array([0.5, 1.0]), np.array([0.01, 0.02])
    for field in ("period", "delay"):
        both = get_engine("gauss").simulate_many(scene, {f"signals.u.{field}": periods}, times)
        alone = simulate(scene.with_values({f"signals.u.{field}": 0.02}), times)
        assert both.points[..., 1] == pytest.approx(alone.points[..., 0], abs=1e-13)


def test_samples_and_switches_of_the_state_in_one_scene() -> None:
    """A force that jumps with the place, exactly, beside a sampled one: order is kept at both."""
    data = pendulum("u - 5*step(angle(hinge))", u={"sample": "3*(1 - angle(hinge))", "period": 0.05})
    data["solver"] = {"integrator": "rk4", "duration": 1.0}
    fine = simulate(Scene.parse({**data, "solver": {**data["solver"], "step": 2.5e-4}}), np.array([1.0]))
    errors = []
    for step in (4e-3, 2e-3):
        found = simulate(Scene.parse({**data, "solver": {**data["solver"], "step": step}}), np.array([1.0]))
        errors.append(abs(float(found.angles[0, 0, 0] - fine.angles[0, 0, 0])))
    assert math.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.5)


def test_what_takes_no_samples_says_so() -> None:
    scene = driven(controllers={"u": {**PID, "sampled": CLOCK}})
    for analysis in (statics, modes):
        with pytest.raises(InputError, match=r"signals.u_error: sampled every 0.01 s: equilibria and modes"):
            analysis(scene)
    with pytest.raises(InputError, match=r"signals.u_error: sampled every 0.01 s: linear models"):
        linearize(scene, ["push"], ["slide(rail)"], about="start")
    with pytest.raises(InputError, match=r"signals.u_error: sampled every 0.01 s: reactions and"):
        reactions(scene, [0.5])
    end = simulate(scene, np.array([0.1])).end
    assert end is not None
    assert "turns" in dict(end)
    with pytest.raises(InputError, match=r"signals.u: its period of 1e-07 s makes 3e\+07 samples in 3 s"):
        simulate(driven(controllers={"u": {**PID, "ki": 0, "kd": 0, "sampled": {"period": 1e-7}}}), np.array([3.0]))


@pytest.mark.parametrize(
    ("parts", "why"),
    [
        ({"signals": {"u": {"sample": "2*u", "period": 1}}}, "signals.u: depends on itself: u -> u; a state with"),
        ({"signals": {"u": {"sample": "2*w", "period": 1}}}, "signals.u.sample: '2*w' has 'w', which is not known"),
        ({"signals": {"u": {"sample": "1"}}}, "signals.u.period"),
        ({"signals": {"u": {"sample": "1", "period": 0}}}, "signals.u.period: Input should be greater than 0"),
        ({"signals": {"u": {"sampel": "1", "period": 1}}}, "signals.u.sampel: no such field"),
        ({"signals": {"u": 1.0}, "states": {"x": {"next": "x"}}}, "states.x.period"),
        ({"signals": {"u": 1.0}, "states": {"x": {"rate": "x", "next": "1", "period": 1}}}, "states.x.rate: no such"),
        ({"controllers": {"u": {**PID, "sampled": {"delay": 1}}}}, "controllers.u.sampled.period"),
        ({"controllers": {"u": {**PID, "sampled": {"period": 1, "quantum": 0}}}}, "controllers.u.sampled.quantum"),
    ],
)
def test_samples_are_refused_in_one_line(parts: dict[str, Any], why: str) -> None:
    with pytest.raises(InputError) as caught:
        driven(**parts)
    assert why in str(caught.value)
    assert "\n" not in str(caught.value)
