"""Lanes that differ in any number of a scene are the runs that a scene with that number gives alone."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import shoal
from scipy.integrate import solve_ivp
from shoal.engines.contract import Extremes, check_lanes
from shoal.errors import InputError
from shoal.scene import Scene

SPATIAL: dict[str, Any] = {
    "name": "top-and-arm",
    "dimensions": 3,
    "gravity": [0.0, 0.3, -9.81],
    "bodies": {
        "top": {
            "kind": "rigid-body",
            "mass": 1.0,
            "inertia": [[0.02, 0.001, 0.002], [0.001, 0.025, -0.001], [0.002, -0.001, 0.03]],
            "centre_of_mass": [0.0, 0.01, 0.2],
            "named_points": {"tip": [0.0, 0.0, 0.4]},
        },
        "load": {"kind": "point-mass", "mass": 0.3},
    },
    "joints": {
        "foot": {"kind": "spherical", "first": {"body": "ground", "point": [0.0, 0.0, 0.0]}, "second": {"body": "top"}},
        "string": {"kind": "distance", "first": {"body": "top", "point": "tip"}, "second": {"body": "load"}},
        "rail": {
            "kind": "coupling",
            "terms": [{"at": {"body": "load"}, "axis": "x"}, {"at": {"body": "load"}, "axis": "y", "factor": 0.5}],
            "value": 0.3,
        },
    },
    "loads": {
        "motor": {"kind": "torque", "at": {"body": "top"}, "torque": {"table": [[0.0, 0.1], [0.05, 0.2], [1.0, 0.3]]}},
        "push": {"kind": "force", "at": {"body": "load"}, "force": [0.5, 0.2, -0.1], "scale": 2.0},
    },
    "markers": {"tip": {"body": "top", "point": "tip"}, "load": {"body": "load"}},
    "initial": {"top": {"rotation": [0.5, 0.1, 0.0], "spin": [0.0, -4.9, 8.8]}, "load": {"position": [0.3, 0.0, 0.6]}},
    "solver": {"duration": 0.1, "integrator": "rk4", "step": 1e-3},
}


@pytest.mark.slow  # its time loop takes long to compile
@pytest.mark.parametrize(
    ("path", "values"),
    [
        ("loads.motor.torque.table.1.1", [0.1, 0.4]),
        ("loads.motor.torque.table.1.0", [0.03, 0.08]),
        ("loads.push.scale", [1.0, 3.0]),
        ("loads.push.force.1", [0.1, 0.4]),
        ("joints.rail.value", [0.299995, 0.300005]),
        ("bodies.top.inertia.0.0", [0.021, 0.024]),
        ("bodies.top.centre_of_mass.2", [0.15, 0.25]),
        ("bodies.load.mass", [0.2, 0.5]),
    ],
)
def test_lanes_in_space_are_runs_of_their_own(path: str, values: list[float]) -> None:
    """Rates that the scene leaves out follow from the least kinetic energy: the mass of every lane counts."""
    scene = Scene.parse(SPATIAL)
    found = shoal.sweep(scene, {path: np.array(values)}, verify=False)
    assert found.ok
    assert np.ptp(found.positions["load"], axis=0).max() > 1e-9
    for lane, value in enumerate(values):
        alone = shoal.simulate(scene, at=[0.1], set={path: value}, verify=False)
        assert found.positions["load"][lane] == pytest.approx(alone.points[-1, 1, :, 0], abs=1e-12)


def test_one_of_three_principal_moments_differs_from_lane_to_lane() -> None:
    """Euler: a body that spins about its first axis, and a little about the others, by the moments of each lane."""
    moments, spin, values = np.array([0.02, 0.024, 0.03]), [4.0, 0.2, 0.1], np.array([0.015, 0.022])
    body = {"kind": "rigid-body", "mass": 1.0, "inertia": moments.tolist(), "named_points": {"tip": [0.0, 0.3, 0.0]}}
    scene = Scene.parse(
        {
            "name": "tumbling",
            "dimensions": 3,
            "gravity": [0.0, 0.0, 0.0],
            "bodies": {"body": body},
            "markers": {"tip": {"body": "body", "point": "tip"}},
            "initial": {"body": {"position": [0.0, 0.0, 0.0], "rotation": [0.0, 0.0, 0.0], "spin": spin}},
            "solver": {"duration": 1.0},
        }
    )
    found = shoal.sweep(scene, {"bodies.body.inertia.0": values}, verify=False)
    assert found.ok
    for lane, value in enumerate(values):
        own = np.array([value, *moments[1:]])

        def slope(_: float, y: np.ndarray, own: np.ndarray = own) -> np.ndarray:
            turn, rate = y[:9].reshape(3, 3), y[9:]
            cross = np.array([[0.0, -rate[2], rate[1]], [rate[2], 0.0, -rate[0]], [-rate[1], rate[0], 0.0]])
            return np.concatenate([(turn @ cross).ravel(), -np.cross(rate, own * rate) / own])

        end = solve_ivp(slope, (0.0, 1.0), [*np.eye(3).ravel(), *spin], rtol=1e-12, atol=1e-13).y[:9, -1]
        assert found.positions["tip"][lane] == pytest.approx(0.3 * end.reshape(3, 3)[:, 1], abs=1e-8)


@pytest.mark.parametrize(
    ("body", "lanes", "refused"),
    [
        (
            {"kind": "rigid-body", "mass": 1.0, "inertia": [0.025, 0.025, 0.025]},
            {"inertia.0": [0.045, 0.02], "inertia.1": [0.002, 0.02], "inertia.2": [0.002, 0.02]},
            "principal moments 0.002, 0.002, 0.045",
        ),
        (
            {"kind": "rod", "length": 1.0, "height": 0.04, "section": "tube", "wall": 0.004, "density": 1e3},
            {"height": [0.012, 0.04], "wall": [0.018, 0.01]},
            "wall 0.018 m is more than half the diameter",
        ),
        (
            {"kind": "rod", "length": 1.0, "height": 0.04, "width": 0.01, "density": 1e3},
            {"height": [0.6, 0.04], "length": [0.5, 1.0]},
            "height 0.6 m is larger than the length",
        ),
    ],
)
def test_lanes_are_refused_that_no_body_is_whose_numbers_are_possible_one_by_one(
    body: dict[str, Any], lanes: dict[str, list[float]], refused: str
) -> None:
    """Each number is accepted beside those of the scene; with the others of its lane it is impossible."""
    start = {"position": [0.0, 0.0, 0.0], "rotation": [0.0, 0.0, 0.0], "spin": [1.0, 2.0, 3.0]}
    data = {"name": "alone", "dimensions": 3, "gravity": [0, 0, 0], "bodies": {"b": body}, "initial": {"b": start}}
    scene = Scene.parse({**data, "markers": {"m": {"body": "b", "point": "start"}}})
    values = {f"bodies.b.{field}": np.array(numbers) for field, numbers in lanes.items()}
    for path, numbers in values.items():
        for number in numbers.tolist():
            scene.with_values({path: number})
    with pytest.raises(InputError, match=refused):
        check_lanes(scene, values)
    accepted: Extremes = {}
    second = {path: numbers[1:] for path, numbers in values.items()}
    assert check_lanes(scene, second, accepted) == 1
    with pytest.raises(InputError, match=refused):
        check_lanes(scene, values, accepted)


@pytest.mark.parametrize("path", ["bodies.rod.modal_stiffness.0.0", "bodies.rod.modes.0.translation.1"])
def test_lanes_of_given_modes_are_runs_of_their_own(path: str) -> None:
    """Integrals over a modal body are numbers like others."""
    scene = shoal.load_scene("flexible-slider-crank").with_values({"solver.duration": 0.02})
    values = float(scene.value(path)) * np.array([0.99, 1.01])
    found = shoal.sweep(scene, {path: values}, verify=False)
    assert found.ok
    for lane, value in enumerate(values):
        alone = shoal.simulate(scene, at=[0.02], set={path: float(value)}, verify=False)
        for number, name in enumerate(scene.markers):
            assert found.positions[name][lane] == pytest.approx(alone.points[-1, number, :, 0], abs=1e-9)


def test_damping_of_modes_differs_from_lane_to_lane() -> None:
    """A vibrating modal rod: the more it is damped, the less of it is left."""
    rod = {"kind": "rod", "length": 1.0, "height": 0.01, "width": 0.01, "density": 7800.0, "youngs_modulus": 2e11}
    scene = Scene.parse(
        {
            "name": "reed",
            "gravity": [0.0, 0.0],
            "bodies": {"reed": {**rod, "element": "modal", "modes": 1, "retardation": 1e-4}},
            "joints": {
                "c": {"kind": "weld", "first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "reed"}}
            },
            "markers": {"tip": {"body": "reed", "point": "end"}},
            "initial": {"reed": {"modes": [1e-3]}},
            "solver": {"duration": 0.2, "integrator": "dop853", "samples": 400},
        }
    )
    found = shoal.sweep(scene, {"bodies.reed.retardation": np.array([0.0, 2e-4])}, verify=False)
    # Kelvin and Voigt: the amplitude falls with exp(-retardation omega^2 t/2), omega of the clamped rod.
    omega = 1.87510407**2 * np.sqrt(2e11 * 0.01**2 / 12 / 7800.0)
    damped = omega * np.sqrt(1 - (1e-4 * omega) ** 2)
    decay = 1e-4 * omega**2
    wanted = np.exp(-decay * 0.2) * (np.cos(damped * 0.2) + decay / damped * np.sin(damped * 0.2))
    assert found.positions["tip"][0, 1] == pytest.approx(1e-3 * np.cos(omega * 0.2), abs=2e-6)
    assert found.positions["tip"][1, 1] == pytest.approx(1e-3 * wanted, abs=2e-6)


def test_a_prepared_scene_says_which_number_lanes_share() -> None:
    """Prepared scenes run lanes side by side or not at all."""
    with pytest.raises(InputError, match=r"loads.motor.torque.table.1.1: cannot differ from lane to lane"):
        shoal.prepare(Scene.parse(SPATIAL))({"loads.motor.torque.table.1.1": np.array([0.1, 0.2])})
