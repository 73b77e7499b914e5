"""Structures lie in memory as compiled code expects them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit, typeof
from shoal.compile import function_pointers, structures
from shoal.compile.pointers import pointer, raw_type


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
def _read(structure, numbers, counts):
    inner, repeated = structure.inner, structure.many[1]
    numbers[0], numbers[1], numbers[2] = inner.number, repeated.number, structure.end
    numbers[3], numbers[4] = structure.many[2][0][2], structure.array[2]
    flags = structure.flag, inner.yes, inner.no, inner.last, *structure.pair, repeated.yes, repeated.no
    for k in range(len(flags)):
        counts[k] = flags[k]
    counts[len(flags)], counts[len(flags) + 1] = structure.whole, structure.many[0]
    counts[len(flags) + 2] = len(structure.tile)


@njit
def _call(address, place, numbers, counts):
    function_pointers.call(address, (pointer(place), pointer(numbers), pointer(counts)))


def test_compiled_code_finds_the_members_where_python_puts_them() -> None:
    inner = Inner(True, False, 2.5, True)
    structure = Outer(
        (0, 0, 0), True, inner, (1, inner, (np.arange(3.0),)), (), np.arange(4), np.int64(-7), (False, True), 0.1
    )
    place, numbers, counts = structures.storage(), np.zeros(5), np.zeros(11, dtype=np.int64)
    structures.write(place, structure)
    kinds = structures.Reference(raw_type(typeof(structure))), raw_type(typeof(numbers)), raw_type(typeof(counts))
    _call(function_pointers.address(_read, kinds), place, numbers, counts)
    assert numbers.tolist() == [2.5, 2.5, 0.1, 2.0, 2.0]
    assert counts.tolist() == [1, 1, 0, 1, 0, 1, 1, 0, -7, 1, 3]


def test_a_structure_whose_members_changed_places_is_another_type() -> None:
    one, other = (NamedTuple("Pair", [(name, int) for name in names]) for names in ("ab", "ba"))
    assert structures.Reference(typeof(one(1, 2))).name != structures.Reference(typeof(other(1, 2))).name
