"""Bounds of machines whose runs differ by their events: a polynomial for each word of events, on the runs that have it.

A contact that is met in some runs and missed in others makes kinks or jumps, which no polynomial over the whole box
follows. Runs halve the way between neighbours of different words, so that the words' parts of the box are known up to
a narrow band, in which all words of the nearest runs count. In each part the answers are smooth, but for the root
with which a light touch begins.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from shoal.response.expansion import WORSE, Expansion, fit
from shoal.response.extremes import MOST_CORNERS, corners
from shoal.response.inputs import BoolArray, Inputs, IntArray
from shoal.response.polynomials import size, total_degree
from shoal.response.study import FINE_GAP, PER_TERM, SAFETY, DatedEnclosure, Enclosure, Found, Study, share_of
from shoal.trajectory import Array

FIRST = 16
"""Quasi-random runs that look for words, and as many times the number of parameters again."""
MANY = 12
"""Words at one instant beyond which they are too many to be followed."""
PLACES = 4096
"""Places all over the box at which polynomials are evaluated."""
AROUND, CLOSER = 64, 3
"""Further places around each extreme of a polynomial, and how often, nearer each time."""
NEAR = 2.0
"""A word counts at a place where a run of it is nearer than the nearest of all, times this."""
TOGETHER = 1e-6
"""Distance of runs of different words (the box is 2 wide) below which they are not halved further."""
ROUNDS = 12
MORE = 16
"""Times the fair number of runs that are made at most."""
HIGHEST = 20
"""Degree of a polynomial, at most."""
APART, SPARSE = 0.02, 64
"""Places where runs are sparse are so far apart at least, and so many at most."""


def differ(study: Study) -> bool:
    """Return whether runs all over the box have different words of events; they are made, and set aside if not."""
    count = FIRST * (1 + len(study.inputs))
    ends = corners(len(study.inputs)) if len(study.inputs) <= MOST_CORNERS else np.zeros((1, len(study.inputs)))
    unit = np.eye(len(study.inputs))
    study.runs(np.vstack([0.0 * unit[:1], unit, -unit, ends, study.inputs.sobol(count, study.seed)]))
    words = study.runs.words
    if words is not None and np.any(words != words[:1]):
        return True
    study.runs.set_aside()
    study.runs.looked = study.runs.aside
    return False


def by_word(study: Study) -> Found:
    """Bound the answers. Runs of different words there are already, see `differ`."""
    most = min(study.runs.left, MORE * study.fair)
    wanted = FINE_GAP if study.gap is None else study.gap
    each = max(2 * len(study.inputs), study.fair // 2)
    made, unseen = study.runs.evaluations, np.zeros(study.runs.values.shape[1])
    looked = _look(study, unseen)
    for _ in range(ROUNDS):
        before = len(study.runs.xi)
        if looked.enclosure.gap.max() <= wanted or study.runs.evaluations - made + 3 * each > most:
            break
        study.runs(np.vstack([_between(study, each), looked.places[:each], looked.sparse[:each]]))
        # What the polynomials missed of runs that they had not seen, where their words are as predicted.
        unseen = looked.missed(study, before)
        looked = _look(study, unseen)
    words = study.runs.words
    assert words is not None
    count = len(np.unique(words[:, -1]))
    why = f"runs have {count} words of events until the last instant, each with polynomials of its own"
    return Found(why, error=looked.error, enclosed=DatedEnclosure(study.runs.evaluations, looked.enclosure))


@dataclass(frozen=True)
class _Piece:
    """Polynomials of some columns in the part of the box that has a word, on the box around its runs."""

    middle: Array
    half: Array
    expansion: Expansion

    def local(self, xi: Array) -> Array:
        """Return places by the coordinates of that box, (places, parameters)."""
        return np.asarray(np.clip((xi - self.middle) / self.half, -1.0, 1.0))

    def __call__(self, xi: Array) -> Array:
        """Return the answers at these places."""
        return self.expansion(self.local(xi))


@dataclass(frozen=True)
class _Looked:
    """Polynomials of all parts, and the bounds that follow.

    error: of the polynomials, (columns,); places: where runs promise to widen the bounds, the best first; sparse: that
    are farthest from the runs of their word, denser towards the ends of its part as polynomials need it; pieces:
    instants, their words, columns and polynomials of each part
    """

    enclosure: Enclosure
    error: Array
    places: Array
    sparse: Array
    pieces: list[tuple[IntArray, Array, IntArray, _Piece]]

    def missed(self, study: Study, first: int) -> Array:
        """Return the largest error at the runs from number `first` on, (columns,)."""
        words, xi, values = study.runs.words, study.runs.xi[first:], study.runs.values[first:]
        assert words is not None
        found = np.zeros(values.shape[1])
        for instants, word, columns, piece in self.pieces:
            mine = np.all(words[first:, instants] == word, axis=1)
            if mine.any():
                off = np.abs(piece(xi[mine]) - values[mine][:, columns])
                found[columns] = np.maximum(found[columns], off.max(axis=0))
        return found


def _look(study: Study, unseen: Array) -> _Looked:
    """Fit polynomials to all runs there are, and look for their extremes. unseen: an error of earlier ones."""
    runs, inputs = study.runs, study.inputs
    xi, values, words = runs.xi, runs.values, runs.words
    assert words is not None
    lower, upper = values.min(axis=0), values.max(axis=0)
    low, high, error = lower.copy(), upper.copy(), unseen.copy()
    width = study.widths(values)
    scanned = inputs.sobol(PLACES, study.seed + 1)
    promise, away, pieces = np.zeros(PLACES), np.zeros(PLACES), list[tuple[IntArray, Array, IntArray, _Piece]]()
    for instants in _alike(words):
        columns = np.flatnonzero(np.isin(study.instants, study.when[instants]))
        here = words[:, instants[0]]
        if len(np.unique(here)) > MANY:
            low[columns], high[columns] = -np.inf, np.inf
            continue
        for word, possible in _parts(xi, here, scanned).items():
            mine = here == word
            piece = _fitted(inputs, xi[mine], values[mine][:, columns])
            if piece is None:
                # Too few runs to say anything but what they are.
                spread = np.maximum(width[columns], 1e-300)
                low[columns], high[columns] = low[columns] - spread, high[columns] + spread
                continue
            pieces.append((instants, words[mine][0, instants], columns, piece))
            off = np.maximum(piece.expansion.left_out, unseen[columns])
            error[columns] = np.maximum(error[columns], off)
            predicted = piece(scanned[possible])
            finer = _around(piece, scanned[possible], predicted, inputs, study.seed)
            turned = cKDTree(np.arccos(piece.local(xi[mine])))
            away[possible] = np.maximum(away[possible], turned.query(np.arccos(piece.local(scanned[possible])))[0])
            low[columns] = np.minimum(low[columns], finer.min(axis=0, initial=np.inf) - SAFETY * off)
            high[columns] = np.maximum(high[columns], finer.max(axis=0, initial=-np.inf) + SAFETY * off)
            beyond = np.maximum(lower[columns] - predicted, predicted - upper[columns])
            share = share_of(beyond, width[columns])
            promise[possible] = np.maximum(promise[possible], share.max(axis=1, initial=0.0))
    order = np.argsort(-promise, kind="stable")
    sparse = scanned[np.argsort(-away, kind="stable")]
    promising, enclosure = scanned[order[promise[order] > 0.0]], Enclosure.of(study, low, high)
    return _Looked(enclosure, error, promising, _apart(sparse), pieces)


def _alike(words: Array) -> list[IntArray]:
    """Return the instants at which words divide the runs alike, as between two events, together."""
    parts: dict[bytes, list[int]] = {}
    for instant, column in enumerate(words.T):
        parts.setdefault(np.unique(column, return_inverse=True)[1].tobytes(), []).append(instant)
    return [np.array(instants) for instants in parts.values()]


def _apart(places: Array) -> Array:
    """Return the first of some places that are not near to each other."""
    chosen: list[Array] = []
    for place in places[: 4 * SPARSE]:
        if all(np.max(np.abs(place - one)) > APART for one in chosen):
            chosen.append(place)
        if len(chosen) == SPARSE:
            break
    return np.array(chosen)


def _around(piece: _Piece, places: Array, predicted: Array, inputs: Inputs, seed: int) -> Array:
    """Return the answers at some places, and at more and more of them around their extremes."""
    around, spread = inputs.sobol(AROUND, seed), 2.0 * PLACES ** (-1.0 / len(inputs))
    for _ in range(CLOSER if len(places) else 0):
        best = places[np.unique([predicted.argmin(axis=0), predicted.argmax(axis=0)])]
        more = np.clip(best[:, None] + spread * around, -1.0, 1.0).reshape(-1, len(inputs))
        places, predicted = np.vstack([places, more]), np.vstack([predicted, piece(more)])
        spread /= 0.25 * AROUND ** (1.0 / len(inputs))
    return predicted


def _parts(xi: Array, words: Array, places: Array) -> dict[float, BoolArray]:
    """Return at which places each word may be, by the distances to the nearest runs."""
    names = np.unique(words)
    distance = np.stack([np.asarray(cKDTree(xi[words == name]).query(places)[0]) for name in names])
    near = distance <= NEAR * distance.min(axis=0)
    return dict(zip(names.tolist(), near, strict=True))


def _fitted(inputs: Inputs, xi: Array, values: Array) -> _Piece | None:
    """Return polynomials of each column's best degree on the box around some runs; None for too few runs."""
    low, high = xi.min(axis=0), xi.max(axis=0)
    half = np.maximum(0.5 * (high - low), TOGETHER)
    middle, best, worse = 0.5 * (low + high), None, 0
    for degree in range(1, HIGHEST + 1):
        if PER_TERM * size(len(inputs), degree) > len(xi):
            break
        found = fit(inputs, (xi - middle) / half, values, total_degree(len(inputs), degree))
        if best is None:
            best = found
        elif found.whole:
            better = found.left_out < best.left_out
            best, worse = found.where(better, best), 0 if better.any() else worse + 1
        if worse == WORSE:
            break
    return None if best is None or not best.whole else _Piece(middle, half, best)


def _between(study: Study, most: int) -> Array:
    """Return the middles between neighbouring runs of different words, those farthest apart first."""
    xi, words = study.runs.xi, study.runs.words
    assert words is not None
    found: list[tuple[float, Array]] = []
    for instant in range(words.shape[1]):
        here = words[:, instant]
        names = np.unique(here)
        for k, name in enumerate(names if len(names) <= MANY else ()):
            one, other = xi[here == name], xi[np.isin(here, names[k + 1 :])]
            if not len(other):
                continue
            distance, nearest = (np.asarray(part) for part in cKDTree(other).query(one))
            # Of a run that many are near to, the nearest alone.
            for which in np.unique(nearest):
                mine = np.flatnonzero(nearest == which)
                best = mine[np.argmin(distance[mine])]
                if distance[best] > TOGETHER:
                    found.append((float(distance[best]), 0.5 * (one[best] + other[which])))
    found.sort(key=lambda one: -one[0])
    return np.array([place for _, place in found[:most]]).reshape(-1, len(study.inputs))
