"""What is short is not lost: impulses of functions of time against integrals by pieces, for every integrator."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from shoal.errors import InputError
from shoal.mechanics.assembly.build import build
from shoal.mechanics.halts import halts
from shoal.mechanics.integrators import INTEGRATORS, facts
from shoal.mechanics.simulate import simulate
from shoal.scene import Function, Scene
from shoal.trajectory import Trajectory

Array = Any
NODES, WEIGHTS = np.polynomial.legendre.leggauss(40)
ERROR = {8: 1e-9, 5: 1e-9, 4: 1e-4, 2: 1e-2, 1: 0.1}
"""Allowed of a smooth pulse, by the order of the integrator: fixed steps pass the shortest in eight parts a piece."""


def pushed(scale: Any, duration: float = 1.0, integrator: str = "auto", **solver: Any) -> Scene:
    """A free mass of 2 kg under a force of 1 N times a function of time."""
    return Scene.parse(
        {
            "name": "pushed",
            "gravity": [0.0, 0.0],
            "bodies": {"m": {"kind": "point-mass", "mass": 2.0}},
            "loads": {"F": {"kind": "force", "at": {"body": "m"}, "force": [1.0, 0.0], "scale": scale}},
            "markers": {"m": {"body": "m"}},
            "initial": {"m": {"position": [0.0, 0.0]}},
            "solver": {"duration": duration, "samples": 10, "integrator": integrator, **solver},
        },
        "pushed",
    )


def run(scene: Scene) -> Trajectory:
    solver = scene.solver
    trajectory = simulate(scene, solver.duration * np.arange(1, solver.samples + 1) / solver.samples)
    assert trajectory.ok, trajectory.message
    return trajectory


def impulse(scene: Scene) -> float:
    """Of the function alone [s]."""
    return float(2.0 * run(scene).velocities[-1, 0, 0, 0])


def integral(function: Any, places: list[float]) -> float:
    """Of a function that is smooth between places."""
    total = 0.0
    for low, high in pairwise(places):
        total += (high - low) / 2 * float(WEIGHTS @ function((low + high) / 2 + (high - low) / 2 * NODES))
    return total


def rise(x: Array) -> Array:
    return x**3 * (10 + x * (6 * x - 15))


def pulse(draw: np.random.Generator, *, plain: bool) -> tuple[str, float, float]:
    """A pulse of 1e-5 to 1e-1 of the run, the run's duration [s], and its integral."""
    duration = float(draw.choice([1.0, 10.0, 60.0]))
    width = duration * 10 ** draw.uniform(-5, -1)
    begin = draw.uniform(0, duration - width)
    special = draw.random()
    if special < 0.2:  # on an output time, 0 among them
        begin = min(float(np.round(begin / duration * 10) / 10 * duration), duration - width)
    elif special < 0.3:
        begin = duration - width
    end = begin + width
    middle, half = (begin + end) / 2, width / 2
    w, p, k, d = draw.uniform(1, 20) / duration, draw.uniform(0, 6), draw.uniform(-3, 3) / duration, draw.uniform(-2, 2)
    carriers = [
        f"(2 + sin({w!r}*t + {p!r}))",
        f"exp({k!r}*t)",
        f"(1 + {d!r}*t/{duration!r} + {d * d!r}*(t/{duration!r})**2)",
        f"(2 + cos({w!r}*t))*exp({k!r}*t)",
    ]
    carrier = "1" if plain else carriers[draw.integers(len(carriers))]
    flat = np.ones_like
    forms: list[tuple[str, Any]] = [
        (f"(step(t - {begin!r}) - step(t - {end!r}))", flat),
        (f"step(t - {begin!r})*step({end!r} - t)", flat),
        (f"step((t - {begin!r})*({end!r} - t))", flat),
        (f"step(1 - abs((t - {middle!r})/{half!r}))", flat),
        (f"min(step(t - {begin!r}), step({end!r} - t))", flat),
        (f"max(0, 1 - abs((t - {middle!r})/{half!r}))", lambda t: 1 - np.abs((t - middle) / half)),
        (f"ramp((t - {begin!r})/{half!r})*ramp(({end!r} - t)/{half!r})",
         lambda t: rise(np.minimum(t - begin, end - t) / half)),
    ]  # fmt: skip
    form, shape = forms[draw.integers(5 if plain else len(forms))]
    smooth = Function(expression=carrier)
    return f"{form}*{carrier}", duration, integral(lambda t: shape(t) * smooth(t), [begin, middle, end])


def error(integrator: str, draw: np.random.Generator, *, plain: bool) -> float:
    text, duration, expected = pulse(draw, plain=plain)
    scene = pushed(text, duration, integrator, step=duration / 1000, absolute_tolerance=1e-18)
    return abs(impulse(scene) / expected - 1)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_no_pulse_is_lost(integrator: str) -> None:
    draw = np.random.default_rng(11)
    plain = max(error(integrator, draw, plain=True) for _ in range(6))
    # The two numbers that a pulse of 1e-5 of the run begins and ends at are themselves known to 1e-16 of it.
    assert plain < 1e-9
    smooth = max(error(integrator, draw, plain=False) for _ in range(6))
    assert smooth < ERROR[facts(integrator).order]


@pytest.mark.slow
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_thousand_pulses(integrator: str) -> None:
    draw = np.random.default_rng(5)
    assert max(error(integrator, draw, plain=True) for _ in range(500)) < 1e-9
    assert max(error(integrator, draw, plain=False) for _ in range(500)) < ERROR[facts(integrator).order]


TOOTH = [[k / 1000, 1.0 if k == 437 else 0.0] for k in range(1001)]
TEETH = [[0.0, 0.0]] + [[k / 50 + x, y] for k in range(1, 41) for x, y in ((0.0, 0.0), (1e-5, 1.0), (2e-5, 0.0))]


@pytest.mark.parametrize("integrator", ["dop853", "rk4", "leapfrog", "generalized-alpha", "implicit-gauss"])
@pytest.mark.parametrize(
    ("scale", "duration", "expected"),
    [
        pytest.param("step(sin(50*t))", 1.0, 8 * np.pi / 50, id="nested"),
        pytest.param("+".join(f"step(t-.0{k})-step(t-.0{k}01)" for k in range(1, 10)), 1.0, 9e-4, id="nine-teeth"),
        pytest.param({"table": TEETH, "smooth": False}, 1.0, 40e-5, id="table-of-teeth"),
        pytest.param({"table": TOOTH}, 10.0, 1e-3, id="one-row-of-a-spline"),
        pytest.param("exp(-((t - 0.43)/1e-5)**2)", 1.0, 1e-5 * np.sqrt(np.pi), id="smooth-and-narrow"),
        pytest.param("1/(1 + ((t - 0.43)/1e-5)**2)", 1.0, 1e-5 * (np.arctan(5.7e4) + np.arctan(4.3e4)), id="peak"),
        pytest.param("step(t - 0.5) - step(t - 0.50001)", 1.0, 1e-5, id="within-a-step"),
        pytest.param("step(0.001 - t)", 10.0, 1e-3, id="at-the-start"),
        pytest.param("step(t - 9.9999)", 10.0, 1e-4, id="at-the-end"),
        pytest.param("step(t - 3)", 6.0, 3.0, id="half-the-time"),
        pytest.param("sqrt(1 - t)", 1.0, 2 / 3, id="ends-with-a-root"),
    ],
)
def test_brothers(integrator: str, scale: Any, duration: float, expected: float) -> None:
    exact = integrator == "dop853"
    peak = 5e-4 if integrator == "implicit-gauss" else 1e-4
    smooth = {"exp": 1e-9 if exact else 1e-4, "1/(": peak, "sqr": 1e-3}.get(str(scale)[:3], 1e-9)
    found = impulse(pushed(scale, duration, integrator, step=duration / 1000))
    assert found == pytest.approx(expected, rel=smooth)


def test_a_position_is_known_at_a_jump() -> None:
    trajectory = run(pushed("step(t - 0.5)"))
    times = trajectory.times
    np.testing.assert_allclose(trajectory.points[:, 0, 0, 0], np.maximum(times - 0.5, 0) ** 2 / 4, atol=1e-12)


@pytest.mark.parametrize(
    ("scale", "why"),
    [
        ("1/(t - 1)", r"^loads\.F\.scale: '1/\(t - 1\)' has a pole: t - 1 is 0 at t = 1"),
        ("step(sin(1e7*t))", "switches too often"),
        ("sin(1e9*t)", "varies too fast"),
    ],
)
def test_what_cannot_be_bounded_is_refused(scale: str, why: str) -> None:
    with pytest.raises(InputError, match=why):
        run(pushed(scale, 2.0))


CRANK: dict[str, Any] = {
    "name": "crank",
    "gravity": [0.0, 0.0],
    "bodies": {
        "c": {"kind": "rigid-body", "mass": 1.0, "inertia": 0.1, "named_points": {"end": [1.0, 0.0]}},
        "r": {"kind": "rod", "length": 2.0, "height": 0.02, "width": 0.02, "density": 1000.0},
    },
    "joints": {
        "O": {"first": {"body": "ground", "point": [0, 0]}, "second": {"body": "c", "point": "start"}},
        "A": {"first": {"body": "c", "point": "end"}, "second": {"body": "r", "point": "start"}},
        "D": {"kind": "driven-angle", "first": {"body": "ground", "point": [0, 0]}, "second": {"body": "c"}},
    },
    "markers": {"A": {"body": "c", "point": "end"}, "B": {"body": "r", "point": "end"}},
}


def cranked(angle: Any, duration: float, integrator: str, **initial: Any) -> Scene:
    joints = {**CRANK["joints"], "D": {**CRANK["joints"]["D"], "angle": angle}}
    solver = {"duration": duration, "samples": 6, "integrator": integrator, "step": duration / 2000}
    return Scene.parse({**CRANK, "joints": joints, "initial": initial, "solver": solver}, "crank")


@pytest.mark.parametrize("smooth", [True, False])
@pytest.mark.parametrize("integrator", ["dop853", "rk4", "leapfrog", "generalized-alpha"])
def test_a_table_may_end_with_the_run(integrator: str, smooth: bool) -> None:
    table = {"table": [[0.0, 0.0], [1.0, 1.0], [2.0, 1.0], [3.0, 2.0]], "smooth": smooth}
    initial = {"c": {"rate": Function.model_validate(table).table_slope(0.0, False)}, "r": {"angle": 0.0}}
    trajectory = run(cranked(table, 3.0, integrator, **initial))
    assert trajectory.rates[-1, 0, 0] == pytest.approx(Function.model_validate(table).table_slope(3.0, True), rel=1e-5)
    angle = Function.model_validate(table)(trajectory.times)
    np.testing.assert_allclose(trajectory.points[:, 0, 0, 0], np.cos(angle), atol=1e-9)


@pytest.mark.parametrize("integrator", ["dop853", "radau5", "rk4", "generalized-alpha", "energy-momentum"])
def test_a_rate_that_jumps_is_a_plastic_impact(integrator: str) -> None:
    """The crank stands until 0.5 s, then turns with 3 rad/s; the rod (angle 0.7) takes the least kinetic energy."""
    scene = cranked("3*max(t - 0.5, 0)", 0.6, integrator, r={"angle": 0.7})
    trajectory = run(scene)
    mass, length, direction = 0.8, 2.0, np.array([-np.sin(0.7), np.cos(0.7)])
    # The angular momentum of the rod about the joint: m l/2 (A' . n) + m l^2/3 w = 0.
    rate = -1.5 / length * (np.array([0.0, 3.0]) @ direction)
    assert mass == pytest.approx(1000 * 0.02 * 0.02 * length)
    assert trajectory.rates[-2, 1, 0] == pytest.approx(0.0, abs=1e-9)
    # Soon after: the rod's rate is that of the impact, but for what it has turned since.
    soon = simulate(scene, np.array([0.5 + 1e-6]))
    assert soon.rates[-1, 1, 0] == pytest.approx(rate, rel=1e-4)


@pytest.mark.parametrize("integrator", ["dop853", "leapfrog"])
def test_a_position_that_jumps_is_refused(integrator: str) -> None:
    with pytest.raises(InputError, match=r"^joints\.D: jumps from 0 to 0\.1 at t = 1, which no body can follow"):
        run(cranked("0.1*step(t - 1)", 2.0, integrator))


@pytest.mark.parametrize("integrator", ["dop853", "radau5", "rk4", "leapfrog"])
@pytest.mark.parametrize("width", [1e-2, 1e-4])
@pytest.mark.by_day(1)
def test_a_narrow_law_of_a_spring_is_not_leapt_over(integrator: str, width: float) -> None:
    """A mass passes at 1 m/s through a law that takes 0.2 J from it on its way."""
    law = f"{float(0.2 / width / np.sqrt(np.pi))!r}*exp(-((t - 0.3)/{width!r})**2)"
    scene = pushed(0.0, 1.0, integrator, energy_tolerance=0.9)
    spring = {
        "kind": "spring",
        "first": {"body": "ground", "point": [-1.0, 0.0]},
        "second": {"body": "m"},
        "elastic": law,
    }
    data = scene.model_dump()
    data["loads"] = {"S": spring}
    data["initial"] = {"m": {"position": [0.0, 0.0], "velocity": [1.0, 0.0]}}
    trajectory = run(Scene.parse(data, "law"))
    after = float(trajectory.velocities[-1, 0, 0, 0])
    assert after == pytest.approx(np.sqrt(0.8), rel=1e-6 if integrator in ("dop853", "radau5") else 0.2)


def test_steps_end_where_functions_are_not_smooth() -> None:
    model = build(pushed("step(t - 0.25) + abs(t - 0.5)*exp(-((t - 0.75)/1e-4)**2)"))
    adaptive = halts(model, 1.0, 0.01, True).times
    assert {0.25, 0.5} <= set(adaptive.tolist())
    assert np.abs(adaptive - 0.75).min() < 1e-2
    assert halts(build(pushed("sin(3*t)")), 1.0, 1e-3, False).times.size == 0
    # A run that fixed steps would overrun ends at its end; functions are known up to there only.
    assert halts(build(pushed("sin(3*t)")), 1.0, 0.3, False).times.tolist() == [1.0]
    assert halts(build(pushed(1.0)), 1.0, 0.3, False).times.size == 0
