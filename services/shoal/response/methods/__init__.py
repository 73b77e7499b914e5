"""Methods by name: those of `METHODS`, and those that other packages add by entry points of `shoal.response.methods`.

`auto` is the one a user gets who does not choose. An entry point names a mapping of names to methods, such as that of
the methods of the literature, which serve comparison (`shoal_validation.methods`).
"""

from __future__ import annotations

from functools import cache
from importlib.metadata import entry_points

from shoal.errors import InputError
from shoal.response.methods.auto import auto
from shoal.response.methods.chaos import chaos
from shoal.response.methods.nested import nested
from shoal.response.methods.sampling import monte_carlo, sobol
from shoal.response.methods.time_warp import time_warp
from shoal.response.methods.torus import torus
from shoal.response.study import Method

METHODS: dict[str, Method] = {
    "auto": auto,
    "monte-carlo": monte_carlo,
    "sobol": sobol,
    "chaos": chaos,
    "nested": nested,
    "time-warp": time_warp,
    "torus": torus,
}


@cache
def methods() -> dict[str, Method]:
    """Return all methods by name, those of other packages last."""
    found = dict(METHODS)
    for point in entry_points(group="shoal.response.methods"):
        found |= point.load()
    return found


def get_method(name: str) -> Method:
    """Return the method of that name. Raises InputError."""
    found = METHODS if name in METHODS else methods()
    if name not in found:
        raise InputError(f"method: no method {name!r}; there are {', '.join(found)}")
    return found[name]


__all__ = ["METHODS", "get_method", "methods"]
