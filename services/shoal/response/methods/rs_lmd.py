"""RS-LMD: amplitudes and phases by local mean decomposition, at every instant, as polynomials. For comparison.

Smith, The local mean decomposition and its application to EEG perception data, Journal of the Royal Society Interface
2, 2005; Jiang and Bai, Interval uncertainty quantification for the dynamics of multibody systems combing bivariate
Chebyshev polynomials with local mean decomposition, Mathematics 10, 2022. It smooths between turning points and is
exact for none.
"""

from __future__ import annotations

from shoal.response.methods.envelope import local_mean_parts, respond_by_parts
from shoal.response.study import Found, Study


def rs_lmd(study: Study) -> Found:
    """Raises InputError."""
    return respond_by_parts(study, "rs-lmd", local_mean_parts)
