"""A sweep in pieces is the sweep."""

from __future__ import annotations

import numpy as np
from shoal.engines import get_engine
from shoal.engines.sweep import joined, pieces, sweep
from shoal.scene import load_scene


def test_pieces_of_a_sweep_make_the_whole() -> None:
    vary = {"initial.OA.angle": np.linspace(0.0, 1.0, 40), "initial.AB.angle": np.linspace(0.1, 0.4, 5)}
    grids = pieces(vary, 2)
    assert len(grids) == 4
    scene, engine = load_scene("rigid-double-pendulum"), get_engine("gauss")
    once = sweep(scene, vary, engine, 0.1)
    parts = joined([sweep(scene, grid, engine, 0.1) for grid in grids])
    assert parts.status == once.status
    assert all(np.array_equal(parts.grid[path], once.grid[path]) for path in vary)
    # Not to the last digit: how many lanes fit a tile decides the order of a sum.
    assert np.allclose(parts.displacements["B"], once.displacements["B"], rtol=0, atol=1e-12)
