"""Steps that are too long are in the intervals of a rigid machine: a pendulum by scipy, fitted as its solver says."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from shoal.identification import Estimate, Problem, identify

LENGTH, G, START = 0.8, 9.81, -0.3
NOISE = 1e-3
TIMES = np.linspace(0.0, 4.0, 201)


def fitted(folder: Path, solver: dict[str, Any]) -> Estimate:
    """The angle at the start and gravity, from the places of the bob."""
    run = solve_ivp(
        lambda t, y: [y[1], -G / LENGTH * np.cos(y[0])], (0, 4), [START, 0], t_eval=TIMES, rtol=1e-12, atol=1e-12
    )
    rng = np.random.default_rng(1)
    seen = [LENGTH * np.cos(run.y[0]), LENGTH * np.sin(run.y[0])]
    table = [TIMES, *(place + NOISE * rng.standard_normal(len(TIMES)) for place in seen)]
    np.savetxt(folder / "run.csv", np.column_stack(table), delimiter=",", header="t,x,y", comments="")
    bob = {"mass": 2.0, "inertia": 0.0, "centre_of_mass": [LENGTH, 0]}
    scene = {
        "name": "pendulum",
        "bodies": {"b": {"kind": "rigid-body", **bob, "named_points": {"end": [LENGTH, 0]}}},
        "joints": {"o": {"kind": "revolute", "first": {"body": "ground", "point": [0, 0]}, "second": {"body": "b"}}},
        "markers": {"m": {"body": "b", "point": "end"}},
        "initial": {"b": {"angle": START}},
        "solver": {"duration": 4.0, **solver},
    }
    (folder / "scene.yaml").write_text(json.dumps(scene))
    parameters = {
        "angle": {"path": "initial.b.angle", "lower": -1.0, "upper": 0.5},
        "gravity": {"path": "gravity.1", "lower": -12.0, "upper": -8.0},
    }
    channels = [{"marker": "m", "quantity": axis, "column": axis} for axis in ("x", "y")]
    source = {"kind": "file", "path": str(folder / "run.csv")}
    stated = {"name": "one", "scene": str(folder / "scene.yaml"), "parameters": parameters, "channels": channels}
    return identify(Problem.parse({**stated, "source": source}, "one"))


@pytest.mark.parametrize(
    "solver",
    [
        {"integrator": "dop853", "relative_tolerance": 1e-2, "absolute_tolerance": 1e-2},
        pytest.param({"integrator": "leapfrog", "step": 0.02}, marks=pytest.mark.slow),
        pytest.param({"integrator": "rk4", "step": 0.1}, marks=pytest.mark.slow),
    ],
)
def test_intervals_hold_what_long_steps_do_to_the_answer(tmp_path: Path, solver: dict[str, Any]) -> None:
    """With leapfrog gravity was 4.8e-3 m/s^2 off and told within 9e-4."""
    found = fitted(tmp_path, solver)
    for name, true in (("angle", START), ("gravity", -G)):
        value = found.parameters[name]
        assert value.lower < true < value.upper
        assert value.correction is not None
        assert abs(true - value.value) < abs(value.correction) + 3 * value.std
    assert "time-error" in found.codes


def test_close_steps_are_no_error(tmp_path: Path) -> None:
    found = fitted(tmp_path, {})
    assert found.parameters["gravity"].correction is None
    assert "time-error" not in found.codes
    assert found.parameters["gravity"].lower < -G < found.parameters["gravity"].upper
