"""One fit, one comparison and one sweep, shared by the tests of what is made of them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from shoal.engines.compare import Comparison
from shoal.engines.sweep import Sweep
from shoal.identification import Measurement
from shoal.notebook import compare
from shoal.requests.sweep import Sweep as SweepRequest
from shoal_flows import jobs
from shoal_flows.jobs import Cell, Fit
from shoal_flows.report import morning

PROBLEM = "paper-case-1"
SCENE = "flexible-double-pendulum"


@pytest.fixture(scope="session")
def measurement() -> Measurement:
    return jobs.measured(PROBLEM)


@pytest.fixture(scope="session")
def fits(measurement: Measurement) -> list[Fit]:
    return [jobs.fit(Cell(PROBLEM, "least-squares", seed), measurement) for seed in (0, 1)]


@pytest.fixture(scope="session")
def comparison() -> Comparison:
    return compare(SCENE, ["gauss", "exudyn", "casadi"])


@pytest.fixture(scope="session")
def sweep() -> Sweep:
    return jobs.swept(SweepRequest(SCENE, {"initial.OA.angle": np.linspace(0.0, 1.0, 5)}))


@pytest.fixture(autouse=True, scope="session")
def no_morning_page() -> Iterator[None]:
    """Spare the many flows of the tests the page that each would write; test_morning.py writes it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(morning, "refresh", lambda: None)
        yield
