"""The choice of a method: bounds by a polynomial whose extremal points are run, statistics by polynomial chaos.

At long times, where runs with different periods are out of phase, bounds are by surrogates of cycles instead.
"""

from __future__ import annotations

from dataclasses import replace

from shoal.response.methods import chaos, long_time, sampling
from shoal.response.methods.bounds import bounds
from shoal.response.methods.by_word import by_word, differ
from shoal.response.methods.long_time import UnsuitableError, watch
from shoal.response.methods.nested import nested
from shoal.response.methods.quadrature import quadrature
from shoal.response.methods.time_warp import TimeWarp
from shoal.response.methods.torus import Torus
from shoal.response.study import COARSE, RUNS, Found, Study

NO_SHARES = 0.15
"""Error beyond which Sobol indices, which are off by its square (2 %), give way to those of more runs."""
SAMPLED = 8192
"""Quasi-random runs for Sobol's indices."""
CYCLES = 6
"""Cycles up to which single instants are followed."""
OUT_OF_PHASE = 1.0
"""Spread of the phase to either side [rad] beyond which polynomials take too high a degree: about the spread times the
highest harmonic, + 10."""
UNEVEN = 0.02
"""Cycles that differ more from the next are of more than one frequency."""


def auto(study: Study) -> Found:
    """Choose by the knowledge of the parameters and by the dependence of the answers on them.

    Intervals: `bounds`, `time-warp`, `torus`, or `by_word` where runs have different events. Distributions:
    quadrature, chaos or else quasi-random runs. Both: `nested`.
    """
    if not study.inputs.random.any():
        return _intervals(study)
    if study.inputs.mixed:
        return nested(study)
    if (smooth := quadrature(study)) is not None:
        return smooth
    found = chaos.grown(study, study.count or RUNS)
    assert found.error is not None
    off = chaos.shares(study, found.error)
    coarse = off > COARSE
    if not coarse.any():
        return found
    about = f"{found.why} is off by up to {off.max():.2g} of the standard deviation"
    if off.max() <= NO_SHARES:
        return replace(found, why=f"{about}; where it is, these runs tell, and it tells the shares only", coarse=coarse)
    sampled = sampling.of_distributions(study, SAMPLED)
    why = f"{about}; where it is, {sampled.why} tell"
    return replace(found, why=why, indices=sampled.indices, coarse=coarse)


def _intervals(study: Study) -> Found:
    if study.has_events and differ(study):
        return by_word(study)
    if study.over_time is None or study.when[-1] <= 0:
        return bounds(study)
    tried = ""
    try:
        seen = watch(study, long_time.STRETCHES[0])
        spread = seen.spread() if seen.turns > 2 * CYCLES else 0.0
        if spread <= OUT_OF_PHASE:
            return bounds(study)
        about = f"the phase spreads by {spread:.2g} rad to either side"
        for kind in (TimeWarp, Torus) if seen.uneven < UNEVEN else (Torus, TimeWarp):
            try:
                found = long_time.grown(study, kind, seen)
                return replace(found, why=f"{about}: {found.why}{tried}")
            except UnsuitableError as error:
                tried += f"; {error}"
    except UnsuitableError:
        return bounds(study)
    found = bounds(study)
    return replace(found, why=f"{found.why} (although {about}{tried})")
