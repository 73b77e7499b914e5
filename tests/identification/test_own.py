"""Parameters that some recordings have for themselves: a gyroscope whose clock is not the camera's."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from shoal.errors import InputError
from shoal.identification import Problem, Verdict, identify
from shoal.trajectory import Array

DELAY, CLOCK, FRICTION, START = 0.137, 1.01, 0.1, (-0.2, 1.0)
PARAMETERS: dict[str, Any] = {
    "angle": {"path": "initial.OA.angle", "lower": -1.0, "upper": 0.5},
    "rate": {"path": "initial.OA.rate", "lower": -5.0, "upper": 5.0},
    "friction": {"path": "joints.O.friction", "lower": 0.01, "upper": 1.0},
    "delay": {"path": "measurement.delay", "lower": -0.5, "upper": 0.5, "own": ["gyro"]},
    "clock": {"path": "measurement.clock", "lower": 0.9, "upper": 1.1, "own": ["gyro"]},
}


def table(path: Path, times: Array, **signals: Array) -> str:
    columns = {"t": times, **signals}
    np.savetxt(path, np.column_stack([*columns.values()]), delimiter=",", header=",".join(columns), comments="")
    return str(path)


def problem(folder: Path, **changes: Any) -> Problem:
    """A pendulum of 1 kg at 1 m that a camera sees, and whose rate is recorded later by another clock."""

    def slope(_: float, state: Sequence[float]) -> list[float]:
        return [state[1], -9.81 * np.cos(state[0]) - FRICTION * state[1]]

    motion = solve_ivp(slope, (0.0, 4.0), START, dense_output=True, rtol=1e-10, atol=1e-12).sol
    rng, seen, felt = np.random.default_rng(8), np.linspace(0.0, 3.0, 91), np.linspace(0.0, 2.8, 141)
    angle, rate = motion(seen)[0], motion(felt / CLOCK + DELAY)[1]
    x, y = np.cos(angle) + 1e-3 * rng.standard_normal(91), np.sin(angle) + 1e-3 * rng.standard_normal(91)
    rate = rate + 1e-2 * rng.standard_normal(141)
    camera = [{"marker": "A", "quantity": q, "column": q, "noise": 1e-3} for q in ("x", "y")]
    gyro = [{"marker": "A", "quantity": "rate", "column": "rate", "noise": 1e-2}]
    recordings = {
        "camera": {"kind": "file", "path": table(folder / "camera.csv", seen, x=x, y=y), "channels": camera},
        "gyro": {"kind": "file", "path": table(folder / "gyro.csv", felt, rate=rate), "channels": gyro},
    }
    stated = {"name": "two", "scene": "single-pendulum", "parameters": PARAMETERS, "recordings": recordings}
    return Problem.parse({**stated, **changes}, "two")


@pytest.mark.slow
def test_a_sensor_that_is_late_beside_a_camera(tmp_path: Path) -> None:
    found = identify(problem(tmp_path))
    assert found.verdict is Verdict.IDENTIFIED
    truth = {"angle": START[0], "rate": START[1], "friction": FRICTION, "gyro.delay": DELAY, "gyro.clock": CLOCK}
    assert set(found.parameters) == set(truth)
    for name, value in found.parameters.items():
        # Intervals of 95 %, of one draw of the noise, with half as much beside them.
        assert abs(value.value - truth[name]) < 0.75 * (value.upper - value.lower), name
    assert found.parameters["gyro.delay"].upper - found.parameters["gyro.delay"].lower < 5e-3


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"parameters": {**PARAMETERS, "delay": {**PARAMETERS["delay"], "own": ["imu"]}}}, "parameters.delay.own: imu"),
        ({"quantities": {"late": "delay"}}, "parameters.delay.own: ties and quantities"),
    ],
)
def test_recordings_that_there_are_not_and_expressions_are_refused(
    changes: dict[str, Any], words: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=words):
        problem(tmp_path, **changes)
