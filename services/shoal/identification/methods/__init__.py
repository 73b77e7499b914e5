"""The methods: one list. `auto` is the one a user gets who does not choose."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from importlib import import_module

from shoal.errors import InputError
from shoal.identification.methods.auto import auto
from shoal.identification.methods.black_box import cma_es, differential_evolution
from shoal.identification.methods.casadi_shooting import casadi, casadi_multiple
from shoal.identification.methods.hybrid import hybrid
from shoal.identification.methods.least_squares import least_squares
from shoal.identification.methods.multi_start import multi_start
from shoal.identification.methods.multiple_shooting import multiple_shooting
from shoal.identification.methods.outcome import Method, Outcome
from shoal.identification.methods.progressive import progressive
from shoal.identification.methods.swarms import by_swarm, iafsa_unseeded
from shoal.swarm import OPTIMIZERS

METHODS: dict[str, Method] = {
    "auto": auto,
    "least-squares": least_squares,
    "progressive": progressive,
    "multiple-shooting": multiple_shooting,
    **{name: partial(by_swarm, swarm) for name, swarm in OPTIMIZERS.items()},
    "iafsa-unseeded": iafsa_unseeded,
    "multi-start": multi_start,
    "hybrid": hybrid,
    "differential-evolution": differential_evolution,
    "cma-es": cma_es,
    "casadi": casadi,
    "casadi-multiple": casadi_multiple,
}


_LATE = {
    "multi-start": "scipy.stats",
    "cma-es": "cma",
    "casadi": "shoal.engines.casadi.shooting",
    "casadi-multiple": "shoal.engines.casadi.multiple_shooting",
}
"""Modules that take a second or more to import, by the method that does so when it begins."""


def prepare(name: str) -> None:
    """Import what a method and the verdict import late, so that no clock counts it."""
    for module in ("scipy.optimize", _LATE.get(name, "scipy.optimize")):
        # The method itself says what is missing.
        with suppress(ImportError, InputError):
            import_module(module)


def get_method(name: str) -> Method:
    """The method of that name. Raises InputError."""
    if name not in METHODS:
        raise InputError(f"method: no method {name!r}; there are {', '.join(METHODS)}")
    return METHODS[name]


__all__ = ["METHODS", "Method", "Outcome", "get_method", "prepare"]
