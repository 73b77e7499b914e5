"""Times of impacts in a motion, as a microphone hears them, by the number of the impact."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from shoal.trajectory import Array

LATER = 1.25
"""Motions are followed until this times the last impact that was heard, as impacts in the model may be later."""
TINY = 1e-3
"""And so long at least [s]."""


def impact_times(letters: Sequence[tuple[float, str]], place: str, count: int, end: float) -> Array:
    """Return the times of the first impacts at a place [s], (count,).

    letters: events of a motion, see `Trajectory.words`. Impacts after those that accumulate in a rest are at its time,
    which is their limit; others that the motion does not reach are at its `end`, later than any that was heard.
    """
    times = [time for time, one in letters if one == f"{place} impact"][:count]
    rest = next((time for time, one in reversed(letters) if one == f"{place} rests"), end)
    return np.array(times + [rest] * (count - len(times)))
