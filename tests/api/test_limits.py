"""How much work a request is: counted where steps are given, bounded where the integrator chooses them."""

from __future__ import annotations

from typing import Any

import orjson
import pytest
from shoal.api.limits import TooMuch
from shoal.api.operations import Simulate
from shoal.api.settings import Settings
from shoal.api.tasks import Bench, call
from shoal.engines import get_engine


def ask(work: int, **values: Any) -> dict[str, Any]:
    """Ten seconds of a pendulum by a service that computes so much."""
    request = Simulate(scene="single-pendulum", at=[10.0], set={f"solver.{k}": v for k, v in values.items()})
    bench = Bench(get_engine("gauss"), Settings(max_work=work))
    found: dict[str, Any] = orjson.loads(call(bench, ("simulate", request), print))
    return found


@pytest.mark.parametrize("integrator", ["auto", "dop853", "radau5"])
def test_adaptive_steps_are_bounded(integrator: str) -> None:
    """A tolerance that needs more steps than the service computes ends when they are taken, however long the first."""
    with pytest.raises(TooMuch, match=r"solver\.relative_tolerance: .* this service computes no more"):
        ask(1000, integrator=integrator, step=0.1, relative_tolerance=1e-13)


def test_the_first_step_of_an_adaptive_integrator_is_not_its_work() -> None:
    """It was refused for its first step, of which there is one; the bound leaves the numbers as they are."""
    found = ask(100_000, integrator="dop853", step=1e-6)
    assert found["status"] == ["ok"]
    assert found["points"] == ask(10**9, integrator="dop853", step=1e-6)["points"]


def test_steps_that_are_given_are_counted() -> None:
    with pytest.raises(TooMuch, match=r"solver\.step: 1e\+06 steps"):
        ask(100_000, integrator="leapfrog", step=1e-5)
    with pytest.raises(TooMuch, match=r"solver\.max_step: "):
        ask(100_000, integrator="dop853", max_step=1e-5)
