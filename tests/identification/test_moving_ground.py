"""An accelerometer on a cart beside a spring whose other end a shaker moves, against scipy."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import shoal
import yaml
from scipy.integrate import solve_ivp
from shoal.identification import Problem


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.by_day(1)
def test_an_accelerometer_beside_a_spring_to_a_moving_point(seed: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(seed)
    mass, k, b, w = rng.uniform(1, 4), rng.uniform(50, 200), rng.uniform(1, 5), rng.uniform(3, 9)
    times = np.linspace(0.0, 4.0, 201)

    def force(t: np.ndarray | float, x: np.ndarray | float, v: np.ndarray | float) -> np.ndarray | float:
        return -b * v + k * (0.2 * np.exp(-t) * np.cos(w * t) - x)

    run = solve_ivp(lambda t, y: (y[1], force(t, *y) / mass), (0, 4), (0, 0), t_eval=times, rtol=1e-10, atol=1e-12)
    felt = force(times, *run.y) / mass + 0.02 * rng.standard_normal(len(times))
    ground = {"body": "ground"}
    scene = {
        "name": "cart", "gravity": [0.0, -9.81],
        "bodies": {"C": {"kind": "rigid-body", "mass": float(mass), "inertia": 1.0}},
        "ground_points": {"S": {"x": f"0.2*exp(-t)*cos({w}*t)", "y": 0}},
        "joints": {"rail": {"kind": "slider", "first": {**ground, "point": [0.0, 0.0]}, "second": {"body": "C"},
                            "rotation": "locked", "friction": 1.0}},
        "loads": {"K": {"kind": "spring", "first": {**ground, "point": "S"}, "second": {"body": "C"},
                        "stiffness": float(k), "length": 0.0}},
        "markers": {"imu": {"body": "C"}}, "initial": {"C": {"position": [0.0, 0.0], "velocity": [0.0, 0.0]}},
        "solver": {"duration": 4.0},
    }  # fmt: skip
    (tmp_path / "cart.yaml").write_text(yaml.safe_dump(scene))
    problem = {
        "name": "cart", "scene": str(tmp_path / "cart.yaml"), "source": {"kind": "file", "path": "run.csv"},
        "channels": [{"marker": "imu", "quantity": "ax", "column": "a", "unit": "m/s^2"}],
        "parameters": {"b": {"path": "joints.rail.friction", "lower": 0.1, "upper": 20.0}},
    }  # fmt: skip
    found = shoal.identify(Problem.parse(problem, "cart"), pd.DataFrame({"t": times, "a": felt}))
    value = found.parameters["b"]
    assert found.verdict.trusted, found.message
    # The interval is one of 95 %: twice as wide it holds the truth in all but a few of ten thousand.
    assert abs(value.value - b) < value.upper - value.lower < 0.5 * b
