"""Cost of a run by order of magnitude. A measured time would make the answer depend on the load of the machine."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from shoal.mechanics.integrators import facts


def seconds(model: Mapping[str, Any], integrator: str, steps: float) -> float:
    """Return the cost [s] of a number of steps; model: a trajectory's `model`, with its unknowns and constraints."""
    rate = facts(integrator).seconds_per_unknown[bool(model.get("constraints"))]
    return rate * float(model["unknowns"]) * steps


def affordable(model: Mapping[str, Any], integrator: str, budget: float) -> int:
    """Return the number of steps that a budget [s] allows, at least one."""
    return max(1, int(budget / seconds(model, integrator, facts(integrator).stages)))
