"""The way into the compiled time loop."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from shoal.mechanics.integrators import INTEGRATORS, Choice, halting
from shoal.mechanics.integrators.scheme import connect
from shoal.mechanics.kernels import planned
from shoal.mechanics.machine import Machine
from shoal.mechanics.marched import frame_type, framed
from shoal.mechanics.model import Model
from shoal.mechanics.numerics.tile import SINGLE, WIDE, Tile
from shoal.mechanics.simulate import simulate
from shoal.mechanics.workspace import Workspace, at_start, gathered
from shoal.scene import load_scene

SCENES = (
    "flexible-double-pendulum",
    "rigid-double-pendulum",
    "andrews-squeezer",
    "n-four-bar-40",
    "ibm-double-pendulum",
    "flexible-spherical-double-pendulum",
)


def _frame(model: Model, integrator: str, tile: Tile) -> Any:
    solver, times = model.scene.solver, np.array([1e-3])
    halts = halting(solver, model, integrator, 1e-3)
    arrays, room = at_start(model, tile, slice(0, 1))
    with planned():
        settings = INTEGRATORS[integrator].settings(solver, model, tile, slice(0, 1))
        scheme = connect(tile, settings, arrays, room)
    return framed(tile, scheme, arrays, room, 1e-4, 10, times, model.marker_rows.ravel(), 1e-5, halts)


@pytest.mark.parametrize("tile", [pytest.param(SINGLE, id="single"), pytest.param(WIDE, id="wide")])
def test_frames_of_all_machines_are_of_one_type(tile: Tile) -> None:
    found: set[Any] = set()
    for name in SCENES:
        model = Machine.of(load_scene(name)).model(1e-3)
        for integrator in INTEGRATORS:
            found.add(frame_type(_frame(model, integrator, tile)))
            assert len(found) == 1, (name, integrator)


def test_a_block_holds_every_number_once() -> None:
    shared = np.arange(3.0)
    block, (one, (two, rest, count)) = gathered((shared, (shared, np.ones((2, 2)), 5)))
    assert one is two
    assert count == 5
    assert block.ctypes.data % 64 == 0
    one[:] = 7.0
    assert block[:3].tolist() == [7.0] * 3
    np.testing.assert_array_equal(rest, np.ones((2, 2)))


def test_a_workspace_forgets_its_last_run() -> None:
    machine = Machine.of(load_scene("andrews-squeezer"))
    solver, model, lane = machine.scene.solver, machine.model(0.01), slice(0, 1)
    halts = halting(solver, model, "radau5", 0.01)
    space = Workspace(solver, model, Choice("radau5", "", np.inf), SINGLE, lane, np.array([0.01]), halts)
    first = [np.array(part) for part in space.run(model, lane)]
    second = space.run(model, lane)
    for one, other in zip(first, second, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("element", ["ancf-cable", "ancf-quintic"])
def test_lanes_of_half_a_tile_move_as_those_of_a_whole_one(element: str) -> None:
    values = {f"bodies.{name}.element": element for name in ("OA", "AB")} | {"solver.step": 1e-5}
    scene = load_scene("flexible-double-pendulum").with_values(values)
    times, angles = np.array([1e-3, 2e-3]), np.linspace(0.6, 0.9, len(WIDE))
    whole = simulate(scene, times, {"initial.OA.angle": angles})
    for lanes in (5, 8, 9):
        part = simulate(scene, times, {"initial.OA.angle": angles[:lanes]})
        assert part.ok
        np.testing.assert_array_equal(part.points, whole.points[..., :lanes])
        np.testing.assert_array_equal(part.energy_drift, whole.energy_drift[:lanes])
    alone = simulate(scene, times, {"initial.OA.angle": angles[:1]})
    np.testing.assert_allclose(alone.points[..., 0], whole.points[..., 0], rtol=0, atol=1e-11)
