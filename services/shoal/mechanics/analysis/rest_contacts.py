"""One-sided constraints of a machine at rest: their gaps, gradients and curvatures."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse
from numba import njit

from shoal.compile.pointers import pointer, raw
from shoal.errors import InputError
from shoal.mechanics import forces
from shoal.mechanics.forces import ANGLE, DISTANCE, LAW, NATURAL, PLACE, Forces
from shoal.mechanics.functions import Functions
from shoal.mechanics.gaps import DRY, GIVES, PAIR
from shoal.mechanics.numerics.tile import SINGLE, Array, Index, Tile
from shoal.mechanics.pairs import FLAT, HOLE, PROFILE, Pairs, pair_rows, side_rows

if TYPE_CHECKING:
    from shoal.mechanics.analysis.evaluate import Evaluator


class RestContacts:
    """The gaps g(q) >= 0 of a model, in its first lane; not for threads, as it counts turns.

    names: of every gap; numbers: among the contacts of the model. Friction is left out: that of a joint that sticks has
    no gap. Pairs of surfaces are distances, or places along a normal, like the measures of joints. Raises InputError
    for contacts that give way.
    """

    def __init__(self, evaluator: Evaluator) -> None:
        model, gaps = evaluator.model, evaluator.gaps
        if np.any(gaps.soft == GIVES):
            name = model.gap_fields[int(np.argmax(gaps.soft == GIVES))]
            raise InputError(f"{name}.law: equilibria and modes take rigid contacts; leave it out")
        outlined = np.isin(gaps.kind, PAIR) & np.isin(gaps.number, np.flatnonzero(gaps.pairs.shape == PROFILE))
        if np.any(outlined):
            name = model.gap_fields[int(np.argmax(outlined))]
            raise InputError(f"{name}.second: equilibria and modes take lines, circles and holes, no polygons and cams")
        self._evaluator, self.resolution = evaluator, gaps.resolution
        measured, of_pairs = gaps.measures, _measures(gaps.pairs)
        self._angles = measured.size
        joined = (np.concatenate(parts) for parts in zip(measured[2:], of_pairs[2:], strict=True))
        self._measures = Forces(measured.dimensions, measured.size + of_pairs.size, *joined)
        self.numbers = kept = np.flatnonzero(gaps.kind != DRY)
        self.size = len(kept)
        weight = np.append(gaps.weight, np.where(gaps.pairs.shape == HOLE, -1.0, 1.0))
        parts = [
            np.arange(number, last) if kind != PAIR else np.array([measured.size + number])
            for kind, number, last in zip(gaps.kind[kept], gaps.number[kept], gaps.last[kept], strict=True)
        ]
        where = np.repeat(np.arange(self.size), [len(part) for part in parts]), np.concatenate([*parts, kept[:0]])
        self._sums = scipy.sparse.csr_array((weight[where[1]], where), shape=(self.size, self._measures.size))
        """Weights of the measures in every gap, (gaps, measures)."""
        self.names = tuple(
            f"{field}.{'min' if weight[part[0]] > 0 else 'max'}" if field.endswith(".stops") else field
            for field, part in zip([model.gap_fields[k] for k in kept], parts, strict=True)
        )
        if self.size:
            intended = np.append(model.gap_angles[:, 0], np.zeros(of_pairs.size))
            z = evaluator.rows_at(model.q0[:, 0])
            self._memory = forces.initial_memory(SINGLE, self._measures, z, intended)

    @property
    def angles(self) -> Array:
        """The continuous angles [rad] of all angular measures, 0 of others; may be set, (measures,)."""
        return self._memory[: self._angles].copy() if self.size else self._evaluator.model.gap_angles[:, 0]

    @angles.setter
    def angles(self, angles: Array) -> None:
        if self.size:
            self._memory[: self._angles] = angles

    def remember(self, q: Array) -> None:
        """Count the turns of angular gaps after a move of less than half a turn to q."""
        if self.size:
            values, _ = self._measured(self._evaluator.rows_at(q))
            natural = self._measures.law[NATURAL::LAW]
            self._memory = np.where(self._measures.kind == ANGLE, values + natural, 0.0)

    def at(self, q: Array) -> tuple[Array, scipy.sparse.csr_array]:
        """Return the gaps [m or rad], (gaps,), and their gradients, (gaps, unknowns)."""
        z, side = self._evaluator.rows_at(q), forces.side(self._measures)
        values, gradients = self._measured(z)
        where = np.repeat(np.arange(len(values)), side), self._measures.rows
        block = scipy.sparse.csr_array((gradients.ravel(), where), shape=(len(values), len(z)))
        return self._sums @ values, scipy.sparse.csr_array(self._sums @ block @ self._evaluator.expansion)

    def curvature(self, q: Array, numbers: Index, multipliers: Array) -> scipy.sparse.csc_array:
        """Return the sum of multipliers times second derivatives of some gaps, (unknowns, unknowns)."""
        side, z = forces.side(self._measures), self._evaluator.rows_at(q)
        values, _ = self._measured(z)
        natural = self._measures.law[NATURAL::LAW] + values
        # d2U/dz2 = k g_q g_q' + k x g_qq of springs whose x is 1, and 0.
        strained, relaxed = (self._stiffness(z, natural - x) for x in (1.0, 0.0))
        blocks = (strained - relaxed).reshape(len(values), side, side)
        weight = self._sums[numbers].T @ multipliers
        rows = self._measures.rows.reshape(len(values), side)
        where = np.repeat(rows, side, axis=1).ravel(), np.tile(rows, side).ravel()
        entries = (weight[:, None, None] * blocks).ravel()
        block = scipy.sparse.csr_array((entries, where), shape=(len(z), len(z)))
        whole = self._evaluator.expansion
        return scipy.sparse.csc_array(whole.T @ block @ whole)

    def _stiffness(self, z: Array, natural: Array) -> Array:
        law, side = self._measures.law.copy(), forces.side(self._measures)
        law[forces.STIFFNESS :: LAW], law[NATURAL::LAW] = 1.0, natural
        w, block = np.zeros(2 * side + 3), np.zeros(side * side * self._measures.size)
        _stiffness(SINGLE, self._measures._replace(law=law), self._evaluator.functions, z, self._memory, w, block)
        return block

    def _measured(self, z: Array) -> tuple[Array, Array]:
        """Return all measures less their natural values, and the gradients in their own rows, (measures, 3 d)."""
        side, count = forces.side(self._measures), self._measures.size
        w = np.zeros((count, 2 * side + 3))
        for number in range(count):
            _measure(SINGLE, self._measures, number, z, self._memory, w[number])
        return w[:, 2 * side], w[:, side : 2 * side]


def _measures(pairs: Pairs) -> Forces:
    """Return pairs of surfaces as measures without a force: (b - a).n - r, or |b - a| less a sum or difference."""
    d, count = pairs.dimensions, pairs.size
    side = side_rows(d)
    rows = pairs.rows[: count * pair_rows(d)].reshape(count, pair_rows(d))
    first, second, normal = rows[:, :d], rows[:, side : side + d], rows[:, 2 * side : 2 * side + d]
    none = np.full(count, -1, dtype=np.int64)
    law = np.zeros((count, LAW))
    reach = np.where(pairs.shape == HOLE, pairs.reach - pairs.radius, pairs.reach + pairs.radius)
    law[:, NATURAL], law[:, forces.SPEED] = np.where(pairs.shape == FLAT, pairs.radius, reach), 1.0
    kind = np.where(pairs.shape == FLAT, PLACE, DISTANCE)
    return Forces(d, count, kind, np.hstack([second, first, normal]).ravel(), none, none, none, law.ravel())


@njit(cache=True, error_model="numpy")
def _measure(tile: Tile, measures: Forces, number: int, z: Array, memory: Array, w: Array) -> None:
    forces.measure(tile, raw(measures), number, pointer(z), pointer(memory), pointer(w))


@njit(cache=True, error_model="numpy")
def _stiffness(
    tile: Tile, measures: Forces, functions: Functions, z: Array, memory: Array, w: Array, block: Array
) -> None:
    forces.tangent(tile, raw(measures), raw(functions), pointer(z), pointer(memory), pointer(w), pointer(block), 0)
