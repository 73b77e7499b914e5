"""One mass matrix for all lanes and components, by its inverse or its banded factor, against numpy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numba import njit
from shoal.compile.pointers import pointer, raw
from shoal.mechanics.numerics import alike, sparse
from shoal.mechanics.numerics.row_pairs import paired
from shoal.mechanics.numerics.tile import SINGLE, WIDE, Tile


@njit(cache=True)
def _factor(pattern, values):  # type: ignore[no-untyped-def]
    sparse.factor((0,), raw(pattern), pointer(values))


@njit(cache=True)
def _solve(tile, shared, w, x):  # type: ignore[no-untyped-def]
    alike.solve(tile, raw(shared), pointer(w), pointer(x))


@njit(cache=True)
def _multiply(tile, shared, x, y):  # type: ignore[no-untyped-def]
    alike.multiply(tile, raw(shared), pointer(x), pointer(y))


def _chain(size: int) -> Any:
    """A positive matrix with three bands below its diagonal."""
    rng = np.random.default_rng(size)
    matrix = np.diag(rng.uniform(8, 9, size))
    for k in range(1, min(4, size)):
        band = np.diag(rng.normal(size=size - k), -k)
        matrix += band + band.T
    return matrix


def _shared(matrix: Any, components: int) -> alike.Alike:
    size = len(matrix)
    pattern, slot = sparse.analyse(size, np.argwhere(matrix).tolist())
    values = np.zeros(pattern.slots)
    for (i, j), place in slot.items():
        values[place] = matrix[i, j]
    factor = values.copy()
    _factor(pattern, factor)
    inverse = alike.spread_inverse(matrix if size <= alike.FEW else np.zeros((0, 0)), components)
    return alike.Alike(components, pattern, values, paired(pattern, factor), inverse)


@pytest.mark.parametrize("tile", [SINGLE, WIDE], ids=["single", "lanes"])
@pytest.mark.parametrize("components", [1, 2, 3])
@pytest.mark.parametrize("size", [1, 2, 5, 8, 16, 17, 31, 32, 33, 70])
@pytest.mark.by_day(1)
def test_solution_and_product_equal_numpy(size: int, components: int, tile: Tile) -> None:
    matrix = _chain(size)
    shared, whole = _shared(matrix, components), np.kron(matrix, np.eye(components))
    right = np.random.default_rng(1).normal(size=(len(whole), len(tile)))
    x, room, product = right.flatten(), np.full(4 * alike.FEW + 1, np.pi), np.empty(right.size)
    _solve(tile, shared, room, x)
    np.testing.assert_allclose(x.reshape(right.shape), np.linalg.solve(whole, right), rtol=1e-12, atol=1e-14)
    assert room[-1] == np.pi
    _multiply(tile, shared, right.flatten(), product)
    np.testing.assert_allclose(product.reshape(right.shape), whole @ right, rtol=1e-12, atol=1e-13)


def _entries(matrix: Any) -> dict[tuple[int, int], Any]:
    return {(int(i), int(j)): matrix[i, j] for i, j in np.argwhere(matrix) if i >= j}


def test_what_all_components_share_is_found_and_nothing_else() -> None:
    matrix = _chain(6)
    assert alike.analyse(12, 2, _entries(np.kron(matrix, np.eye(2)))) == (2, _entries(matrix))
    assert alike.analyse(18, 3, _entries(np.kron(matrix, np.eye(3)))) == (3, _entries(matrix))
    for spoiled in ((4, 3), (4, 4), (5, 1)):
        whole = np.kron(matrix, np.eye(2))
        whole[spoiled] += 0.1
        assert alike.analyse(12, 2, _entries(whole)) == (1, _entries(whole))
    odd = _chain(7)
    assert alike.analyse(7, 2, _entries(odd)) == (1, _entries(odd))
    missing = _entries(np.kron(matrix, np.eye(2)))
    del missing[3, 1]
    assert alike.analyse(12, 2, missing) == (1, missing)
