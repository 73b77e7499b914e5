"""Relative coordinates as an engine: open chains in the plane and in space move as the native solver says."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.engines.compare import compare
from shoal.errors import InputError
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene, load_scene

FINE = {"integrator": "dop853", "relative_tolerance": 1e-11, "absolute_tolerance": 1e-12}
TIMES = np.array([0.1, 0.3, 0.6])
LINK = {"kind": "rigid-body", "mass": 1.5, "inertia": [0.05, 0.2, 0.22], "centre_of_mass": [0.4, 0.1, 0.05],
        "named_points": {"end": [0.8, 0.0, 0.1]}}  # fmt: skip


def branched(**more: Any) -> Scene:
    """A tree of every kind of joint, one of them stated from the child to its parent."""
    ground = {"body": "ground", "point": [0.0, 0.0, 0.0]}
    rod = {"kind": "rod", "length": 0.7, "height": 0.02, "width": 0.04, "density": 1000.0}
    return Scene.parse({
        "name": "branched", "dimensions": 3, "gravity": [0.5, 0.0, -9.81], "solver": FINE,
        "bodies": {"A": LINK, "B": LINK, "C": rod, "D": LINK},
        "joints": {
            "S": {"kind": "spherical", "first": ground, "second": {"body": "A"}},
            "R": {"first": {"body": "B"}, "second": {"body": "A", "point": "end"}, "axis": [1, 2, 0], "friction": 0.1},
            "P": {"kind": "slider", "first": {"body": "A", "point": "end"}, "second": {"body": "C"}, "axis": [1, 0, 1],
                  "rotation": "locked", "friction": 0.3},
            "W": {"kind": "weld", "first": {"body": "B", "point": "end"}, "second": {"body": "D"}},
        },
        "loads": {"F": {"kind": "force", "at": {"body": "D", "point": "end"}, "force": [1, -2, 3]},
                  "T": {"kind": "torque", "at": {"body": "B"}, "torque": 0.4, "axis": [0, 1, 1]}},
        "markers": {name: {"body": name, "point": "end"} for name in "ABCD"},
        "initial": {"A": {"rotation": [0.3, 0.2, 0.5], "spin": [1, -2, 3]}, "B": {"rotation": [-1.0, 0.4, 0.1]}},
        **more,
    })  # fmt: skip


def test_a_tree_of_every_joint_moves_as_in_the_native_solver() -> None:
    theirs, ours = get_engine("tree").simulate(branched(), TIMES), simulate(branched(), TIMES)
    assert theirs.ok
    assert ours.ok
    assert ours.distance(theirs) < 1e-9
    assert np.max(np.abs(ours.angles - theirs.angles)) < 1e-9


def test_a_planar_pendulum_is_compared() -> None:
    pendulum = load_scene("rigid-double-pendulum").with_values({"solver.integrator": "dop853"})
    found = compare(pendulum, ["gauss", "tree"], TIMES)
    assert found.ok
    assert max(row["largest"] for row in found.differences()) < 1e-10
    ours, theirs = found.trajectories.values()
    assert np.max(np.abs(ours.angles - theirs.angles)) < 1e-10


def test_lanes_are_run_one_by_one() -> None:
    spins = np.array([1.0, -1.0])
    found = get_engine("tree").simulate_many(branched(), {"initial.A.spin.0": spins}, TIMES)
    assert found.ok
    alone = get_engine("tree").simulate(branched().with_values({"initial.A.spin.0": -1.0}), TIMES)
    assert found.points[..., 1] == pytest.approx(alone.points[..., 0], abs=1e-12)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"loads": {"F": {"kind": "force", "at": {"body": "D"}, "force": [1, 0, 0], "follows": True}}},
         "F.follows: engine"),
        ({"loads": {"T": {"kind": "torque", "at": {"body": "D"}, "torque": 1.0, "reaction": {"body": "A"}}}},
         "T.reaction: engine tree"),
        ({"loads": {"F": {"kind": "force", "at": {"body": "D"}, "force": [1, 0, 0], "scale": "t"}}},
         "cannot do functions of time; use gauss or exudyn"),
    ],
)  # fmt: skip
def test_what_it_cannot_do_is_refused(change: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        get_engine("tree").simulate(branched(**change), TIMES)


def test_loops_are_refused() -> None:
    with pytest.raises(InputError, match="engine tree cannot do closed loops"):
        get_engine("tree").simulate(load_scene("n-four-bar-2"), TIMES)
