"""The integrators: one file each, listed here."""

from __future__ import annotations

from typing import Any

from shoal.mechanics.integrators import generalized_alpha, leapfrog, rk4
from shoal.mechanics.integrators.scheme import Facts
from shoal.mechanics.model import Model
from shoal.mechanics.tile import Tile
from shoal.scene import Solver

INTEGRATORS: dict[str, Any] = {
    "leapfrog": leapfrog,
    "rk4": rk4,
    "generalized-alpha": generalized_alpha,
}


def facts(name: str) -> Facts:
    """Declared order and stability of an integrator."""
    declared: Facts = INTEGRATORS[name].FACTS
    return declared


def choose(solver: Solver, model: Model, tile: Tile, lanes: slice) -> Any:
    """Settings of the solver's integrator for one tile of lanes."""
    return INTEGRATORS[solver.integrator].settings(solver, model, tile, lanes)
