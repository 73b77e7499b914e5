"""MuJoCo as an engine: open chains in the plane and in space; loops are refused, as its own are soft."""

from __future__ import annotations

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.engines.compare import compare
from shoal.errors import InputError
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene, load_scene

pytest.importorskip("mujoco")
TIMES = np.array([0.1, 0.3])
LINK = {"kind": "rigid-body", "mass": 1.5, "inertia": [[0.05, 0.01, 0], [0.01, 0.2, 0], [0, 0, 0.22]],
        "centre_of_mass": [0.4, 0.1, 0.05], "named_points": {"end": [0.8, 0.0, 0.1]}}  # fmt: skip


def chain() -> Scene:
    """Every kind of joint that it has, one stated from the child to its parent; at rates."""
    return Scene.parse({
        "name": "chain", "dimensions": 3, "gravity": [0.5, 0.0, -9.81],
        "bodies": dict.fromkeys("ABCD", LINK),
        "joints": {
            "S": {"kind": "spherical", "first": {"body": "ground", "point": [0, 0, 0]}, "second": {"body": "A"}},
            "R": {"first": {"body": "B"}, "second": {"body": "A", "point": "end"}, "axis": [1, 2, 0], "friction": 0.1},
            "P": {"kind": "slider", "first": {"body": "B", "point": "end"}, "second": {"body": "C"}, "axis": [1, 0, 1],
                  "rotation": "locked", "friction": 0.3},
            "W": {"kind": "weld", "first": {"body": "C", "point": "end"}, "second": {"body": "D"}},
        },
        "markers": {name: {"body": name, "point": "end"} for name in "ABCD"},
        "initial": {"A": {"rotation": [0.3, 0.2, 0.5], "spin": [1, -2, 3]}, "B": {"rotation": [-1.0, 0.4, 0.1]}},
        "solver": {"integrator": "dop853"},
    })  # fmt: skip


def test_a_chain_of_every_joint_moves_as_in_the_native_solver() -> None:
    found = compare(chain(), ["gauss", "tree", "mujoco"], TIMES)
    assert found.ok
    assert max(row["largest"] for row in found.differences()) < 1e-9
    ours, _, theirs = found.trajectories.values()
    assert np.max(np.abs(ours.angles - theirs.angles)) < 1e-9


def test_a_step_that_is_too_long_is_not_believed() -> None:
    rough = get_engine("mujoco").simulate(chain().with_values({"solver.step": 0.1, "solver.energy_tolerance": 1e-6}))
    assert not rough.ok


def test_the_planar_double_pendulum_is_the_native_one() -> None:
    pendulum = load_scene("rigid-double-pendulum")
    theirs = get_engine("mujoco").simulate(pendulum, TIMES)
    assert theirs.ok
    assert simulate(pendulum.with_values({"solver.integrator": "dop853"}), TIMES).distance(theirs) < 1e-10


def test_loops_are_refused_with_the_reason() -> None:
    with pytest.raises(InputError, match=r"cannot do closed loops; use gauss .*MuJoCo's are soft and open"):
        get_engine("mujoco").simulate(load_scene("n-four-bar-2"), TIMES)
