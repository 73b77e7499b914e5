"""The motion of a chain by MuJoCo and by both formulations of Exudyn, as the benchmark runs them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal_validation.benchmarks.chains import (
    STEP,
    chain,
    exudyn_bodies_run,
    exudyn_tree_run,
    measure,
    mujoco_run,
)


@pytest.mark.parametrize(
    ("run", "tolerance"), [(mujoco_run, 1e-12), (exudyn_tree_run, 1e-12), (exudyn_bodies_run, 2e-6)]
)
def test_the_tip_of_a_chain_is_where_other_engines_see_it(run: Any, tolerance: float) -> None:
    """The first two take the same steps of the same method; the third one is implicit and of second order."""
    steps = 300
    ours = get_engine("tree").simulate(chain(6), [0.0, steps * STEP])
    assert ours.ok, ours.message
    start, end = ours.marker("tip")
    assert np.linalg.norm(end - start) > 0.3
    np.testing.assert_allclose(run(6, steps, 1)[1], end, atol=tolerance)


@pytest.mark.slow
def test_every_row_of_the_benchmark_is_measured() -> None:
    rows = list(measure((5,), repeats=1))
    assert len({row.name for row in rows}) == len(rows) == 6
    # A time is what two runs take more than one, which a busy machine may turn round.
    assert all(np.isfinite(row.seconds) and row.gap < 1e-5 for row in rows)
