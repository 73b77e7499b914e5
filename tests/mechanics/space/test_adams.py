"""Joints in space against tables by MSC ADAMS, Project Chrono's reference data, where they are at hand."""

from __future__ import annotations

import gzip
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.scene import Scene

_PLACES = [folder / "shared" / "data" / "adams_joints" for folder in Path(__file__).parents]
TABLES = next((place for place in _PLACES if place.exists()), _PLACES[-1])
FIRST, SECOND = [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]
CASES: dict[str, tuple[list[float], list[float], dict[str, Any], float]] = {
    "Revolute": (FIRST, [0.04, 0.1, 0.1], {"kind": "revolute", "axis": [0, 1, 0]}, 1e-5),
    "Spherical": (FIRST, [0.04, 0.1, 0.1], {"kind": "spherical"}, 1e-3),
    "Universal": (SECOND, [0.1, 0.04, 0.1], {"kind": "universal", "axis": [1, 0, 0], "second_axis": [0, 0, 1]}, 1e-3),
    "Cylindrical": (FIRST, [0.04, 0.1, 0.1], {"kind": "cylindrical", "axis": [0, 0, 1]}, 5e-4),
    "Prismatic": (FIRST, [0.04, 0.1, 0.1], {"kind": "slider", "axis": [0, 0, 1], "rotation": "locked"}, 5e-4),
    "Distance": (SECOND, [0.04, 0.1, 0.1], {"kind": "distance", "second": {"body": "bar"}, "length": 2.0}, 1e-6),
}
"""Centre at the start [m], moments of inertia [kg m^2], joint, and how exact the table is [m].

Of the falls of 122 m that is half of the sixth digit. The pendulum is the same on a revolute and on a spherical joint,
and the tables of the two are 8.4e-4 m apart.
"""


@pytest.mark.slow  # compiles what machines in space need
@pytest.mark.skipif(not TABLES.exists(), reason="the tables are not at hand")
@pytest.mark.parametrize("joint", CASES)
def test_a_bar_on_a_joint_moves_as_adams_says(joint: str) -> None:
    centre, inertia, stated, exact = CASES[joint]
    lines = gzip.decompress((TABLES / f"{joint}_Case01_ADAMS_Pos.txt.gz").read_bytes()).decode().splitlines()
    head = next(k for k, line in enumerate(lines) if line.startswith("Time"))
    table = np.loadtxt(lines[head + 1 :])
    bar = {"kind": "rigid-body", "mass": 1.0, "inertia": inertia, "named_points": {"pin": [-x for x in centre]}}
    places = {"first": {"body": "ground", "point": [0.0, 0.0, 0.0]}, "second": {"body": "bar", "point": "pin"}}
    data = {
        "name": joint.lower(),
        "dimensions": 3,
        "gravity": [0.0, 0.0, -9.80665],
        "bodies": {"bar": bar},
        "joints": {"J": {**places, **stated}},
        "markers": {"centre": {"body": "bar"}},
        "initial": {"bar": {"position": centre}},
        "solver": {"duration": 5.0},
    }
    motion = get_engine("gauss").simulate(Scene.parse(data, joint), table[:, 0])
    assert motion.ok
    np.testing.assert_allclose(motion.marker("centre"), table[:, 1:4], atol=exact)


ORIGIN = {"body": "ground", "point": [0.0, 0.0, 0.0]}
PIN = {"first": ORIGIN, "second": {"body": "bar", "point": "pin"}}
MACHINES: dict[str, tuple[list[float], list[float], list[float], dict[str, Any], dict[str, Any], float]] = {
    "RotSpring": (
        FIRST, [-2.0, 0.0, 0.0], [0.04, 0.1, 0.1],
        {"J": {**PIN, "kind": "revolute", "axis": [0, 1, 0]}},
        {"K": {**PIN, "kind": "torsion-spring", "axis": [0, 1, 0], "stiffness": 200.0, "damping": 10.0}}, 2e-5,
    ),
    "TranSpring": ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.04, 0.1, 0.1], {},
                   {"K": {**PIN, "kind": "spring", "stiffness": 10.0, "damping": 0.5, "length": 0.0}}, 2e-5),
    "RevSpherical": (
        [2.0, 2.0, 0.0], [0.0, -2.0, 0.0], [0.1, 0.04, 0.1],
        {"arm": {**PIN, "kind": "distance", "length": 2.0},
         "level": {**PIN, "kind": "planar", "axis": [0, 0, 1], "rotation": "free"}}, {}, 5e-4,
    ),
    "LinActuator": (
        [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.04, 0.1, 0.1],
        {"J": {**PIN, "kind": "slider", "axis": [0, 0, 1], "rotation": "locked"},
         "drive": {"kind": "coupling", "terms": [{"at": {"body": "bar"}, "axis": "z"}], "value": "t"}}, {}, 1e-9,
    ),
}  # fmt: skip
"""Centre, pin in the bar's frame [m], moments, joints, loads, and how exact the table is; as Chrono's tests state them.

The spring starts without length. TranSpringCB is the table TranSpring once more.
"""


@pytest.mark.slow
@pytest.mark.skipif(not TABLES.exists(), reason="the tables are not at hand")
@pytest.mark.parametrize("name", MACHINES)
def test_a_bar_on_springs_and_actuators_moves_as_adams_says(name: str) -> None:
    centre, pin, inertia, joints, loads, exact = MACHINES[name]
    lines = gzip.decompress((TABLES / f"{name}_Case01_ADAMS_Pos.txt.gz").read_bytes()).decode().splitlines()
    table = np.loadtxt(lines[next(k for k, line in enumerate(lines) if line.startswith("Time")) + 1 :])
    data = {
        "name": name.lower(), "dimensions": 3, "gravity": [0.0, 0.0, -9.80665],
        "bodies": {"bar": {"kind": "rigid-body", "mass": 1.0, "inertia": inertia, "named_points": {"pin": pin}}},
        "joints": joints, "loads": loads, "markers": {"centre": {"body": "bar"}},
        "initial": {"bar": {"position": centre}}, "solver": {"duration": 5.0},
    }  # fmt: skip
    motion = get_engine("gauss").simulate(Scene.parse(data, name), table[:, 0])
    assert motion.ok, motion.message
    np.testing.assert_allclose(motion.marker("centre"), table[:, 1:4], atol=exact)
