"""The methods: one list. `auto` is the one a user gets who does not choose; the others serve comparison as well.

Surrogates of intervals are rows of one interface (`fitted.Plan`): places of the runs, and a fit.
"""

from __future__ import annotations

from shoal.errors import InputError
from shoal.response.methods import polynomial_fits as polynomials
from shoal.response.methods.auto import auto
from shoal.response.methods.chaos import chaos
from shoal.response.methods.envelope import rs_ht, rs_lmd
from shoal.response.methods.fitted import fitted
from shoal.response.methods.kriging import kriging
from shoal.response.methods.maximum_entropy import maximum_entropy
from shoal.response.methods.nested import nested
from shoal.response.methods.optimise import optimise
from shoal.response.methods.rbf import rbf
from shoal.response.methods.sampling import monte_carlo, scan, sobol, vertices
from shoal.response.methods.taylor import taylor
from shoal.response.methods.time_warp import time_warp
from shoal.response.methods.torus import torus
from shoal.response.study import Method

METHODS: dict[str, Method] = {
    "auto": auto,
    "scan": scan,
    "vertices": vertices,
    "monte-carlo": monte_carlo,
    "sobol": sobol,
    "taylor": fitted("taylor", taylor),
    "chebyshev": fitted("chebyshev", polynomials.chebyshev),
    "chebyshev-total": fitted("chebyshev-total", polynomials.chebyshev_total),
    "chebyshev-sparse": fitted("chebyshev-sparse", polynomials.chebyshev_sparse),
    "legendre": fitted("legendre", polynomials.legendre),
    "chaos": chaos,
    "maximum-entropy": maximum_entropy,
    "nested": nested,
    "optimise": optimise,
    "rbf": fitted("rbf", rbf),
    "kriging": fitted("kriging", kriging),
    "time-warp": time_warp,
    "torus": torus,
    "rs-ht": rs_ht,
    "rs-lmd": rs_lmd,
}


def get_method(name: str) -> Method:
    """Return the method of that name. Raises InputError."""
    if name not in METHODS:
        raise InputError(f"method: no method {name!r}; there are {', '.join(METHODS)}")
    return METHODS[name]


__all__ = ["METHODS", "get_method"]
