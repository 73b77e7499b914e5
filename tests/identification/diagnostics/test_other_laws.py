"""Friction of a law that the model leaves out: recordings by scipy's pendulum, of which one resists by two laws."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from shoal.engines import get_engine
from shoal.identification import Estimate, Measurement, Problem
from shoal.identification.conclude import conclude
from shoal.identification.diagnostics.other_laws import OtherLaw, wider_by_other_laws
from shoal.identification.forward import ForwardModel
from shoal.identification.methods import get_method
from shoal.identification.uncertainty.intervals import Value
from shoal.scene import Scene

LENGTH, MASS, VISCOUS, START = 0.8, 0.5, 0.02, -0.7
INERTIA = MASS * LENGTH**2 / 3
LAWS: dict[str, Callable[[float], float]] = {
    "none": lambda rate: 0.0,
    "quadratic drag": lambda rate: 0.004 * rate * abs(rate),
    "dry friction": lambda rate: 0.006 * float(np.tanh(rate / 0.01)),
}


def identified(law: str, noise: float, seed: int, share: float = 1.0, *more: str) -> Estimate:
    """From 6 s of the angle: start, viscous friction and more of joint O, which has a share of another law too."""

    def motion(_: float, state: Any) -> list[float]:
        angle, rate = state
        weight = MASS * 9.81 * LENGTH / 2 * np.cos(angle)
        return [rate, -(weight + VISCOUS * rate + share * LAWS[law](rate)) / INERTIA]

    times = np.linspace(0.0, 6.0, 121)[1:]
    seen = solve_ivp(motion, (0.0, 6.0), [START, 0.0], "LSODA", times, rtol=1e-10, atol=1e-12, max_step=0.01).y[0]
    seen += noise * np.random.default_rng(seed).standard_normal(len(seen))
    density = MASS / (LENGTH * 0.02 * 0.04)
    scene = Scene.parse({
        "name": "pendulum",
        "bodies": {"OA": {"kind": "rod", "length": LENGTH, "height": 0.02, "width": 0.04, "density": density}},
        "joints": {"O": {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "OA"}}},
        "markers": {"A": {"body": "OA", "point": "end"}},
        "initial": {"OA": {"angle": START}},
    })  # fmt: skip
    problem = Problem.parse({
        "name": "swing", "scene": "pendulum", "channels": [{"marker": "A", "quantity": "angle"}],
        "parameters": {"start": {"path": "initial.OA.angle", "lower": -3.0, "upper": 3.0},
                       "friction": {"path": "joints.O.friction", "lower": 0.0, "upper": 1.0},
                       **{field: {"path": f"joints.O.{field}", "lower": 0.0, "upper": 1.0} for field in more}},
        "source": {"kind": "engine", "stop": 6.0, "count": 120}, "quantities": {"ratio": f"friction / {INERTIA}"},
    }, "swing")  # fmt: skip
    measurement = Measurement.single(times, tuple(problem.channels), seen[:, None], "scipy")
    model = ForwardModel(problem, scene, get_engine("gauss"), measurement)
    outcome = get_method("least-squares")(model, np.random.default_rng(seed), lambda *_: None)
    return conclude(model, outcome, "least-squares", seed)


@pytest.mark.parametrize("draws", [[1], pytest.param(range(2, 15), marks=pytest.mark.slow)], ids=["one", "many"])
@pytest.mark.parametrize(
    ("law", "share"), [("quadratic drag", 0.3), pytest.param("dry friction", 0.5, marks=pytest.mark.slow)]
)
def test_intervals_hold_the_friction_where_another_law_leaves_a_misfit(
    law: str, share: float, draws: Sequence[int]
) -> None:
    """Of twelve draws with 95 % each all but two at least; the fault is far beyond the noise."""
    held = []
    for seed in draws:
        estimate = identified(law, 3e-4, seed, share)
        assert estimate.verdict.trusted, estimate.message
        assert estimate.suspects[0].name == f"{law} of O"
        assert "the intervals hold the answer with it too" in estimate.message
        friction, ratio = estimate.parameters["friction"], estimate.quantities["ratio"]
        assert friction.value - VISCOUS > 4 * friction.std
        assert friction.upper < 2 * VISCOUS
        assert ratio.lower == pytest.approx(friction.lower / INERTIA)
        held.append(friction.lower < VISCOUS < friction.upper)
    assert held.count(False) <= len(held) // 6


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.by_day(1)
def test_a_law_that_would_not_show_is_told_and_widens_nothing(seed: int) -> None:
    """With as much noise the misfit is gone; the number is off by more than its interval, but not by what is told."""
    estimate, right = (identified(law, 3e-3, seed, 0.15) for law in ("dry friction", "none"))
    for one in (estimate, right):
        assert one.verdict.trusted
        assert not one.suspects
        told = re.search(r"should O have [a-z ]+ as well, which .* to be from (\S+) to (\S+)", one.message)
        assert told
        friction = one.parameters["friction"]
        assert friction.upper - friction.lower < 4.5 * friction.std
        assert float(told[1]) < VISCOUS < float(told[2])
        assert float(told[2]) - float(told[1]) > 2 * (friction.upper - friction.lower)
    assert not estimate.parameters["friction"].lower < VISCOUS


@pytest.mark.parametrize(
    ("others", "told"),
    [
        (
            [("drag", 0.3, 0.2)],
            "drag as well, which may not show here, c is only known to be from 0.1 to 1.1",
        ),
        (
            [("drag", 2.0, 0.2)],
            "drag as well, which may not show here, c is only known to be from 0.9 to 2.2",
        ),
        ([("drag", 0.3, 0.2), ("coulomb", 3.0, 0.5)], "from 0.1 to 3.5"),
        ([("drag", 1.1, 0.1)], ""),
    ],
    ids=["less", "more", "both", "near"],
)
def test_an_interval_goes_from_the_lowest_to_the_highest(others: list[tuple[str, float, float]], told: str) -> None:
    """Another law may make of a sought friction less or more."""

    def value(centre: float, half: float) -> Value:
        return Value(centre, half / 2, centre - half, centre + half, True)

    there = {field: value(centre, half) for field, centre, half in others}
    laws = [OtherLaw("c", "O", field, np.zeros(1)) for field in there]
    found = wider_by_other_laws(laws, {"c": value(1.0, 0.1)}, lambda law: there[law.field])
    assert "".join(one.text for one in found).endswith(told)
    assert bool(found) == bool(told)


def test_laws_that_are_sought_are_no_other_laws() -> None:
    estimate = identified("dry friction", 3e-4, 0, 0.1, "drag", "coulomb")
    assert "other-friction-law" not in estimate.codes
    for name, true in (("friction", VISCOUS), ("drag", 0.0), ("coulomb", 0.0006)):
        assert estimate.parameters[name].lower <= true <= estimate.parameters[name].upper
