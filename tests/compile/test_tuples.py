"""Vectors and matrices as tuples, of numbers and of SIMD vectors, against numpy."""

from __future__ import annotations

import numpy as np
import pytest
from numba import njit
from shoal.compile.pointers import pointer
from shoal.compile.simd import EIGHT, loads, store
from shoal.compile.tuples import dot, facing, minus, outer, plus, plus_identity, plus_skew, times, wedge


@njit
def _of_numbers(a, b, m, k):  # type: ignore[no-untyped-def]
    vectors = times(k, a), plus(a, k, b), minus(a, b), facing(b, m), wedge(a, b)
    matrix = plus_skew(plus_identity(plus(outer(a, b), k, outer(b, a)), k), m)
    return dot(a, b), vectors, matrix


@njit
def _of_vectors(space, a, b, k, out):  # type: ignore[no-untyped-def]
    first, second = loads(space, EIGHT, pointer(a), 0, 8), loads(space, EIGHT, pointer(b), 0, 8)
    store(pointer(out), 0, dot(plus(first, k, second), minus(first, second)))


@pytest.mark.parametrize("d", [2, 3])
def test_formulas_equal_numpy(d: int) -> None:
    draw = np.random.default_rng(d)
    a, b, m, k = draw.normal(size=d), draw.normal(size=d), draw.normal(size=1 if d == 2 else 3), 0.7
    product, vectors, matrix = _of_numbers(tuple(a), tuple(b), tuple(m), k)
    skew = m[0] * np.array([[0, 1], [-1, 0]]) if d == 2 else -np.cross(np.eye(3), m)
    wedged = np.array([a[0] * b[1] - a[1] * b[0]]) if d == 2 else np.cross(a, b)
    expected = k * a, a + k * b, a - b, skew @ b, wedged
    assert product == pytest.approx(a @ b, rel=1e-14)
    for found, own in zip(vectors, expected, strict=True):
        np.testing.assert_allclose(found, own, rtol=1e-13, atol=1e-14)
    whole = np.outer(a, b) + k * np.outer(b, a) + k * np.eye(d) + skew
    np.testing.assert_allclose(matrix, whole, rtol=1e-13, atol=1e-14)


@pytest.mark.parametrize("d", [2, 3])
def test_lanes_are_numbers(d: int) -> None:
    draw = np.random.default_rng(d)
    a, b, out = draw.normal(size=(d, 8)), draw.normal(size=(d, 8)), np.zeros(8)
    _of_vectors((0,) * d, a.ravel(), b.ravel(), 0.3, out)
    np.testing.assert_allclose(out, np.sum((a + 0.3 * b) * (a - b), axis=0), rtol=1e-13, atol=1e-14)


def test_other_tuples_are_refused() -> None:
    with pytest.raises(TypeError, match="tuples of numbers or vectors"):
        _of_numbers((1, 2), (1.0, 2.0), (1.0,), 1.0)
