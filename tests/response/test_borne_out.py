"""More careful runs reject a study where their errors matter."""

from __future__ import annotations

import pytest
from shoal.notebook import uncertain
from sliding import puck


@pytest.mark.parametrize("method", ["scan", "monte-carlo"])
def test_an_error_that_is_nothing_rejects_no_run(method: str) -> None:
    """At a single instant markers have no path; the error of a step, 1e-8 m, is nothing beside 2 m."""
    found = uncertain(puck(0.4, 0.12, 2000.0), ["initial.P.position.1=-1:1"], [2.0], method=method)
    assert found.ok, found.message
    assert found.step_error is not None
    assert found.step_error < 1e-6


def test_an_error_that_matters_names_what_it_is_held_against() -> None:
    """Steps of a tenth of a second through a peg: the widest coordinate and 1 % of its width."""
    coarse = puck(0.4, 0.12, 2000.0).with_values({"solver.integrator": "rk4", "solver.step": 0.1})
    found = uncertain(coarse, ["initial.P.position.1=-1:1"], [2.0], method="scan")
    assert found.status == "model-rejected"
    assert found.codes[0] == "model-rejected"
