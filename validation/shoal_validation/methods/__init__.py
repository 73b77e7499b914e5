"""Methods of the literature for comparison: the entry point `comparison` of the group `shoal.response.methods`.

Their names are those of `shoal uncertain --method`. Surrogates are rows of one interface, `fitted.Plan`.
"""

from __future__ import annotations

from shoal.response.study import Method, fitted

from shoal_validation.methods import polynomial_fits as polynomials
from shoal_validation.methods.envelope import rs_ht, rs_lmd
from shoal_validation.methods.grids import scan, vertices
from shoal_validation.methods.interpolation import kriging, rbf
from shoal_validation.methods.maximum_entropy import maximum_entropy
from shoal_validation.methods.optimise import optimise
from shoal_validation.methods.taylor import taylor

METHODS: dict[str, Method] = {
    "scan": scan,
    "vertices": vertices,
    "taylor": fitted("taylor", taylor),
    "chebyshev": fitted("chebyshev", polynomials.chebyshev),
    "chebyshev-total": fitted("chebyshev-total", polynomials.chebyshev_total),
    "chebyshev-sparse": fitted("chebyshev-sparse", polynomials.chebyshev_sparse),
    "legendre": fitted("legendre", polynomials.legendre),
    "maximum-entropy": maximum_entropy,
    "optimise": optimise,
    "rbf": fitted("rbf", rbf),
    "kriging": fitted("kriging", kriging),
    "rs-ht": rs_ht,
    "rs-lmd": rs_lmd,
}

__all__ = ["METHODS"]
