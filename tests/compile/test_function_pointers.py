"""Structures lie in memory as compiled code expects them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit
from shoal.compile import structures
from shoal.compile.pointers import pointer, raw


class Inner(NamedTuple):
    """With what is shorter than eight bytes, side by side and alone."""

    yes: bool
    no: bool
    number: float
    last: bool


class Outer(NamedTuple):
    """With everything that frames have."""

    tile: tuple[int, ...]
    flag: bool
    inner: Inner
    many: tuple[Any, ...]
    nothing: tuple[()]
    array: Any
    whole: Any
    pair: tuple[bool, bool]
    end: Any


@njit
def _stored(storage, structure):
    structures.store(pointer(storage), raw(structure))


def test_python_lays_a_structure_as_the_compiler_does() -> None:
    numbers, counts = np.arange(3.0), np.arange(4)
    inner = Inner(True, False, 2.5, True)
    structure = Outer(
        (0, 0, 0), True, inner, (1, inner, (numbers,)), (), counts, np.int64(-7), (True, True), np.float64(0.1)
    )
    one, other = structures.storage(), structures.storage()
    _stored(one, structure)
    structures.write(other, structure)
    np.testing.assert_array_equal(one.view(np.uint8), other.view(np.uint8))
    assert np.any(one)
