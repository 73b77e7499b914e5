"""Long chains in space: what a step and a start have to do grows with the number of bodies, not faster."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from shoal.mechanics import saddle
from shoal.mechanics.assembly.build import build
from shoal.mechanics.assembly.redundancy import redundant_joints
from shoal.mechanics.halts import halts
from shoal.mechanics.integrators import Choice
from shoal.mechanics.numerics.tile import SINGLE
from shoal.mechanics.start.start import body_states
from shoal.mechanics.workspace import Workspace
from shoal.scene import Scene


def chain(count: int, kind: str, **more: Any) -> Scene:
    """Bodies in a row on balls, or on hinges that turn them up and sideways by turns."""
    bodies, joints = {}, {}
    before: dict[str, Any] = {"body": "ground", "point": [0.0, 0.0, 0.0]}
    for k in range(count):
        bodies[f"B{k}"] = {"kind": "rigid-body", "mass": 1.0, "inertia": [0.01, 0.02, 0.02],
                           "centre_of_mass": [0.1, 0.01, 0.02], "named_points": {"end": [0.2, 0.0, 0.0]}}  # fmt: skip
        axis = {"axis": [0.0, 1.0, 0.0] if k % 2 else [0.0, 0.0, 1.0]} if kind == "revolute" else {}
        joints[f"J{k}"] = {"kind": kind, "first": before, "second": {"body": f"B{k}"}} | axis
        before = {"body": f"B{k}", "point": "end"}
    return Scene.parse({"name": "chain", "dimensions": 3, "gravity": [0, 0, -9.81], "bodies": bodies,
                        "joints": joints | more, "markers": {"e": before}})  # fmt: skip


def work(count: int, kind: str) -> Any:
    """Entries of the factor, and of the constraints' derivatives."""
    model = build(chain(count, kind))
    pattern = saddle.analyse(model.unknowns, model.mass_entries, model.constraints, np.arange(model.constraints.size))[
        0
    ]
    return np.array([len(pattern.row), model.constraints.parts, model.unknowns])


@pytest.mark.parametrize("kind", ["spherical", "revolute"])
def test_the_work_of_a_step_grows_with_the_number_of_bodies(kind: str) -> None:
    assert work(40, kind) / work(20, kind) == pytest.approx(2.0, rel=0.08)


def redundant(scene: Scene) -> tuple[str, ...]:
    """The joints that hold a machine twice as it starts."""
    model = build(scene)
    return redundant_joints(scene, body_states(model.frames, scene, model.q0[:, 0], model.v0[:, 0]))


def test_a_long_chain_has_no_redundant_joint_until_one_holds_it_twice() -> None:
    """A rod along the first bar holds what the bar's ball joint holds; both are named, and no other joints."""
    free = chain(40, "spherical")
    assert redundant(free) == ()
    again = {"kind": "distance", "first": {"body": "ground", "point": [0.2, 0.0, 0.5]},
             "second": {"body": "B0", "point": "end"}}  # fmt: skip
    other = again | {"first": {"body": "ground", "point": [0.2, 0.5, 0.0]}}
    third = again | {"first": {"body": "ground", "point": [0.7, 0.0, 0.0]}}
    held = chain(40, "spherical", K0=again, K1=other, K2=third)
    assert redundant(held) == ("J0", "K2"), "the others pull across the bar"


def room(count: int, **solver: Any) -> int:
    """Numbers that a march of a chain holds."""
    scene = chain(count, "revolute").with_values({"solver.step": 1e-3, **solver})
    model, name = build(scene), scene.solver.integrator
    chosen, none = Choice(name, "named", np.inf), halts(model, 1e-3, 1e-3, False)
    return Workspace(scene.solver, model, chosen, SINGLE, slice(0, 1), np.array([1e-3]), none).size


@pytest.mark.slow
def test_the_room_of_a_march_grows_with_the_number_of_bodies() -> None:
    explicit = {"solver.integrator": "rk4"}
    assert room(80, **explicit) / room(40, **explicit) == pytest.approx(2.0, rel=0.05)
    assert room(40, **{"solver.integrator": "radau5"}) > 4 * room(40, **explicit)  # its steps are dense
