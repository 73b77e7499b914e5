"""The methods: one list. `auto` is the one a user gets who does not choose; the others serve comparison as well."""

from __future__ import annotations

from shoal.errors import InputError
from shoal.response.methods.auto import auto
from shoal.response.methods.chaos import chaos
from shoal.response.methods.chebyshev import chebyshev
from shoal.response.methods.chebyshev_sparse import chebyshev_sparse
from shoal.response.methods.chebyshev_total import chebyshev_total
from shoal.response.methods.kriging import kriging
from shoal.response.methods.legendre import legendre
from shoal.response.methods.maximum_entropy import maximum_entropy
from shoal.response.methods.nested import nested
from shoal.response.methods.optimise import optimise
from shoal.response.methods.rbf import rbf
from shoal.response.methods.rs_ht import rs_ht
from shoal.response.methods.rs_lmd import rs_lmd
from shoal.response.methods.sampling import monte_carlo, sobol
from shoal.response.methods.scan import scan
from shoal.response.methods.taylor import taylor
from shoal.response.methods.time_warp import time_warp
from shoal.response.methods.torus import torus
from shoal.response.methods.vertices import vertices
from shoal.response.study import Method

METHODS: dict[str, Method] = {
    "auto": auto,
    "scan": scan,
    "vertices": vertices,
    "monte-carlo": monte_carlo,
    "sobol": sobol,
    "taylor": taylor,
    "chebyshev": chebyshev,
    "chebyshev-total": chebyshev_total,
    "chebyshev-sparse": chebyshev_sparse,
    "legendre": legendre,
    "chaos": chaos,
    "maximum-entropy": maximum_entropy,
    "nested": nested,
    "optimise": optimise,
    "rbf": rbf,
    "kriging": kriging,
    "time-warp": time_warp,
    "torus": torus,
    "rs-ht": rs_ht,
    "rs-lmd": rs_lmd,
}


def get_method(name: str) -> Method:
    """The method of that name. Raises InputError."""
    if name not in METHODS:
        raise InputError(f"method: no method {name!r}; there are {', '.join(METHODS)}")
    return METHODS[name]


__all__ = ["METHODS", "get_method"]
