"""The methods: one list, each imported when it is first asked for. `auto` is what a user gets who does not choose."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from shoal.errors import InputError
from shoal.identification.methods.outcome import Method, Outcome
from shoal.swarm import OPTIMIZERS


def _auto() -> Method:
    from shoal.identification.methods.auto import auto

    return auto


def _least_squares() -> Method:
    from shoal.identification.methods.least_squares import least_squares

    return least_squares


def _progressive() -> Method:
    from shoal.identification.methods.progressive import progressive

    return progressive


def _multiple_shooting() -> Method:
    from shoal.identification.methods.multiple_shooting import multiple_shooting

    return multiple_shooting


def _swarm(name: str, *, seeded: bool) -> Method:
    from shoal.identification.methods.swarms import by_swarm

    return partial(by_swarm, OPTIMIZERS[name], seeded)


def _multi_start() -> Method:
    from shoal.identification.methods.multi_start import multi_start

    return multi_start


def _hybrid() -> Method:
    from shoal.identification.methods.hybrid import hybrid

    return hybrid


def _differential_evolution() -> Method:
    from shoal.identification.methods.differential_evolution import differential_evolution

    return differential_evolution


def _cma_es() -> Method:
    from shoal.identification.methods.cma_es import cma_es

    return cma_es


def _casadi() -> Method:
    from shoal.identification.methods.casadi_shooting import casadi

    return casadi


def _casadi_multiple() -> Method:
    from shoal.identification.methods.casadi_shooting import casadi_multiple

    return casadi_multiple


METHODS: dict[str, Callable[[], Method]] = {
    "auto": _auto,
    "least-squares": _least_squares,
    "progressive": _progressive,
    "multiple-shooting": _multiple_shooting,
    **{name: partial(_swarm, name, seeded=True) for name in OPTIMIZERS},
    "iafsa-unseeded": partial(_swarm, "iafsa", seeded=False),
    "multi-start": _multi_start,
    "hybrid": _hybrid,
    "differential-evolution": _differential_evolution,
    "cma-es": _cma_es,
    "casadi": _casadi,
    "casadi-multiple": _casadi_multiple,
}
"""Every swarm of `shoal.swarm` is one, with seeds where it takes them."""


def get_method(name: str) -> Method:
    """The method of that name, with all that it imports. Raises InputError."""
    if name not in METHODS:
        raise InputError(f"method: no method {name!r}; there are {', '.join(METHODS)}")
    return METHODS[name]()


__all__ = ["METHODS", "Method", "Outcome", "get_method"]
