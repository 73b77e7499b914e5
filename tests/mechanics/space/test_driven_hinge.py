"""A hinge that a drive turns about an axis of the ground: no constraint too many, and the motion of the plane."""

from __future__ import annotations

from typing import Any

import numpy as np
from shoal.mechanics.analysis.evaluate import Evaluator
from shoal.mechanics.machine import Machine
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene


def arm(dimensions: int) -> Scene:
    """A pendulum on an arm that turns to and fro."""
    rest, axis = [0.0] * (dimensions - 1), {"axis": [0.0, 0.0, 1.0]} if dimensions == 3 else {}
    inertia: Any = [0.01, 0.05, 0.05] if dimensions == 3 else 0.05
    body = {"kind": "rigid-body", "mass": 1.2, "inertia": inertia, "centre_of_mass": [0.3, *rest]}
    body |= {"named_points": {"e": [0.7, *rest]}}
    ground, first = {"body": "ground", "point": [0.0, *rest]}, {"body": "a"}
    joints = {
        "O": {"first": ground, "second": first} | axis,
        "A": {"first": {"body": "a", "point": "e"}, "second": {"body": "b"}} | axis,
        "D": {"kind": "driven-angle", "first": ground, "second": first, "angle": "0.5*(1-cos(2*t))"} | axis,
    }
    return Scene.parse(
        {
            "name": "arm",
            "dimensions": dimensions,
            "gravity": [0.0, -9.81, 0.0][:dimensions],
            "bodies": {"a": body, "b": body},
            "joints": joints,
            "markers": {"e": {"body": "b", "point": "e"}},
            "solver": {"duration": 1.0},
        }
    )


def test_no_constraint_depends_on_others() -> None:
    """The length of the arm's direction was stated beside its cosine and its sine."""
    machine = Machine.of(arm(3))
    model = machine.model(1.0)
    jacobian = Evaluator(model).at(model.q0[:, 0]).jacobian.toarray()
    assert np.linalg.matrix_rank(jacobian) == len(jacobian) == model.unknowns - 1


def test_it_moves_as_in_the_plane() -> None:
    times = np.linspace(0.0, 1.0, 11)
    space, plane = (simulate(arm(dimensions), times) for dimensions in (3, 2))
    assert space.ok, space.message
    np.testing.assert_allclose(space.points[:, 0, :2], plane.points[:, 0], atol=1e-9)
