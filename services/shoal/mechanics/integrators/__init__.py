"""The integrators: one file each, listed here."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from shoal.errors import InputError
from shoal.mechanics.halts import Halts, halts
from shoal.mechanics.integrators import (
    dop853,
    energy_momentum,
    generalized_alpha,
    implicit_gauss,
    leapfrog,
    radau5,
    rk4,
    semi_implicit_euler,
)
from shoal.mechanics.integrators.scheme import Facts
from shoal.mechanics.model import Model
from shoal.mechanics.numerics.tile import Tile
from shoal.scene import Solver

INTEGRATORS: dict[str, Any] = {
    "leapfrog": leapfrog,
    "semi-implicit-euler": semi_implicit_euler,
    "rk4": rk4,
    "dop853": dop853,
    "radau5": radau5,
    "generalized-alpha": generalized_alpha,
    "energy-momentum": energy_momentum,
    "implicit-gauss": implicit_gauss,
}


FOLLOWED = 100.0
"""So many steps of a Runge-Kutta method may take the place of one, to follow the modes of bodies, which last."""
STRIDES = 100
"""With functions of time, an adaptive integrator takes at least so many steps unless the scene says otherwise."""


class Choice(NamedTuple):
    """Choice of an integrator: its name, the reason, and its largest step [s] (infinite without a limit)."""

    name: str
    reason: str
    limit: float


def facts(name: str) -> Facts:
    """Declared order and stability of an integrator."""
    declared: Facts = INTEGRATORS[name].FACTS
    return declared


def pick(solver: Solver, model: Model, limit: Callable[[Model, Facts], float]) -> Choice:
    """The integrator that a solver names, or for `auto` the one that suits the model.

    limit: largest stable step of a model under an integrator's facts, `stability.step_limit`.
    """
    if solver.integrator == "auto" and model.rubbing.size:
        return Choice("dop853", "auto: friction depends on the forces of joints", np.inf)
    if solver.integrator == "auto" and model.gaps.size:
        limit_of = limit(model, facts("leapfrog")) if model.flexible else np.inf
        name = "leapfrog" if model.flexible else "dop853"
        return Choice(name, "auto: events of contacts end steps of explicit integrators", limit_of)
    if solver.integrator != "auto":
        return Choice(solver.integrator, "named by the scene", limit(model, facts(solver.integrator)))
    if model.flexible == 0:
        if solver.step > limit(model, facts("rk4")) * (FOLLOWED if model.modal else 1.0):
            return Choice("radau5", "auto: springs or friction are faster than the step", np.inf)
        return Choice("dop853", "auto: nothing is stiff", np.inf)
    stable = limit(model, facts("leapfrog"))
    if solver.step <= stable:
        return Choice("leapfrog", f"auto: the step is within the stability limit {stable:.3e} s of leapfrog", stable)
    reason = f"auto: the step is beyond the stability limit {stable:.3e} s of leapfrog"
    return Choice("generalized-alpha", reason, limit(model, facts("generalized-alpha")))


def choose(solver: Solver, model: Model, tile: Tile, lanes: slice, name: str | None = None) -> Any:
    """Settings of the solver's integrator, or of the one that was picked for `auto`, for one tile of lanes."""
    if solver.max_step is None and model.functions.size > 0:
        # A machine at rest must not leap over what a drive does later.
        solver = solver.model_copy(update={"max_step": solver.duration / STRIDES})
    name = name or solver.integrator
    if model.rubbing.size and not facts(name).constraint_forces:
        others = " or ".join(other for other in INTEGRATORS if facts(other).constraint_forces)
        raise InputError(f"solver.integrator: {name} knows no friction by the forces of joints (mu); use {others}")
    if model.gaps.size and not facts(name).explicit:
        others = " or ".join(other for other in INTEGRATORS if facts(other).explicit)
        raise InputError(f"solver.integrator: {name} knows no contacts, as of {model.gap_fields[0]}; use {others}")
    return INTEGRATORS[name].settings(solver, model, tile, lanes)


def halting(solver: Solver, model: Model, name: str, end: float) -> Halts:
    """Return the breakpoints of a run up to `end` [s]: of functions of time, and of force laws."""
    if not facts(name).adaptive:
        return halts(model, end, solver.step, False)
    longest = solver.max_step if solver.max_step is not None else solver.duration / STRIDES
    return halts(model, end, longest, True)
