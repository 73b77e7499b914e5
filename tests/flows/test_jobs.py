from __future__ import annotations

import numpy as np
import pytest
from shoal.engines.sweep import Sweep
from shoal.errors import InputError
from shoal.pictures.signals import residuals
from shoal_flows import jobs
from shoal_flows.jobs import Fit


def test_fit_carries_the_motion_of_what_it_found(fits: list[Fit]) -> None:
    fit = fits[0]
    assert fit.estimate.verdict.trusted
    left = residuals(fit.estimate)["recording"]
    assert np.mean(np.sum(left**2, axis=1)) == pytest.approx(fit.estimate.fitness, rel=1e-9)
    assert fit.motion.times[0] == 0
    assert fit.motion.times[-1] == fit.estimate.measurement.end
    assert np.allclose(fit.motion.marker("B")[-1], fit.estimate.predicted["recording"][-1], atol=1e-12)


def test_sweep_covers_the_grid(sweep: Sweep) -> None:
    assert sweep.grid["initial.OA.angle"].tolist() == [0, 0.25, 0.5, 0.75, 1]
    assert sweep.ok


@pytest.mark.parametrize("span", [(0.0, 1.0), (0.0, 1.0, 2.5), (0.0, 1.0, 0)])
def test_sweep_refuses_what_is_no_grid(span: tuple[float, ...]) -> None:
    with pytest.raises(InputError, match=r"vary: initial\.OA\.angle: needs \[low, high, count\]"):
        jobs.pieces({"initial.OA.angle": span}, 1)


def test_unknown_names_are_refused_in_one_line() -> None:
    with pytest.raises(InputError, match="no such scene"):
        jobs.simulated("nowhere", "gauss", {})
    with pytest.raises(InputError, match="vary: name at least one path"):
        jobs.pieces({}, 1)


def test_pieces_of_a_sweep_make_the_whole() -> None:
    vary = {"initial.OA.angle": (0.0, 1.0, 40), "initial.AB.angle": (0.1, 0.4, 5)}
    whole = {path: np.linspace(low, high, count) for path, (low, high, count) in vary.items()}
    parts = jobs.pieces(vary, 2)
    assert len(parts) == 4
    once = jobs.swept("rigid-double-pendulum", whole, "gauss", 0.1)
    joined = jobs.joined([jobs.swept("rigid-double-pendulum", part, "gauss", 0.1) for part in parts])
    assert joined.status == once.status
    assert all(np.array_equal(joined.grid[path], once.grid[path]) for path in vary)
    # Not to the last digit: how many lanes fit a tile decides the order of a sum.
    assert np.allclose(joined.displacements["B"], once.displacements["B"], rtol=0, atol=1e-12)
