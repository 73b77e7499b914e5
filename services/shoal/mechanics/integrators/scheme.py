"""The functions every integrator provides, chosen by the type of its settings at compile time.

`advance(tile, scheme, m, w, t, h)` moves the state in w by one step, `interpolate` gives the motion inside
the last step. An integrator is a file with a NamedTuple of settings, its declared facts, and a compiled
function with the signature of `advance`; compiled code then contains only the integrator that is used.

Settings carry a field `evaluations`, (1,): how many times the step has evaluated the forces so far.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from shoal.compile.choice import choose
from shoal.mechanics.dynamics import Work
from shoal.mechanics.integrators import dense
from shoal.mechanics.model import Arrays
from shoal.mechanics.numerics.tile import Array, Tile


class Facts(NamedTuple):
    """Declared properties of an integrator; what the rest of the library knows of it.

    Attributes:
        order: in time
        explicit: solves no equations for the end of the step but those of the constraints
        good_for: its use, in one line
        stable_step_times_frequency, stable_step_times_decay: the largest stable step times the highest frequency and
            times the fastest decay rate
        adaptive: chooses its steps by its tolerances
        conserves: the energy of a frictionless machine is constant up to round-off and Newton's tolerance
        mean_power: w.power is the mean over the step, by which the energy balance is as exact as that; else at its end
        constraint_forces: its accelerations are those of Gauss's principle, so that friction may depend on the forces
            of constraints
        sparse_constraints: never touches the dense matrices of the constraints where these are many, so that a run has
            no room for them
        warm_lanes: `make kernels` compiles it for tiles of lanes as well
        seconds_per_unknown: cost of a step without and with constraints, by order of magnitude on one core [s]; it
            only decides what is affordable, so that no answer depends on the load of the machine
        stages: evaluations by which the cost of a step is multiplied where a number of steps is to be afforded
    """

    order: int
    explicit: bool
    good_for: str
    stable_step_times_frequency: float = np.inf
    stable_step_times_decay: float = np.inf
    adaptive: bool = False
    conserves: bool = False
    mean_power: bool = False
    constraint_forces: bool = False
    sparse_constraints: bool = False
    warm_lanes: bool = False
    seconds_per_unknown: tuple[float, float] = (2e-8, 4e-7)
    stages: int = 1


def advance(tile: Tile, scheme: Any, m: Arrays, w: Work, t: float, h: float) -> float:
    """Move the state at the time t by one step; returns the step taken [s]. Pointers.

    h: the step to take, or for adaptive schemes the rest of the run, which is the most they may take.
    A scheme that cannot go on with a lane writes nan into its state.
    """
    raise NotImplementedError(type(scheme).__name__)


def interpolate(
    tile: Tile, scheme: Any, m: Arrays, w: Work, past: Array, x: float, h: float, q: Array, v: Array
) -> None:
    """Coordinates and rates at the fraction x of the last step, of h [s], into q and v, (rows, lanes). Pointers.

    past: coordinates, rates and accelerations at its beginning, (3 * unknowns, lanes); those at its end are in w.
    """
    raise NotImplementedError(type(scheme).__name__)


def restart(scheme: Any) -> None:
    """Forget earlier steps: what follows does not continue them smoothly."""
    raise NotImplementedError(type(scheme).__name__)


def adaptive(scheme: Any) -> bool:
    """Return whether the scheme chooses its steps itself."""
    raise NotImplementedError(type(scheme).__name__)


def averages(scheme: Any) -> bool:
    """Return whether the scheme leaves the mean power of its step in w.power."""
    raise NotImplementedError(type(scheme).__name__)


def implement(settings: type, step: Any, facts: Facts, inside: Any = dense.quintic, forget: Any = None) -> None:
    """Register kernels of an integrator by the type of its settings: `step`, and `inside` for the motion within it.

    forget: discards the memory of earlier steps. The parameters of the kernels are named as those of `advance`,
    `interpolate` and `restart`.
    """
    choose(advance, settings, step, forceinline=True)
    choose(interpolate, settings, inside)
    choose(restart, settings, forget or (lambda scheme: None))
    choose(adaptive, settings, (lambda scheme: True) if facts.adaptive else (lambda scheme: False))
    choose(averages, settings, (lambda scheme: True) if facts.mean_power else (lambda scheme: False))
