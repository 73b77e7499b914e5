"""Constraints that are at most quadratic in the coordinates: C = q'Aq + b'q + c, one kernel for all.

C_q = 2Aq + b and the bias C_qq v v = 2 v'Av follow from the same lists (mechanics of every planar joint).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.mechanics.affine import Affine, Number
from shoal.mechanics.tile import Array, Index, Tile
from shoal.mechanics.vector import pointer


class Constraints(NamedTuple):
    """Term t of constraint k in start[k]:start[k+1] is value[t] * q[first[t]] * q[second[t]].

    second = -1 marks a linear term, first = -1 a constant.
    """

    size: int
    start: Index
    first: Index
    second: Index
    value: Array


class Terms:
    """Collects the terms of constraints, per lane, before they are packed into tiles."""

    def __init__(self) -> None:
        self.names: list[str] = []
        self.start = [0]
        self.first: list[int] = []
        self.second: list[int] = []
        self.values: list[Number] = []

    def _add(self, first: int, second: int, value: Number) -> None:
        if np.any(value):
            self.first.append(first)
            self.second.append(second)
            self.values.append(value)

    def _close(self, name: str) -> None:
        self.names.append(name)
        self.start.append(len(self.first))

    def unit_length(self, name: str, vector: Affine) -> None:
        """|vector|^2 - 1 = 0."""
        items = list(vector.terms.items())
        for index, (k, b) in enumerate(items):
            square = np.real(np.conj(b) * b)
            self._add(2 * k, 2 * k, square)
            self._add(2 * k + 1, 2 * k + 1, square)
            for m, c in items[index + 1 :]:
                h = 2 * np.conj(b) * c
                self._add(2 * k, 2 * m, np.real(h))
                self._add(2 * k + 1, 2 * m + 1, np.real(h))
                self._add(2 * k, 2 * m + 1, -np.imag(h))
                self._add(2 * k + 1, 2 * m, np.imag(h))
            linear = 2 * np.conj(vector.constant) * b
            self._add(2 * k, -1, np.real(linear))
            self._add(2 * k + 1, -1, -np.imag(linear))
        self._add(-1, -1, np.abs(vector.constant) ** 2 - 1.0)
        self._close(name)

    def vanish(self, name: str, vector: Affine) -> None:
        """vector = 0, two linear constraints [m]."""
        for part in range(2):
            for k, b in vector.terms.items():
                x, y = (np.real(b), -np.imag(b)) if part == 0 else (np.imag(b), np.real(b))
                self._add(2 * k, -1, x)
                self._add(2 * k + 1, -1, y)
            self._add(-1, -1, np.real(vector.constant) if part == 0 else np.imag(vector.constant))
            self._close(name)


@njit(cache=True, error_model="numpy")
def raw(constraints: Constraints) -> Constraints:
    """The same constraints with pointers in place of arrays."""
    c = constraints
    return Constraints(c.size, pointer(c.start), pointer(c.first), pointer(c.second), pointer(c.value))


@njit(cache=True, error_model="numpy")
def residual(tile: Tile, constraints: Constraints, q: Array, value: Array) -> None:
    """C(q); value: (constraints, lanes)."""
    width = len(tile)
    for k in range(constraints.size):
        for lane in range(width):
            value[k * width + lane] = 0.0
        for t in range(constraints.start[k], constraints.start[k + 1]):
            i, j = constraints.first[t], constraints.second[t]
            for lane in range(width):
                term = constraints.value[t * width + lane]
                if i >= 0:
                    term *= q[i * width + lane]
                if j >= 0:
                    term *= q[j * width + lane]
                value[k * width + lane] += term


@njit(cache=True, error_model="numpy")
def jacobian(tile: Tile, constraints: Constraints, unknowns: int, q: Array, out: Array) -> None:
    """C_q(q); out: (constraints * unknowns, lanes)."""
    width = len(tile)
    for i in range(constraints.size * unknowns * width):
        out[i] = 0.0
    for k in range(constraints.size):
        for t in range(constraints.start[k], constraints.start[k + 1]):
            i, j = constraints.first[t], constraints.second[t]
            if i < 0:
                continue
            row = (k * unknowns + i) * width
            for lane in range(width):
                other = q[j * width + lane] if j >= 0 else 1.0
                out[row + lane] += constraints.value[t * width + lane] * other
            if j >= 0:
                row = (k * unknowns + j) * width
                for lane in range(width):
                    out[row + lane] += constraints.value[t * width + lane] * q[i * width + lane]


@njit(cache=True, error_model="numpy")
def bias(tile: Tile, constraints: Constraints, v: Array, out: Array) -> None:
    """eta = C_qq v v, so that C_q a = -eta; out: (constraints, lanes)."""
    width = len(tile)
    for k in range(constraints.size):
        for lane in range(width):
            out[k * width + lane] = 0.0
        for t in range(constraints.start[k], constraints.start[k + 1]):
            i, j = constraints.first[t], constraints.second[t]
            if i >= 0 and j >= 0:
                for lane in range(width):
                    out[k * width + lane] += (
                        2.0 * constraints.value[t * width + lane] * v[i * width + lane] * v[j * width + lane]
                    )


@njit(cache=True, error_model="numpy")
def drift(tile: Tile, constraints: Constraints, q: Array, gap: Array, worst: Array) -> None:
    """Raise worst (lanes,) to the largest |C(q)|; gap is work space, (constraints, lanes)."""
    width = len(tile)
    residual(tile, constraints, q, gap)
    for k in range(constraints.size * width):
        worst[k % width] = max(worst[k % width], abs(gap[k]))
