"""Lines of uncertain machines: whether reported outer bounds enclose those of closed forms."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from shoal.trajectory import Status

from shoal_validation.nightly.line import Line
from shoal_validation.nightly.measure import Measured, timed

NAME, METHOD = "uncertain-bounds", "auto"
STUDIES, RUNS = 11, 2_000
"""Random studies, and random runs that try to leave the bounds of each."""
FIRST = 9_000
"""Seed of the first."""


def lines() -> Iterator[Line]:
    """The quick map of horizons, and random studies."""
    of = partial(Line, NAME, "closed forms", unit="of the width")
    limit, why = 1e-5, "no bound may be wrong in silence"
    yield of(f"{METHOD}, map", limit, why, mapped, "a vibration whose bounds are known", noise=limit)
    limit, why = 1e-9, "no run may lie beyond outer bounds and the gap told"
    yield of(
        f"{METHOD}, studies", limit, why, partial(studied, STUDIES, RUNS, FIRST), f"{RUNS} random runs", noise=limit
    )


def mapped() -> Measured:
    """Excess of true bounds over outer ones within the reported horizon, beyond the reported gap."""
    from shoal_validation.uncertain.maps import surveyed

    seconds, cells = timed(lambda: surveyed([METHOD], quick=True))
    ahead = ", ".join(f"{one.horizon:.3g}" for one in cells)
    return Measured(str(Status.OK), max(one.beyond for one in cells), seconds, f"right for {ahead} cycles")


def studied(count: int, runs: int, first: int) -> Measured:
    """The same of random studies and random runs."""
    from shoal_validation.uncertain.studies import drawn, judged

    seconds, found = timed(lambda: [judged(drawn(seed), runs) for seed in range(first, first + count)])
    known = [one for one in found if one.gap == one.gap]
    beyond = max((max(one.beyond - one.gap, one.broken, 0.0) for one in known), default=0.0)
    return Measured(str(Status.OK), beyond, seconds, f"{len(known)} of {count} tell a gap")
