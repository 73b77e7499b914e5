"""What a run will cost, roughly. A measured time would make the answer depend on the machine's load."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from shoal.mechanics.integrators import facts

EXPLICIT, HELD, IMPLICIT, RADAU = 2e-8, 4e-7, 6e-6, 1.5e-5
"""Seconds per unknown and step: of an explicit step, of one with constraints, of an implicit one, of radau5."""
STAGES = 12
"""An explicit step that sees its error costs so many times as much, and is usually longer by as much."""


def seconds(model: Mapping[str, Any], integrator: str, steps: float) -> float:
    """Of so many steps of a model, of which a trajectory's `model` tells the unknowns and the constraints."""
    if facts(integrator).explicit:
        rate = HELD if model.get("constraints") else EXPLICIT
    else:
        rate = RADAU if facts(integrator).adaptive else IMPLICIT
    return rate * float(model["unknowns"]) * steps


def affordable(model: Mapping[str, Any], integrator: str, budget: float) -> int:
    """The steps that a budget [s] allows, at least one."""
    stages = STAGES if facts(integrator).explicit and facts(integrator).adaptive else 1
    return max(1, int(budget / seconds(model, integrator, stages)))
