"""RS-HT: amplitude and phase by the Hilbert transform, at every instant, as polynomials. For comparison.

Huang et al., The empirical mode decomposition and the Hilbert spectrum for nonlinear and non-stationary time series
analysis, Proceedings of the Royal Society A 454, 1998. It errs at both ends of the time, where the transform does.
"""

from __future__ import annotations

from shoal.response.methods.envelope import hilbert_parts, respond_by_parts
from shoal.response.study import Found, Study


def rs_ht(study: Study) -> Found:
    """Raises InputError."""
    return respond_by_parts(study, "rs-ht", hilbert_parts)
