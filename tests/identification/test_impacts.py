"""Restitution and place of a stop from a recording through its impacts. Data by scipy's integrator and events."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from scipy.integrate import solve_ivp
from shoal.identification import Measurement, Problem, Verdict, identify

DOWN = -np.pi / 2
PULL = 1.5 * 9.81
"""Of a uniform rod of 1 m on a pin: its angle x from below obeys x'' = -PULL sin x [1/s^2]."""
RESTITUTION, STOP, LET_GO = 0.8, 0.2, np.pi / 3
NOISE, END, SAMPLES = 2e-3, 2.5, 125
ROD = {
    "name": "rod", "gravity": [0.0, -9.81],
    "bodies": {"B": {"kind": "rigid-body", "mass": 1.0, "inertia": 1 / 12, "centre_of_mass": [0.5, 0.0]}},
    "joints": {"O": {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "B"},
                     "stops": {"min": DOWN, "restitution": 0.5}}},
    "markers": {"P": {"body": "B"}}, "initial": {"B": {"angle": DOWN + LET_GO, "rate": 0.0}},
    "solver": {"duration": END},
}  # fmt: skip
TRUE = {"restitution": RESTITUTION, "stop": DOWN + STOP}
SOUGHT = {
    "restitution": {"path": "joints.O.stops.restitution", "lower": 0.1, "upper": 0.95, "start": 0.5},
    "stop": {"path": "joints.O.stops.min", "lower": DOWN - 0.5, "upper": DOWN + 0.5, "start": DOWN + 0.35},
}


def angles(times: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Return the angle of the rod from below [rad]."""

    def hit(_: float, y: np.ndarray[Any, Any]) -> float:
        return float(y[0] - STOP)

    hit.terminal, hit.direction = True, -1  # type: ignore[attr-defined]
    found, t, state = np.empty(len(times)), 0.0, np.array([LET_GO, 0.0])
    while t < times[-1]:
        way: Any = solve_ivp(lambda _, y: [y[1], -PULL * np.sin(y[0])], (t, times[-1]), state, "DOP853", events=hit,
                        rtol=1e-11, atol=1e-12, dense_output=True)  # fmt: skip
        inside = (times >= t) & (times <= way.t[-1])
        found[inside] = way.sol(times[inside])[0]
        t, state = way.t[-1], np.array([STOP + 1e-13, -RESTITUTION * way.y[1, -1]])
    return found


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_restitution_and_stop_are_identified_from_a_wrong_start(seed: int, tmp_path: Path) -> None:
    """Five impacts; the start has other times and heights of all of them."""
    path = tmp_path / "rod.yaml"
    path.write_text(yaml.safe_dump(ROD))
    times = np.linspace(0.0, END, SAMPLES + 1)[1:]
    data = angles(times) + DOWN + NOISE * np.random.default_rng(seed).standard_normal(SAMPLES)
    stated = {"name": "stop", "scene": str(path), "parameters": SOUGHT, "noise": NOISE, "source": {"kind": "file"},
              "channels": [{"marker": "P", "quantity": "angle", "column": "angle"}]}  # fmt: skip
    problem = Problem.parse(stated, "stop")
    measured = Measurement.single(times, tuple(problem.channels), data[:, None], "rod", noise=NOISE)
    found = identify(problem, measurement=measured, seed=seed)
    assert found.verdict is Verdict.IDENTIFIED, found.message
    for name, true in TRUE.items():
        known = found.parameters[name]
        assert known.std < 5e-4
        assert known.value == pytest.approx(true, abs=3.5 * known.std)
