"""Markers that a tracker has confused in some samples: found by the continuity of their paths."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations

import numpy as np

from shoal.identification.conventions import PRECISION
from shoal.trajectory import Array

_PENALTY = 4.0
"""What an exchange costs, over the 99th percentile of the error with which a straight line predicts a sample."""
_MOST = 0.6
"""Where more than this share of the samples contradicts the first, the first is the one that was exchanged."""
_LISTED = 3


def mend(times: Array, tracks: Mapping[str, Array]) -> tuple[dict[str, Array], list[str]]:
    """Paths (samples, 2) with exchanged samples put right, and a line for each pair that was exchanged.

    times: (samples,), increasing; nan in a path: not seen. Of each pair the sequence of assignments is sought whose
    samples lie nearest to straight lines through the two before them. Exchanged in all samples looks like none.
    """
    mended, notes = dict(tracks), list[str]()
    for one, other in combinations(mended, 2):
        wrong = _exchanged_samples(times, mended[one], mended[other])
        if np.any(wrong):
            first, second = mended[one], mended[other]
            mended[one] = np.where(wrong[:, None], second, first)
            mended[other] = np.where(wrong[:, None], first, second)
            notes.append(f"markers {one} and {other} exchanged in {_spans(wrong)}: mended")
    return mended, notes


def _exchanged_samples(times: Array, one: Array, other: Array) -> Array:
    """Mask of samples exchanged between two paths, (samples,), bool; where one is missing both neighbours decide.

    What is unknown is whether sample k is exchanged against the one before it. Distances, not their squares, are
    added: by the triangle inequality no outlier of a single marker is then explained by an exchange.
    """
    known = np.flatnonzero(np.all(np.isfinite(np.hstack([one, other])), axis=1))
    wrong = np.zeros(len(times), dtype=bool)
    if len(known) < 4:
        return wrong
    costs = _prediction_errors(times[known], one[known], other[known])
    penalty = max(_PENALTY * float(np.quantile(costs.min(axis=(0, 1)), 0.99)), PRECISION * float(np.ptp(one[known])))
    if costs[0, 0].max() <= penalty:
        return wrong
    state = np.cumsum(_cheapest(costs, penalty)) % 2 == 1
    if np.mean(state) > _MOST:
        state = ~state
    wrong[known] = state
    before = np.clip(np.searchsorted(known, np.arange(len(times)), side="right") - 1, 0, len(known) - 1)
    after = np.clip(np.searchsorted(known, np.arange(len(times))), 0, len(known) - 1)
    return np.asarray(state[before] & state[after])


def _prediction_errors(times: Array, one: Array, other: Array) -> Array:
    """Distance of samples 2, 3, ... from where the two before them lead, summed over both markers.

    (2, 2, samples - 2): without and with an exchange after the first of the three, and after the second. Divided by
    how much more uncertain the prediction is than that of the usual interval.
    """
    steps = np.diff(times)
    ratio = steps[1:] / steps[:-1]
    usual = float(np.median(steps))
    doubt = np.maximum.reduce([np.ones_like(ratio), ratio, steps[1:] * (steps[1:] + steps[:-1]) / (2 * usual**2)])
    pair = np.stack([one, other])
    costs = np.empty((2, 2, len(ratio)))
    for before in (0, 1):
        velocity = pair[:, 1:-1] - (pair[::-1] if before else pair)[:, :-2]
        predicted = pair[:, 1:-1] + ratio[:, None] * velocity
        for after in (0, 1):
            error = (pair[::-1] if after else pair)[:, 2:] - predicted
            costs[before, after] = np.linalg.norm(error, axis=2).sum(axis=0) / doubt
    return costs


def _cheapest(costs: Array, penalty: float) -> list[int]:
    """Return whether each sample is exchanged against the one before it, for the least sum of costs (Viterbi 1967)."""
    total = (0.0, penalty)
    came_from: list[tuple[int, int]] = []
    for straight, fresh, back, twice in costs.reshape(4, -1).T.tolist():
        came = (int(total[1] + back < total[0] + straight), int(total[1] + twice < total[0] + fresh))
        total = (min(total[0] + straight, total[1] + back), min(total[0] + fresh, total[1] + twice) + penalty)
        came_from.append(came)
    path = [int(total[1] < total[0])]
    for came in reversed(came_from):
        path.append(came[path[-1]])
    return [0, *reversed(path)]


def _spans(wrong: Array) -> str:
    """Description of the exchanged samples, in words."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], wrong, [False]]).astype(int)))
    spans = [f"{a}" if b - a == 1 else f"{a} to {b - 1}" for a, b in edges.reshape(-1, 2).tolist()]
    more = f" and {len(spans) - _LISTED} more places" if len(spans) > _LISTED else ""
    single = len(spans) == 1 and " " not in spans[0]
    return f"sample{'' if single else 's'} {', '.join(spans[:_LISTED])}{more}"
