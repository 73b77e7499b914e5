"""The one function every integrator provides, chosen by the type of its settings at compile time.

`advance(tile, scheme, m, w, t, step)` moves the state in w by one step. An integrator is a file with a
NamedTuple of settings, its declared facts, and a compiled function with the signature of `advance`;
compiled code then contains only the integrator that is used.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from numba import types
from numba.extending import overload

from shoal.mechanics.dynamics import Work
from shoal.mechanics.model import Arrays
from shoal.mechanics.tile import Tile


class Facts(NamedTuple):
    """What an integrator promises: order in time, and the largest stable step times frequency and times decay rate."""

    order: int
    explicit: bool
    stable_step_times_frequency: float
    stable_step_times_decay: float


def advance(tile: Tile, scheme: Any, m: Arrays, w: Work, t: float, step: float) -> float:
    """Move the state at the time t by one step of at most `step` [s]; returns the step taken. Pointers."""
    raise NotImplementedError(type(scheme).__name__)


def implement(settings: type, kernel: Any) -> None:
    """Let compiled calls of `advance` with settings of this type run `kernel`."""

    @overload(advance)
    def choose(tile, scheme, m, w, t, step):  # type: ignore[no-untyped-def]
        if not (isinstance(scheme, types.BaseNamedTuple) and scheme.instance_class is settings):
            return None
        return lambda tile, scheme, m, w, t, step: kernel(tile, scheme, m, w, t, step)
