"""Bounds by optimisation: every instant and side has searches of its own, and every run counts for all of them.

A search polls a star around its best place and follows the parabolas along the axes (pattern search with a local model:
Torczon, On the convergence of pattern search algorithms, SIAM Journal on Optimization 7, 1997). Searches at one place
share one star, so that the place of an extremum at one instant is where the search at the next one begins. What no
search found, none can tell of: there is no gap.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from shoal.response.study import Found, Study
from shoal.trajectory import Array

STARTS = 3
"""Searches for every bound: one that learns from all runs, and two from different halves of the first ones."""
SPREAD = 12
"""Quasi-random runs for every parameter, of which searches take their starts."""
COUNT = 400
"""Runs for every parameter, unless asked for otherwise."""
WIDEST, FINEST = 0.25, 1e-3
"""Arms of the first star and of the last, in half intervals."""
CENTRES = 24
"""Stars of one round."""


@dataclass
class Searches:
    """Searches of every goal (lower bounds of all columns, then upper ones, all to be maximised) and start.

    places: (starts, goals, parameters); best: what is reached there; arms: of the next star; both (starts, goals)
    """

    places: Array
    best: Array
    arms: Array


def optimise(study: Study) -> Found:
    """`count` runs at most. Raises InputError."""
    study.intervals_only("optimise")
    runs, parameters = study.runs, len(study.inputs)
    unit = np.eye(parameters)
    most = min(study.count or COUNT * parameters, runs.left)
    first = np.vstack([np.zeros((1, parameters)), unit, -unit, study.inputs.sobol(SPREAD * parameters, study.seed)])
    runs(first[:most])
    searches = _begun(runs.xi, _goals(runs.values))
    while runs.evaluations < most and np.any(searches.arms > FINEST):
        _poll(study, searches, most)
    ended = float(np.mean(searches.arms <= FINEST))
    return Found(f"{STARTS} searches for every bound, {ended:.0%} of which came to their end")


def _goals(values: Array) -> Array:
    """Return the goals to be maximised, (runs, goals)."""
    return np.concatenate([-values, values], axis=1)


def _begun(xi: Array, goals: Array) -> Searches:
    """The first search of a goal begins at its best run, the others at the best of every second run."""
    every = np.arange(goals.shape[1])
    places = np.empty((STARTS, goals.shape[1], xi.shape[1]))
    best = np.empty((STARTS, goals.shape[1]))
    for start in range(STARTS):
        among = np.arange(len(xi)) if start == 0 else np.arange(start - 1, len(xi), STARTS - 1)
        at = among[goals[among].argmax(axis=0)]
        places[start], best[start] = xi[at], goals[at, every]
    return Searches(places, best, np.full(best.shape, WIDEST))


def _poll(study: Study, searches: Searches, most: int) -> None:
    """Run one round: stars around the places with the longest arms, then the tops of the parabolas through them."""
    runs, parameters = study.runs, len(study.inputs)
    stars = _stars(searches)
    made = len(runs.xi)
    star = np.vstack([-np.eye(parameters), np.eye(parameters)])
    wanted = np.vstack([np.clip(centre + arm * star, -1, 1) for centre, arm, _ in stars])
    runs(wanted[: most - runs.evaluations])
    tops = np.vstack([_tops(study, *one) for one in stars])
    runs(tops[: max(0, most - runs.evaluations)])
    xi, goals = runs.xi, _goals(runs.values)
    size = np.tile(study.widths(runs.values), 2)
    for centre, arm, served in stars:
        # Places of other stars count as well, the first search of a goal takes the best run of all.
        near = np.flatnonzero(np.abs(xi - centre).max(axis=1) <= 2 * arm)
        for start in range(STARTS):
            these = np.flatnonzero(served[start])
            if not len(these) or not len(near):
                continue
            among = np.arange(len(xi)) if start == 0 else near
            at = among[goals[np.ix_(among, these)].argmax(axis=0)]
            reached = goals[at, these]
            gain = np.maximum(reached - searches.best[start, these], 0.0)
            searches.places[start, these], searches.best[start, these] = xi[at], reached
            slow = gain <= 1e-3 * arm * size[these]
            searches.arms[start, these[slow]] /= 4
    if len(runs.xi) == made:
        # All of it was known: finer stars tell more.
        for _, _, served in stars:
            searches.arms[served] /= 4


def _stars(searches: Searches) -> list[tuple[Array, float, Array]]:
    """Centre, arm and the searches that are served, (starts, goals)."""
    left = searches.arms > FINEST
    found: list[tuple[Array, float, Array]] = []
    while left.any() and len(found) < CENTRES:
        arm = float(searches.arms[left].max())
        same = left & (searches.arms == arm)
        # Searches that lost least of what they could reach come first: they decide the bounds.
        short = np.where(same, searches.best.max(axis=0) - searches.best, np.inf)
        start, goal = np.unravel_index(int(short.argmin()), short.shape)
        centre = searches.places[start, goal].copy()
        served = same & (np.abs(searches.places - centre).max(axis=2) <= 0.25 * arm)
        found.append((centre, arm, served))
        left &= ~served
    return found


def _tops(study: Study, centre: Array, arm: float, served: Array) -> Array:
    """Return the tops of the parabolas along the axes, for the goals that are served: at most a few places."""
    xi, parameters = study.runs.xi, len(study.inputs)
    near = np.abs(xi - centre).max(axis=1) <= 2 * arm
    away = (xi[near] - centre) / arm
    terms = np.hstack([np.ones((len(away), 1)), away, away**2])
    which = np.flatnonzero(served.any(axis=0))
    fitted = np.linalg.lstsq(terms, _goals(study.runs.values)[near][:, which], rcond=None)[0]
    slope, bend = fitted[1 : parameters + 1].T, 2 * fitted[parameters + 1 :].T
    steps = np.where(bend < 0, -slope / np.minimum(bend, -1e-300), 2 * np.sign(slope))
    wanted = np.clip(centre + arm * np.clip(np.nan_to_num(steps), -2, 2), -1, 1)
    cells = np.round(wanted / (0.1 * arm)).astype(np.int64)
    _, first, count = np.unique(cells, axis=0, return_index=True, return_counts=True)
    return np.asarray(wanted[first[np.argsort(-count, kind="stable")[: 2 * parameters + 2]]])
