"""What a design promises of sensors on a machine is what equations that share no code with Shoal say."""

from __future__ import annotations

import copy
import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from click.testing import CliRunner
from newton_euler import NewtonEuler
from shoal.cli import main
from shoal.errors import InputError
from shoal.identification import Problem
from shoal.identification.design import Design, Sensor, design
from shoal.trajectory import Array

NOISE = {"acceleration": 0.05, "rate": 0.005, "force": 0.02, "torque": 0.01}
DURATION, RATE = 1.0, 25.0
PIN = {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "arm"}, "friction": 0.2}
MACHINE: dict[str, Any] = {
    "name": "sprung-pendulum",
    "bodies": {"arm": {"kind": "rigid-body", "mass": 1.4, "inertia": 0.08, "centre_of_mass": [0.4, 0.05]}},
    "joints": {"O": PIN},
    "loads": {
        "coil": {
            "kind": "torsion-spring",
            "first": {"body": "ground", "point": [0.0, 0.0]},
            "second": {"body": "arm"},
            "stiffness": 9.0,
            "damping": 0.0,
            "angle": 0.3,
        }
    },
    "markers": {"near": {"body": "arm", "point": [0.2, 0.1]}, "far": {"body": "arm", "point": [0.9, -0.1]}},
    "initial": {"arm": {"angle": -0.6, "rate": 1.5}},
}
SOUGHT = {
    "mass": ("bodies", "arm", "mass"),
    "inertia": ("bodies", "arm", "inertia"),
    "friction": ("joints", "O", "friction"),
}


@pytest.fixture(scope="module")
def planned(tmp_path_factory: pytest.TempPathFactory) -> Design:
    folder = tmp_path_factory.mktemp("design")
    (folder / "scene.yaml").write_text(yaml.safe_dump({**MACHINE, "solver": {"duration": 1.0}}))
    parameters = {}
    for name, path in SOUGHT.items():
        value = at(MACHINE, path)
        parameters[name] = {"path": ".".join(path), "lower": 0.5 * value, "upper": 2.0 * value, "start": value}
    channels = [{"marker": "near", "quantity": axis, "column": axis} for axis in ("ax", "ay")]
    data = {"name": "felt", "scene": str(folder / "scene.yaml"), "parameters": parameters, "channels": channels}
    problem = Problem.parse({**data, "source": {"kind": "file"}}, "felt")
    return design(problem, noise=1e-3, sensor_noise=NOISE, duration=DURATION, rate=RATE)


def at(data: dict[str, Any], path: tuple[str, ...]) -> float:
    for key in path:
        data = data[key]
    return float(data)  # type: ignore[arg-type]


def shown(data: dict[str, Any]) -> list[Any]:
    """Of every instant the machine, coordinates, rates, accelerations and what the pin exerts."""
    machine = NewtonEuler(data, {"arm": np.array([0.0, 0.0, -0.6])}, {"arm": np.array([0.0, 0.0, 1.5])})
    times = np.arange(1, round(DURATION * RATE) + 1) / RATE
    return [(machine, q, v, *machine.solve(q, v, t)) for q, v, t in machine.run(times)]


def signals(states: list[Any], sensor: Sensor) -> Array:
    """What a sensor shows over its noise, by Newton and Euler, (samples, channels)."""
    rows = []
    for machine, q, v, a, exerted in states:
        if sensor.in_joint:
            rows.append(
                exerted["O"][:2] / NOISE["force"] if sensor.quantity == "force" else exerted["O"][2:] / NOISE["torque"]
            )
            continue
        place = MACHINE["markers"].get(sensor.name) or {"body": "arm", "point": [0.0, 0.0]}
        felt = machine.specific_force(place, sensor.tilt, q, v, a) / NOISE["acceleration"]
        position = machine.place(place, q, v).at / 1e-3
        rate = [machine.rate(place, v) / NOISE["rate"]]
        kinds = {"position": position, "accelerometer": felt, "one-axis": felt[:1], "rate": rate}
        rows.append(kinds[sensor.quantity] if sensor.quantity != "imu" else [*felt, *rate])
    return np.array(rows)


@cache
def varied() -> list[tuple[float, list[Any], list[Any]]]:
    """Of each parameter the step, and the states beyond and before."""
    found = []
    for path in SOUGHT.values():
        value = at(MACHINE, path)
        above, below = copy.deepcopy(MACHINE), copy.deepcopy(MACHINE)
        above[path[0]][path[1]][path[2]] = value * (1 + 1e-4)
        below[path[0]][path[1]][path[2]] = value * (1 - 1e-4)
        found.append((2e-4 * value, shown(above), shown(below)))
    return found


def deviations(sensor: Sensor) -> Array:
    """Standard deviations by the Fisher matrix of central differences, (parameters,)."""
    jacobian = np.stack(
        [(signals(above, sensor) - signals(below, sensor)).ravel() / step for step, above, below in varied()], axis=1
    )
    return np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))


def test_sensors_tell_what_the_fisher_matrix_of_newton_and_euler_says(planned: Design) -> None:
    told: dict[tuple[str, str], tuple[Sensor, Array]]
    told = {(sensor.name, sensor.quantity): (sensor, found.std) for sensor, found in planned.ranked}
    wanted = [("near", "imu"), ("far", "imu"), ("far", "accelerometer"), ("far", "one-axis"), ("O", "force")]
    (rate,) = [key for key in told if key[1] == "rate"]
    for key in (*wanted, rate, ("far", "position")):
        sensor, std = told[key]
        if np.all(np.isfinite(std)):
            np.testing.assert_allclose(std, deviations(sensor), rtol=2e-3, err_msg=sensor.label)
    assert all(np.all(np.isfinite(told[key][1])) for key in wanted)


def test_an_accelerometer_of_one_axis_is_turned_to_where_it_tells_most(planned: Design) -> None:
    (sensor,) = [one for one, _ in planned.ranked if (one.name, one.quantity) == ("far", "one-axis")]
    tilts = np.arange(8) * np.pi / 8
    scores = []
    for tilt in tilts:
        std = deviations(Sensor("far", "arm", (0.9, -0.1), "one-axis", tilt=float(tilt)))
        scores.append(np.max(std / planned.aim.span))
    assert sensor.tilt == pytest.approx(tilts[int(np.argmin(scores))])


STRAIN, PUSH, YOUNG, HEIGHT, WIDTH = 1e-6, 0.5, 2e9, 0.02, 0.03
CANTILEVER = {
    "name": "cantilever",
    "gravity": [0.0, 0.0],
    "bodies": {
        "rod": {
            "kind": "rod",
            "length": 1.0,
            "height": HEIGHT,
            "width": WIDTH,
            "density": 1000.0,
            "youngs_modulus": YOUNG,
            "element": "ancf-cable",
            "elements": 8,
        }
    },
    "joints": {"O": {"kind": "weld", "first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "rod"}}},
    "loads": {"tip": {"kind": "force", "at": {"body": "rod", "point": "end"}, "force": [0.0, PUSH]}},
    "markers": {"tip": {"body": "rod", "point": "end"}},
    "initial": {"from": "statics"},
    "solver": {"duration": 0.01, "integrator": "generalized-alpha", "step": 1e-3},
}


@pytest.mark.slow
def test_strain_gauges_are_weighed_along_a_rod(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """At rest P (L - s) h / (2 E I) tells E to noise / (strain / E) / sqrt(samples): most at the clamp."""
    (tmp_path / "cantilever.yaml").write_text(yaml.safe_dump(CANTILEVER))
    modulus = {"path": "bodies.rod.youngs_modulus", "lower": 1e9, "upper": 4e9, "start": YOUNG, "scale": "linear"}
    data = {"name": "bent", "scene": "cantilever.yaml", "parameters": {"modulus": modulus}, "noise": 1e-3}
    data |= {"channels": [{"marker": "tip", "quantity": "y", "column": "y"}], "source": {"kind": "file"}}
    (tmp_path / "bent.yaml").write_text(yaml.safe_dump(data))
    monkeypatch.chdir(tmp_path)
    options = ["--sensor-noise", f"strain={STRAIN}", "--duration", "0.01", "--rate", "1000", "--json"]
    ran = CliRunner().invoke(main, ["design", "bent.yaml", "--about", "start", *options])
    assert ran.exit_code == 0, ran.output
    answer = json.loads(ran.stdout)
    assert answer["sensor_noise"] == {"strain": STRAIN}
    gauges = [row for row in answer["ranked"] if row["quantity"] == "strain"]
    assert gauges[0]["point"] == [0.02, 0.0]
    for row in gauges[:4]:
        strain = PUSH * (1.0 - row["point"][0]) * row["height"] / (YOUNG * WIDTH * HEIGHT**3 / 12)
        assert row["std"]["modulus"] == pytest.approx(STRAIN / (strain / YOUNG) / np.sqrt(10), rel=0.02)
    # The gauge in micrometres per metre beats a camera that sees millimetres.
    (camera,) = [row for row in answer["ranked"] if (row["marker"], row["quantity"]) == ("tip", "position")]
    assert gauges[0]["std"]["modulus"] < camera["std"]["modulus"]
    bad = CliRunner().invoke(main, ["design", "bent.yaml", "--about", "start", "--sensor-noise", "strane=1e-6"])
    assert bad.exit_code == 2
    assert "sensor_noise: no sensor of 'strane'; there are acceleration, rate" in bad.output


def test_sensors_of_the_problem_need_their_noise(planned: Design) -> None:
    channels = [{"marker": "near", "quantity": "ax", "column": "ax"}]
    parameters = {"mass": {"path": "bodies.OA.density", "lower": 1.0, "upper": 2.0}}
    data = {"name": "felt", "scene": "rigid-double-pendulum", "parameters": parameters, "channels": channels}
    problem = Problem.parse({**data, "source": {"kind": "file"}}, "felt")
    with pytest.raises(InputError, match=r"sensor_noise\.acceleration: felt states none for its accelerations; give"):
        design(problem, duration=1.0, rate=50.0)
