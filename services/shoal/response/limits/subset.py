"""Subset simulation: a small probability as a product of larger ones.

Au and Beck, Estimation of small failure probabilities in high dimensions by subset simulation, Probabilistic
Engineering Mechanics 16, 2001; chains by adaptive conditional sampling (Papaioannou, Betz, Zwirglmaier and Straub, MCMC
algorithms for subset simulation, Probabilistic Engineering Mechanics 41, 2015).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from shoal.response.inputs import BoolArray, IntArray
from shoal.response.limits.estimate import ExceedanceEstimate, first_passages
from shoal.response.limits.importance import Sample
from shoal.response.limits.margins import Margins, least
from shoal.response.runs import TooManyRunsError
from shoal.trajectory import Array

SHARE = 0.1
"""Conditional probability of a level (Au and Beck 2001: p_0 = 0.1)."""
LEVELS = 12
"""Levels at most: the probability is below SHARE^12 = 1e-12 after them."""
BETWEEN = 1.3
"""The deviation is larger than what Au and Beck's formula gives, which leaves out that the chains of a level begin
where those before it ended: by so much at most, over the closed forms of the tests."""
SAME = 1e-8
"""Margins that differ by less than this part of the least one do not depend on what varies."""
ACCEPTED = 0.44
"""Acceptance rate that is aimed at (Papaioannou et al. 2015; Gelman, Roberts and Gilks 1996 for one dimension)."""


@dataclass(frozen=True)
class Levels:
    """Result of subset simulation.

    estimate: of the probability; places, margins: of the runs beyond the limit, (runs, parameters) and (runs,
    instants); first: places of the runs of the first level, those with the least margins first, (runs, parameters);
    sample: all runs, those of a level down to where the next one begins: a stratified sample of the distributions
    """

    estimate: ExceedanceEstimate
    places: Array
    margins: Array
    first: Array
    sample: Sample


def subset(margins: Margins, count: int, seed: int) -> Levels:
    """count: runs of each level. Raises InputError, TooManyRunsError if there are none even for the first level."""
    random = np.random.default_rng(seed)
    parameters = len(margins.inputs)
    seeds = max(int(SHARE * count), 2)
    length = max(count // seeds, 2)
    count = seeds * length
    u = random.standard_normal((count, parameters))
    rows = margins(u)
    g = least(rows)
    plain = u[np.argsort(g, kind="stable")]
    lost = float(np.mean(np.isnan(rows).any(axis=1)))
    nearest, farthest = _ends(g)
    weight, variance, spread, levels = 1.0, 0.0, 0.6, 0
    chains = np.arange(count)[:, None]
    strata = list[Sample]()
    while True:
        threshold = float(np.sort(g)[seeds - 1])
        if threshold <= 0 or levels == LEVELS or margins.left < count - seeds:
            break
        inside = g <= threshold
        variance += _variance(inside, chains)
        before, weight = weight, weight * float(np.mean(inside))
        best = np.argsort(g, kind="stable")[:seeds]
        stratum = Sample(u[~inside], rows[~inside], np.full(int(np.sum(~inside)), before / count))
        try:
            u, rows, g, spread = _chains(margins, u[best], rows[best], threshold, length, spread, random)
        except TooManyRunsError:
            break
        strata.append(stratum)
        chains = np.arange(count).reshape(length, seeds).T
        levels += 1
        nearest, farthest = min(nearest, _ends(g)[0]), max(farthest, _ends(g)[1])
    beyond = g < 0
    first = first_passages(np.nan_to_num(rows, nan=np.inf))
    instants = rows.shape[1]
    share = np.cumsum(np.bincount(first[beyond], minlength=instants)) / count
    deviation = np.full(instants, np.inf)
    for k in np.flatnonzero(share):
        deviation[k] = BETWEEN * math.sqrt(variance + _variance(first <= k, chains))
    why = f"subset simulation with {levels + 1} level{'s' if levels else ''} of {count} runs"
    if not beyond.any() and 0 <= farthest - nearest <= SAME * nearest:
        why += f"; all stay {nearest:.4g} away from the limit: nothing that varies seems to change its quantity"
    elif not beyond.any():
        below = f"{weight * SHARE:.2g}"
        why += f"; none has passed the limit, whose probability is below {below} or not reached by its chains"
    estimate = ExceedanceEstimate(weight * share, deviation, why, weight * SHARE, lost)
    strata.append(Sample(u, rows, np.full(len(u), weight / count)))
    return Levels(estimate, u[beyond], rows[beyond], plain, _together(strata))


def _together(strata: list[Sample]) -> Sample:
    """Return one weighted sample of strata whose weights are probabilities."""
    places, rows, weights = (
        np.concatenate([getattr(one, name) for one in strata]) for name in ("places", "rows", "weights")
    )
    return Sample(places, rows, weights * len(weights))


def _ends(g: Array) -> tuple[float, float]:
    """The least and the largest margin of runs that have not failed."""
    known = g[np.isfinite(g)]
    return float(known.min(initial=np.inf)), float(known.max(initial=-np.inf))


def _chains(
    margins: Margins, u: Array, rows: Array, threshold: float, length: int, spread: float, random: np.random.Generator
) -> tuple[Array, Array, Array, float]:
    """Run one chain from each place, side by side; returns all states, step by step."""
    places, kept = [u], [rows]
    for step in range(1, length):
        move = min(spread, 1.0)
        tried = math.sqrt(1 - move**2) * u + move * random.standard_normal(u.shape)
        found = margins(tried)
        accepted = least(found) <= threshold
        u, rows = np.where(accepted[:, None], tried, u), np.where(accepted[:, None], found, rows)
        spread = math.exp(math.log(spread) + (float(np.mean(accepted)) - ACCEPTED) / math.sqrt(step))
        places.append(u)
        kept.append(rows)
    whole = np.concatenate(kept)
    return np.concatenate(places), whole, least(whole), spread


def _variance(inside: BoolArray, chains: IntArray) -> float:
    """Squared coefficient of variation of a level's share, with the correlation along its chains (Au and Beck)."""
    share = float(np.mean(inside))
    if share in (0.0, 1.0):
        return 0.0
    series = inside[chains] - share
    length = series.shape[1]
    correlation = 0.0
    for k in range(1, length):
        along = float(np.mean(series[:, :-k] * series[:, k:])) / (share * (1 - share))
        correlation += 2 * (1 - k / length) * along
    return (1 - share) / (share * inside.size) * max(1 + correlation, 0.0)
