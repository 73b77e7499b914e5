"""Redundant constraints are left out of the sparse problem, and nothing but the cost of a step changes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.mechanics.assembly.build import build
from shoal.mechanics.independent import independent_rows
from shoal.mechanics.integrators import Choice
from shoal.mechanics.model import Model
from shoal.mechanics.runs import Runs
from shoal.scene import Scene, load_scene
from shoal.trajectory import Status

TIMES = np.linspace(0.05, 1.5, 30)


def cranks(angle: float = 1.0, rate: float = 6.0) -> Scene:
    """A bar on three parallel cranks, of which two would do, that passes both flat positions."""
    bodies = {name: bar(length) for name, length in (("c0", 0.5), ("c1", 0.5), ("c2", 0.5), ("bar", 2.0))}
    joints: dict[str, Any] = {}
    for k in range(3):
        crank = {"body": f"c{k}", "point": "start"}
        joints[f"foot{k}"] = {"kind": "revolute", "first": {"body": "ground", "point": [k, 0.0]}, "second": crank}
        head = {"body": "bar", "point": [float(k), 0.0]}
        joints[f"head{k}"] = {"kind": "revolute", "first": crank | {"point": "end"}, "second": head}
    initial = {"c0": {"angle": angle, "rate": rate}, "c2": {"angle": angle, "rate": rate}}
    solver = {"integrator": "rk4", "step": 1e-3, "duration": 1.5}
    return Scene.parse({"name": "cranks", "gravity": [0.0, -9.81], "bodies": bodies, "joints": joints, "solver": solver,
                        "initial": initial, "markers": {"P": {"body": "bar", "point": "end"}}})  # fmt: skip


def bar(length: float) -> dict[str, Any]:
    return {"kind": "rigid-body", "mass": length, "inertia": length**3 / 12, "centre_of_mass": [length / 2, 0.0],
            "named_points": {"end": [length, 0.0]}}  # fmt: skip


def run(scene: Scene, model: Model) -> Any:
    return Runs(scene, model, Choice("rk4", "", np.inf), alone=model.lanes == 1).run(TIMES)


def rows(model: Model) -> Any:
    return independent_rows(model.constraints, model.derived, model.q0[:, 0])


@pytest.mark.parametrize("scene", [cranks(), load_scene("bricard")], ids=["cranks", "bricard"])
def test_a_machine_moves_as_by_the_projection_on_all_its_constraints(
    monkeypatch: pytest.MonkeyPatch, scene: Scene
) -> None:
    """The projection chooses its pivots anew at every state, singular ones included, and leaves nothing out before."""
    model = build(scene)
    assert len(rows(model)) < model.constraints.size
    ours = run(scene, model)
    monkeypatch.setattr("shoal.mechanics.model.independent_rows", lambda *_: None)
    theirs = run(scene, build(scene))
    assert ours.status == theirs.status == (Status.OK,)
    np.testing.assert_allclose(ours.points, theirs.points, rtol=0.0, atol=1e-9)


def test_what_depends_at_one_position_only_is_not_left_out() -> None:
    """All bars of a parallelogram on one line: one constraint depends on others there, and nowhere else."""
    flat = load_scene("parallelogram").with_values({"initial.left.angle": 0.0, "initial.right.angle": 0.0})
    assert rows(build(flat)) is None


def test_a_lane_in_which_a_constraint_is_not_redundant_is_held_by_it() -> None:
    """Another place of the middle crank's foot, from which it reaches its head as well, locks the machine.

    The first lane, in which it can move, has chosen what is left out.
    """
    head = np.array([1.0 + 0.5 * np.cos(1.0), 0.5 * np.sin(1.0)])
    foot = head[:, None] - 0.5 * np.array([np.cos([1.0, 1.7]), np.sin([1.0, 1.7])])
    values = {f"joints.foot1.first.point.{k}": foot[k] for k in range(2)}
    found = get_engine("gauss").simulate_many(cranks(rate=0.0), values, TIMES)
    alone = get_engine("gauss").simulate(cranks(rate=0.0), TIMES)
    np.testing.assert_allclose(found.points[..., 0], alone.points[..., 0], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(
        found.points[:, 0, :, 1], np.broadcast_to(found.points[0, 0, :, 1], (len(TIMES), 2)), atol=1e-9
    )
