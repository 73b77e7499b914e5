"""What a recording tells by its own sample times: against Fisher's matrix of scipy's pendulum."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from scipy.integrate import solve_ivp
from shoal.identification import Measurement, Problem
from shoal.identification.design import design
from shoal.notebook import design as designed
from shoal.trajectory import Array

VALUES = {"angle": -0.9, "inertia": 0.1, "friction": 0.05}
NOISE = 0.01
EVEN, UNEVEN = np.linspace(0.0, 3.0, 7), np.array([0.1, 0.15, 0.6, 1.0, 1.8, 2.9, 3.0])


def swing(values: Array, times: Array) -> Array:
    """The angle of a physical pendulum of 1 kg, its centre 0.5 m from the pin."""
    start, inertia, friction = values

    def motion(_: float, y: Any) -> list[float]:
        return [y[1], (-9.81 * 0.5 * np.cos(y[0]) - friction * y[1]) / (inertia + 0.25)]

    found = solve_ivp(motion, (0.0, 3.0), [start, 0.0], "DOP853", times, rtol=1e-11, atol=1e-12).y[0]
    return np.asarray(found)


def deviations(times: Array) -> Array:
    """By central differences, (parameters,)."""
    at, h = np.array(list(VALUES.values())), 1e-5
    slope = np.array([(swing(at + h * e, times) - swing(at - h * e, times)) / (2 * h * NOISE) for e in np.eye(3)])
    return np.asarray(np.sqrt(np.diag(np.linalg.inv(slope @ slope.T))))


def problem(folder: Path, path: str | None = None) -> Problem:
    """Of the pendulum, which is written into a folder."""
    body = {"kind": "rigid-body", "mass": 1.0, "inertia": 0.1, "centre_of_mass": [0.5, 0.0]}
    scene = {
        "name": "pendulum", "bodies": {"OA": body},
        "joints": {"O": {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "OA"}}},
        "markers": {"A": {"body": "OA", "point": [1.0, 0.0]}},
    }  # fmt: skip
    (folder / "pendulum.yaml").write_text(yaml.safe_dump(scene))
    paths = {"angle": "initial.OA.angle", "inertia": "bodies.OA.inertia", "friction": "joints.O.friction"}
    parameters = {
        name: {"path": paths[name], "lower": min(0.1 * value, 2 * value), "upper": max(10 * value, 0.0), "start": value}
        for name, value in VALUES.items()
    }
    return Problem.parse({
        "name": "swing", "scene": str(folder / "pendulum.yaml"), "parameters": parameters,
        "channels": [{"marker": "A", "quantity": "angle", "column": "th", "noise": NOISE}],
        "source": {"kind": "file", "path": path},
    }, "swing")  # fmt: skip


@pytest.mark.parametrize("times", [EVEN, UNEVEN], ids=["even", "uneven"])
def test_the_precision_of_now_is_that_of_the_instants_that_were_recorded(times: Array, tmp_path: Path) -> None:
    stated = problem(tmp_path)
    measured = Measurement.single(times, tuple(stated.channels), np.zeros((len(times), 1)), "", None, NOISE)
    found = design(stated, measurement=measured)
    np.testing.assert_allclose(found.now.std, deviations(times), rtol=1e-3)
    assert found.rate == pytest.approx(6.0 / (times[-1] - times[0]))
    if times is EVEN:
        place = next(
            precision for sensor, precision in found.ranked if sensor.name == "A" and len(sensor.channels) == 1
        )
        np.testing.assert_allclose(place.std, found.now.std, rtol=1e-3)


def test_a_design_about_the_start_reads_the_recording_for_its_times(tmp_path: Path) -> None:
    path = tmp_path / "swing.csv"
    table = np.column_stack([EVEN, swing(np.array(list(VALUES.values())), EVEN)])
    np.savetxt(path, table, delimiter=",", header="t,th", comments="")
    found = designed(problem(tmp_path, str(path)), about="start")
    assert (found.duration, found.rate) == (3.0, 2.0)
    np.testing.assert_allclose(found.now.std, deviations(EVEN), rtol=1e-3)
