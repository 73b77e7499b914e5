"""Values and Jacobian of constraint terms at time zero, at many coordinates at once, in the plane and in space.

Arrays lead with the lanes: coordinates q are (lanes, unknowns), values (lanes, terms).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from copy import copy
from itertools import pairwise

import numpy as np

from shoal.mechanics.affine import Affine
from shoal.mechanics.fitting import start_bend, start_slope, start_value
from shoal.mechanics.numerics.tile import Array, Index
from shoal.mechanics.terms import Term


class TermValues:
    """Terms as arrays. counted: whether vectors of angles have the angle itself, with all turns, as first component."""

    def __init__(self, terms: Sequence[Term], dimensions: int, counted: bool = False) -> None:
        self.count, self._counted = len(terms), counted
        products = [(row, pair) for row, one in enumerate(terms) for pair in one.pairs]
        angles = [(row, *part) for row, one in enumerate(terms) for part in one.angles]
        vectors = [*((row, u) for row, (u, _, _) in products), *((row, w) for row, (_, w, _) in products)]
        vectors += [(row, vector) for row, _, vector in angles]
        roots = [(row, *part) for row, one in enumerate(terms) for part in one.roots]
        vectors += [(row, vector) for row, _, vector, _ in roots]
        self._rooted = np.array([[row == one for one in range(len(terms))] for row, *_ in roots], dtype=float)
        self._scales = laned([np.atleast_1d(factor) for _, factor, _, _ in roots], ())
        self._offsets = laned([np.atleast_1d(c) for *_, c in roots], ())
        self._products = _index([row for row, _ in products])
        self._angled = np.array([[row == one for one in range(len(terms))] for row, *_ in angles], dtype=float)
        self._factors = laned([np.atleast_1d(factor) for _, factor, _ in angles], ())
        self._form = np.array([form for _, (*_, form) in products]).reshape(-1, dimensions, dimensions)
        self._constant = laned([vector.constant.T for _, vector in vectors], (dimensions,))
        self._drives = [one.drive for one in terms]
        drives = [0.0 if one.drive is None else start_value(one.drive) for one in terms]
        constants = [np.atleast_1d(one.constant + drive) for one, drive in zip(terms, drives, strict=True)]
        self.offset = laned(constants, ())
        """Constants of the terms with their functions at time zero, (lanes or 1, terms)."""
        self.drift = np.array([0.0 if one.drive is None else start_slope(one.drive) for one in terms])
        """Derivatives of the terms by time at coordinates that rest, (terms,)."""
        self.rows, self._numbers, self.unknowns, self._coefficients, self.groups = _links(vectors, dimensions)
        """Of every part of the Jacobian its term and unknown; groups: of parts no two of which are of the same term."""

    @property
    def bend(self) -> Array:
        """Second derivatives of the terms by time at coordinates that rest, (terms,)."""
        return np.array([0.0 if drive is None else start_bend(drive) for drive in self._drives])

    def of_lanes(self, lanes: Index) -> TermValues:
        """Return the terms of some lanes."""
        other = copy(self)
        for name in ("_constant", "offset", "_coefficients", "_factors", "_scales", "_offsets"):
            setattr(other, name, of_lanes(getattr(self, name), lanes))
        return other

    def at(self, q: Array) -> tuple[Array, Array]:
        """Return the values, and the parts of the Jacobian, (lanes, parts), which add up."""
        count = len(self._products)
        each = (q, self._constant, self.offset, self._coefficients, self._factors, self._scales, self._offsets)
        lanes = max(map(len, each))
        vectors = np.repeat(self._constant, lanes // len(self._constant), axis=0)
        steps = self._coefficients * q[:, self.unknowns, None]
        for part in self.groups:
            vectors[:, self._numbers[part]] += steps[:, part]
        turning = 2 * count + len(self._angled)
        u, w, turned = vectors[:, :count], vectors[:, count : 2 * count], vectors[:, 2 * count : turning]
        by_u, by_w = (self._form @ w[..., None])[..., 0], (self._form.swapaxes(1, 2) @ u[..., None])[..., 0]
        found = np.sum(u * by_u, axis=2)
        values = np.zeros((lanes, self.count))
        if len({*self._products.tolist()}) == len(self._products):
            values[:, self._products] = found
        else:
            np.add.at(values.T, self._products, found.T)
        by_turned = np.zeros_like(turned)
        if len(self._angled):
            x, y = turned[..., 0], turned[..., 1]
            values = values + (self._factors * (x if self._counted else np.arctan2(y, x))) @ self._angled
            slope = np.stack([np.ones_like(x), 0.0 * y]) if self._counted else np.stack([-y, x]) / (x * x + y * y)
            by_turned[..., 0], by_turned[..., 1] = self._factors * slope
        gaps = vectors[:, turning:]
        by_gap = np.zeros_like(gaps)
        if len(self._rooted):
            spans, along = _spans(gaps, self._offsets)
            values = values + (self._scales * spans) @ self._rooted
            by_gap = self._scales[..., None] * along
        by_vector = np.concatenate([by_u, by_w, by_turned, by_gap], axis=1)
        return values + self.offset, np.sum(by_vector[:, self._numbers] * self._coefficients, axis=2)

    def jacobian(self, q: Array) -> Array:
        """Return the derivatives by all unknowns, (lanes, terms, unknowns)."""
        return self.dense(self.at(q)[1], q.shape[1])

    def dense(self, slopes: Array, unknowns: int) -> Array:
        """Return the Jacobian of which these are the parts."""
        dense = np.zeros((len(slopes), self.count, unknowns))
        for part in self.groups:
            dense[:, self.rows[part], self.unknowns[part]] += slopes[:, part]
        return dense


def _spans(gaps: Array, offsets: Array) -> tuple[Array, Array]:
    """Return s + c angle(t) of spans between circles (`ropes`), and t, their gradient by the vectors between centres.

    gaps: (lanes, spans, d); offsets: c, (lanes or 1, spans). Places that coincide have the first axis as direction.
    """
    size = np.sqrt(np.sum(gaps * gaps, axis=2))
    safe = np.where(size > 0, size, 1.0)[..., None]
    along = np.where(size[..., None] > 0, gaps / safe, np.eye(gaps.shape[2])[0])
    if not np.any(offsets):
        return size, along
    straight = np.sqrt(np.maximum(size**2 - offsets**2, 0.0))
    turn = np.arctan2(offsets, straight)
    x, y = along[..., 0], along[..., 1]
    along = np.stack([x * np.cos(turn) - y * np.sin(turn), y * np.cos(turn) + x * np.sin(turn)], axis=-1)
    return straight + offsets * np.arctan2(along[..., 1], along[..., 0]), along


def _links(vectors: list[tuple[int, Affine]], dimensions: int) -> tuple[Index, Index, Index, Array, list[slice]]:
    """Rows, numbers of the vectors, unknowns and coefficients of vectors that are of a row each, and groups of them."""
    parts = [(row, number, unknown) for number, (row, vector) in enumerate(vectors) for unknown in vector.terms]
    seen = Counter[int]()
    ordinals = []
    for row, *_ in parts:
        ordinals.append(seen[row])
        seen[row] += 1
    order = np.argsort(ordinals, kind="stable")
    rows, numbers, unknowns = np.array(parts, dtype=np.int64).reshape(-1, 3)[order].T
    coefficients = [c.T for _, vector in vectors for c in vector.terms.values()]
    ends = np.searchsorted(np.sort(ordinals), np.arange(max(seen.values(), default=0) + 1)).tolist()
    each = laned([coefficients[k] for k in order], (dimensions,))
    return rows, numbers, unknowns, each, [slice(*pair) for pair in pairwise(ends)]


def _index(numbers: Sequence[int]) -> Index:
    return np.array(numbers, dtype=np.int64)


def laned(parts: Sequence[Array], shape: tuple[int, ...]) -> Array:
    """Arrays that lead with the lanes, or with 1, one after the other, (lanes or 1, parts, *shape)."""
    lanes = max((len(part) for part in parts), default=1)
    each = [part if len(part) == lanes else np.repeat(part, lanes, axis=0) for part in parts]
    return np.array(each, dtype=float).reshape(-1, lanes, *shape).swapaxes(0, 1)


def of_lanes(values: Array, lanes: Index) -> Array:
    """Return the values of some lanes, of those of all or of one for all, (1, ...)."""
    return values[lanes] if len(values) > 1 else values
