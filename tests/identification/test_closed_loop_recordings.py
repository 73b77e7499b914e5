"""Recordings of machines under feedback: what a controller logs is a channel, and a measured input drives the model."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shoal
import yaml
from scipy.integrate import solve_ivp
from shoal.errors import InputError
from shoal.identification.recording.observation import observe
from shoal.identification.recording.source import Channel
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene

sys.path.insert(0, str(Path(__file__).parents[1] / "mechanics"))
from controlled import pendulum

INERTIA, WEIGHT = 2.0 * 0.8**2 / 3, 2.0 * 9.81 * 0.4
TRUE = {"kp": 60.0, "kd": 6.0, "ki": 30.0, "drag": 0.8}


def loop(**gains: float) -> dict[str, Any]:
    """A pendulum under PID control whose hinge rubs by a smooth law."""
    data = pendulum(
        "u - drag*tanh(rate(hinge)/0.05)",
        ref="1 + 0.5*sin(3*t)",
        u="kp*(ref - phi) - kd*rate(hinge) + sum",
        speed="rate(hinge)",
        **{**TRUE, **gains},
    )
    return {**data, "states": {"sum": {"rate": "ki*(ref - phi)"}}, "solver": {"duration": 2.0}}


def exact(times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angle, rate and integral by scipy, (3, times), and the controller's output."""

    def output(t: Any, y: Any) -> Any:
        return 60.0 * (1 + 0.5 * np.sin(3 * t) - y[0]) - 6.0 * y[1] + y[2]

    def change(t: float, y: Any) -> list[float]:
        torque = output(t, y) - 0.8 * math.tanh(y[1] / 0.05) - WEIGHT * math.sin(y[0])
        return [y[1], torque / INERTIA, 30.0 * (1 + 0.5 * math.sin(3 * t) - y[0])]

    y = solve_ivp(change, (0, 2), [0.2, 0.0, 0.0], method="DOP853", t_eval=times, rtol=1e-12, atol=1e-12).y
    return y, output(times, y)


def test_a_channel_may_be_a_signal_or_a_state() -> None:
    """Also one that no load follows."""
    times = np.linspace(0.0, 1.0, 5)
    scene = Scene.parse(loop()).with_values({"solver.relative_tolerance": 1e-11, "solver.absolute_tolerance": 1e-11})
    run = simulate(scene, times, whole=True)
    y, output = exact(times)
    channels = tuple(Channel(signal=name) for name in ("u", "sum"))
    found = observe(run, channels, scene=scene)[0]
    assert found == pytest.approx(np.stack([output, y[2]], axis=1), abs=1e-7)
    (speed,) = observe(run, (Channel(signal="speed"),), scene=scene)
    assert speed[:, 0] == pytest.approx(y[1], abs=1e-8)


@pytest.mark.parametrize(
    ("fields", "why"),
    [
        ({"signal": "u", "unit": "N"}, "unit: a signal has that of its formula"),
        ({"signal": "u", "marker": "tip"}, "quantity: name a `signal` and nothing else"),
        ({"signal": "u", "quantity": "x"}, "quantity: name a `signal` and nothing else"),
        ({"marker": "tip"}, "quantity: name a `signal` and nothing else, or state what is measured: x, y"),
    ],
)
def test_channels_of_signals_are_refused_in_one_line(fields: dict[str, Any], why: str) -> None:
    with pytest.raises(ValueError, match=why):
        Channel(**fields)


def problem(
    folder: Path, scene: dict[str, Any], table: np.ndarray, names: str, channels: Any, **parameters: Any
) -> Path:
    np.savetxt(folder / "loop.csv", table, delimiter=",", header=names, comments="")
    (folder / "loop.yaml").write_text(yaml.safe_dump(scene))
    path = folder / "problem.yaml"
    source = {"kind": "file", "path": "loop.csv", "time": "t"}
    stated = {"name": "loop", "scene": "loop.yaml", "parameters": parameters, "channels": channels, "source": source}
    path.write_text(yaml.safe_dump(stated))
    return path


def test_a_signal_that_there_is_not_is_refused_by_name(tmp_path: Path) -> None:
    table = np.stack([np.linspace(0, 1, 20), np.linspace(0, 1, 20)], axis=1)
    path = problem(
        tmp_path,
        loop(),
        table,
        "t,x",
        [{"signal": "x", "column": "x"}],
        kp={"path": "signals.kp", "lower": 1, "upper": 99},
    )
    with pytest.raises(InputError, match="no signal or state 'x'; there are drag, kd"):
        shoal.identify(path)


@pytest.mark.slow
def test_gains_and_a_law_of_friction_are_recovered_from_what_a_controller_logs(tmp_path: Path) -> None:
    """Data of scipy's equations with noise: the intervals hold the truth, and are as narrow as the noise allows."""
    times, rng = np.linspace(0.0, 2.0, 101), np.random.default_rng(1)
    y, output = exact(times)
    noise = rng.standard_normal((3, len(times)))
    theta, u, held = y[0] - math.pi / 2 + 1e-3 * noise[0], output + 0.05 * noise[1], y[2] + 0.05 * noise[2]
    channels = [
        {"marker": "tip", "quantity": "angle", "column": "theta", "noise": 1e-3},
        {"signal": "u", "column": "u", "noise": 0.05},
        {"signal": "sum", "column": "sum", "noise": 0.05},
    ]
    bounds = {"kp": (10, 200), "kd": (0.5, 20), "ki": (1, 100), "drag": (0.0, 3.0)}
    sought = {name: {"path": f"signals.{name}", "lower": low, "upper": high} for name, (low, high) in bounds.items()}
    wrong = loop(kp=40.0, kd=4.0, ki=20.0, drag=0.3)
    table = np.column_stack([times, theta, u, held])
    found = shoal.identify(problem(tmp_path, wrong, table, "t,theta,u,sum", channels, **sought))
    assert found.verdict.trusted
    for name, true in TRUE.items():
        one = found.parameters[name]
        assert abs(one.value - true) < 3.5 * one.std
        assert one.lower < one.value < one.upper
        assert one.std < 0.02 * true


@pytest.mark.slow
def test_a_measured_input_drives_the_plant_of_a_closed_loop(tmp_path: Path) -> None:
    """The torque as the controller logged it: friction and mass without the controller."""
    times, rng = np.linspace(0.0, 2.0, 201), np.random.default_rng(2)
    y, output = exact(times)
    theta = y[0] - math.pi / 2 + 1e-3 * rng.standard_normal(len(times))
    data = pendulum("u - drag*tanh(rate(hinge)/0.05)", drag=0.3)
    data["signals"] |= {"u": {"table": np.column_stack([times, output]).tolist(), "smooth": True}}
    data["solver"] = {"duration": 2.0}
    data["bodies"]["arm"]["density"] *= 0.9
    density = data["bodies"]["arm"]["density"] / 0.9
    sought = {
        "drag": {"path": "signals.drag", "lower": 0.0, "upper": 3.0},
        "density": {"path": "bodies.arm.density", "lower": 0.5 * density, "upper": 2.0 * density},
    }
    channels = [{"marker": "tip", "quantity": "angle", "column": "theta", "noise": 1e-3}]
    found = shoal.identify(problem(tmp_path, data, np.column_stack([times, theta]), "t,theta", channels, **sought))
    for name, true in (("drag", 0.8), ("density", density)):
        one = found.parameters[name]
        assert abs(one.value - true) < 3.5 * one.std
        assert one.std < 0.02 * true
