"""The functions every integrator provides, which the time loop calls by their addresses.

`advance(tile, scheme, m, w, t, h)` moves the state in w by one step, `interpolate` gives the motion inside
the last step. An integrator is a file with a NamedTuple of settings, its declared facts, and a compiled
function with the signature of `advance`; the time loop is compiled once for all of them.

Settings carry a field `evaluations`, (1,): how many times the step has evaluated the forces so far.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit, typeof, types

from shoal.compile import structures
from shoal.compile.function_pointers import ask, call
from shoal.compile.pointers import raw_type
from shoal.compile.structures import Reference
from shoal.mechanics import kernels
from shoal.mechanics.dynamics import Work
from shoal.mechanics.integrators import dense
from shoal.mechanics.kernels import Kernel
from shoal.mechanics.model import Arrays, seen
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


class Scheme(NamedTuple):
    """An integrator as the time loop sees it: addresses of its kernels, storage of its settings, and some of its facts.

    forget: 0 where there are no earlier steps to forget. divides: whether its equations are divided by the square of
    its fixed step, so that a very short one is but round-off. evaluations: the counter of the settings. suggestion: the
    next step that an adaptive one would take [s], (1,).
    """

    advance: int
    interpolate: int
    forget: int
    adaptive: bool
    averages: bool
    divides: bool
    settings: Array
    evaluations: Array
    suggestion: Array


class Implementation(NamedTuple):
    """Kernels of an integrator; forget: None where it keeps nothing of earlier steps."""

    step: Any
    inside: Any
    forget: Any
    facts: Facts


IMPLEMENTATIONS: dict[type, Implementation] = {}
"""By type of settings."""


def implement(settings: type, step: Any, facts: Facts, inside: Any = dense.quintic, forget: Any = None) -> None:
    """Register kernels of an integrator by the type of its settings: `step`, and `inside` for the motion within it.

    forget: discards the memory of earlier steps. The parameters of the kernels are those of `advance`, `interpolate`
    and `restart`.
    """
    IMPLEMENTATIONS[settings] = Implementation(step, inside, forget, facts)


def connect(tile: Tile, settings: Any, arrays: Arrays, room: Work) -> Scheme:
    """Write settings where kernels read them, and compile their kernels or take them from the cache."""
    own, storage = IMPLEMENTATIONS[type(settings)], structures.storage()
    structures.write(storage, settings)

    def address(number: int) -> int:
        key = len(tile), type(settings), number
        return kernels.address(key, lambda: signatures(tile, settings, arrays, room)[number])

    step, inside, forget = (address(k) if own[k] else 0 for k in range(3))
    divides = not (own.facts.explicit or own.facts.adaptive)
    facts = own.facts.adaptive, own.facts.mean_power, divides
    suggestion = settings.control.suggestion if own.facts.adaptive else np.zeros(1)
    return Scheme(step, inside, forget, *facts, storage, settings.evaluations, suggestion)


def signatures(tile: Tile, settings: Any, arrays: Arrays, room: Work) -> list[Kernel]:
    """Return the kernels of an integrator with the types of their arguments: the step, the motion inside, `forget`."""
    own = IMPLEMENTATIONS[type(settings)]
    scheme, m, w = (Reference(raw_type(typeof(part))) for part in (settings, seen(arrays), room))
    number, rows, lanes = types.float64, types.CPointer(types.float64), typeof(tile)
    # What interpolates between states alone looks at no settings, and is the same for all.
    whose = rows if own.inside.py_func.__module__ == dense.__name__ else scheme
    step = own.step, (lanes, scheme, m, w, number, number)
    inside = own.inside, (lanes, whose, m, w, rows, number, number, rows, rows)
    return [step, inside, *([(own.forget, (scheme,))] if own.forget else [])]


@njit(cache=True, error_model="numpy", forceinline=True)
def advance(tile: Tile, scheme: Scheme, m: Arrays, w: Work, t: float, h: float) -> float:
    """Move the state at the time t by one step; returns the step taken [s]. Pointers.

    h: the step to take, or for adaptive schemes the rest of the run, which is the most they may take.
    A scheme that cannot go on with a lane writes nan into its state.
    """
    return ask(scheme.advance, (tile, scheme.settings, m, w, t, h))  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy", forceinline=True)
def interpolate(
    tile: Tile, scheme: Scheme, m: Arrays, w: Work, past: Array, x: float, h: float, q: Array, v: Array
) -> None:
    """Coordinates and rates at the fraction x of the last step, of h [s], into q and v, (rows, lanes). Pointers.

    past: coordinates, rates and accelerations at its beginning, (3 * unknowns, lanes); those at its end are in w.
    """
    call(scheme.interpolate, (tile, scheme.settings, m, w, past, x, h, q, v))


@njit(cache=True, error_model="numpy", forceinline=True)
def restart(scheme: Scheme) -> None:
    """Forget earlier steps: what follows does not continue them smoothly."""
    if scheme.forget != 0:
        call(scheme.forget, (scheme.settings,))
