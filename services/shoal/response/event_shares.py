"""Words of events of the runs of a study, and their shares: of the probability, or of the box of intervals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from shoal.json_values import plain
from shoal.response.enclosure import unseen
from shoal.response.machine import ResponseModel
from shoal.response.methods.by_word import FIRST
from shoal.response.respond import ModelResponse

PLACES = 4096
"""Places all over the box whose nearest run tells their word."""
LISTED = 4
"""Words that are named in a message."""


@dataclass(frozen=True)
class EventShare:
    """events: of contacts until the last instant, in order; share: of the probability or the box; runs: that had it."""

    events: str
    share: float
    runs: int

    def to_json(self) -> dict[str, Any]:
        """Return plain data."""
        return {"events": self.events, "share": plain(self.share), "runs": self.runs}


@dataclass(frozen=True)
class EventShares:
    """Words of events of all runs, the most frequent first; rare: share that a word may have which no run met."""

    words: tuple[EventShare, ...]
    rare: float

    @property
    def text(self) -> str:
        """Return the most frequent words with their shares."""
        named = [f"{one.events or 'none'} ({100 * one.share:.3g} %)" for one in self.words[:LISTED]]
        more = [f"and {len(self.words) - LISTED} more"] if len(self.words) > LISTED else []
        return "; ".join([*named, *more])


def event_shares(model: ResponseModel, found: ModelResponse) -> EventShares | None:
    """Return the words of the runs of a study; None where all have the same, or no contacts."""
    runs = found.runs
    if runs.words is None or len(runs.words) != len(runs.xi):
        return None
    last, xi = runs.words[:, -1], runs.xi
    names, counts = np.unique(last, return_counts=True)
    if len(names) == 1:
        return None
    if runs.inputs.random.any():
        drawn = last if found.found.drawn is None else last[len(last) - found.found.drawn :]
        shares, tested = np.array([np.mean(drawn == name) for name in names]), len(drawn)
    else:
        _, nearest = cKDTree(xi).query(runs.inputs.sobol(PLACES, 1))
        shares, tested = np.array([np.mean(last[nearest] == name) for name in names]), FIRST * (1 + len(runs.inputs))
    order = np.argsort(-shares, kind="stable")
    texts = [model.texts.get(name, "?") if name else "" for name in names.tolist()]
    words = (EventShare(texts[k], float(shares[k]), int(counts[k])) for k in order)
    return EventShares(tuple(words), unseen(tested))
