"""Sparse LDL' against numpy on random patterns."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from shoal.mechanics.numerics import sparse
from shoal.mechanics.numerics.tile import SINGLE, WIDE


@st.composite
def systems(draw: st.DrawFn) -> tuple[int, list[tuple[int, int]], int]:
    """Size, entries below the diagonal, seed of the numbers."""
    size = draw(st.integers(1, 12))
    pairs = [(i, j) for i in range(size) for j in range(i)]
    chosen = draw(st.lists(st.sampled_from(pairs), unique=True)) if pairs else []
    return size, chosen, draw(st.integers(0, 2**32 - 1))


def _matrices(size: int, pairs: list[tuple[int, int]], seed: int, count: int) -> Any:
    """Random symmetric matrices of one pattern, made positive definite by their diagonal, (count, size, size)."""
    rng = np.random.default_rng(seed)
    matrices = np.zeros((count, size, size))
    for i, j in pairs:
        matrices[:, i, j] = matrices[:, j, i] = rng.normal(size=count)
    for k in range(size):
        matrices[:, k, k] = np.abs(matrices[:, k]).sum(axis=-1) + rng.uniform(0.1, 2.0, count)
    return matrices


def _pack(matrices: Any, slot: dict[tuple[int, int], int], slots: int) -> Any:
    values = np.zeros((slots, len(matrices)))
    for (i, j), place in slot.items():
        values[place] = matrices[:, i, j]
    return values


@given(systems())
def test_solution_and_product_equal_numpy(kernels: Any, system: Any) -> None:
    size, pairs, seed = system
    pattern, slot = sparse.analyse(size, pairs)
    matrix = _matrices(size, pairs, seed, 1)
    right = np.random.default_rng(seed).normal(size=size)
    values = _pack(matrix, slot, pattern.slots).ravel()
    product = np.empty(size)
    kernels.multiply(SINGLE, pattern, values, right, product)
    np.testing.assert_allclose(product, matrix[0] @ right, rtol=1e-12, atol=1e-12)
    x = right.copy()
    kernels.solve(SINGLE, pattern, values, x)
    np.testing.assert_allclose(x, np.linalg.solve(matrix[0], right), rtol=1e-9, atol=1e-12)
    # What was factored is L below the diagonal and 1/D on it.
    lower = np.eye(size)
    for (i, j), place in slot.items():
        if i > j:
            lower[i, j] = values[place]
    np.testing.assert_allclose(lower @ np.diag(1 / values[:size]) @ lower.T, matrix[0], rtol=1e-9, atol=1e-12)


@given(systems())
def test_lanes_equal_singles(kernels: Any, system: Any) -> None:
    size, pairs, seed = system
    width = len(WIDE)
    pattern, slot = sparse.analyse(size, pairs)
    values = _pack(_matrices(size, pairs, seed, width), slot, pattern.slots)
    right = np.random.default_rng(seed).normal(size=(size, width))
    together = right.copy()
    kernels.solve(WIDE, pattern, values.flatten(), together.reshape(-1))
    for lane in range(width):
        alone = right[:, lane].copy()
        kernels.solve(SINGLE, pattern, values[:, lane].copy(), alone)
        np.testing.assert_allclose(together[:, lane], alone, rtol=1e-12, atol=1e-14)


def test_a_chain_fills_nothing() -> None:
    pattern, _ = sparse.analyse(50, [(k + 1, k) for k in range(49)])
    assert len(pattern.row) == 49
    assert len(pattern.left) == 0


def test_both_orders_of_an_entry_name_the_same_slot() -> None:
    _, slot = sparse.analyse(3, [(0, 2), (2, 0), (1, 1)])
    assert slot == {(0, 0): 0, (1, 1): 1, (2, 2): 2, (2, 0): 3}
