"""How probable it is that a limit has been passed, over time."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from shoal.pictures.style import BLUE, canvas, headline, log_ticks, styled
from shoal.response.limits import Judged


@styled
def probability(found: Judged) -> Figure:
    """The first passage with its interval, on a logarithmic axis if it is rare; found: of random parameters."""
    assert found.passing is not None
    estimate = found.passing.estimate
    lower, upper = estimate.interval
    figure, axes = canvas()
    seen = estimate.passed > 0
    if not seen.any():
        axes.text(0.5, 0.5, f"no run has passed it; below {upper[-1]:.1e}", ha="center", transform=axes.transAxes)
    axes.fill_between(found.times[seen], lower[seen], upper[seen], color=BLUE, alpha=0.25, label="95 % confidence")
    axes.plot(found.times[seen], estimate.passed[seen], color=BLUE, label="passed by then")
    if seen.any() and estimate.probability < 0.1:
        axes.set_yscale("log")
        axes.set_ylim(estimate.probability * 1e-4, upper[-1] * 3)
        log_ticks(axes)
    axes.set_xlim(found.times[0], max(found.times[-1], found.times[0] + 1e-9))
    axes.set_xlabel("time [s]")
    axes.set_ylabel("probability")
    if seen.any():
        axes.legend()
    headline(figure, f"{found.limit.text} happens with probability {_number(estimate.probability)}")
    return figure


def _number(chance: float) -> str:
    return "0" if not np.isfinite(chance) or chance == 0 else f"{chance:.2g}"
