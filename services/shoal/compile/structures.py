"""Structures of kernels in memory, behind a typed pointer.

A kernel that is handed a structure by value copies it, member by member. Here a structure is written once into storage
of its own, and its address is passed on; `load` reads the members that are used.
"""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import types
from numba.extending import intrinsic

BYTES = 8192
"""Room for the largest structure, which is checked where one is written."""


def storage() -> npt.NDArray[np.float64]:
    """Return memory for one structure."""
    return np.zeros(BYTES // 8)


def write(place: npt.NDArray[np.float64], structure: tuple[Any, ...]) -> None:
    """Write a structure into its storage, with pointers in place of its arrays, which must outlive its use.

    It is what `store` writes of `pointers.raw`, without a kernel of its own for every type of structure: members in
    order, each at a multiple of its alignment, 8 bytes but for yes or no.
    """
    memory = place.view(np.uint8).data
    end, _ = _laid(structure, 0, memory)
    assert end <= BYTES


def _laid(value: Any, at: int, memory: memoryview) -> tuple[int, int]:
    """Lay a member of a structure at the next place that is aligned for it; returns where it ends, its alignment."""
    if isinstance(value, tuple):
        align = _alignment(value)
        at += -at % align
        for part in value:
            at, _ = _laid(part, at, memory)
        return at + -at % align, align
    if isinstance(value, bool | np.bool_):
        memory[at] = bool(value)
        return at + 1, 1
    at += -at % 8
    if isinstance(value, np.ndarray):
        struct.pack_into("=Q", memory, at, value.__array_interface__["data"][0])
    elif isinstance(value, int | np.integer):
        struct.pack_into("=q", memory, at, int(value))
    else:
        struct.pack_into("=d", memory, at, value)
    return at + 8, 8


def _alignment(value: Any) -> int:
    """In bytes."""
    if isinstance(value, tuple):
        return 8 if any(_alignment(part) == 8 for part in value) else 1
    return 1 if isinstance(value, bool | np.bool_) else 8


@intrinsic
def store(typing_context, place, structure):  # type: ignore[no-untyped-def]
    """Write a structure of numbers and pointers into its storage (a pointer to float64)."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        where, value = arguments
        if context.get_abi_sizeof(value.type) > BYTES:
            raise NotImplementedError("the structure is larger than its storage")
        builder.store(value, builder.bitcast(where, value.type.as_pointer()), align=8)
        return context.get_dummy_value()

    return types.void(place, structure), generate


@intrinsic
def pointer_to(typing_context, place, structure):  # type: ignore[no-untyped-def]
    """Return the storage of a structure as a pointer of its type; the structure itself is not read."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        return builder.bitcast(arguments[0], context.get_value_type(signature.return_type))

    return types.CPointer(structure)(place, structure), generate


@intrinsic
def load(typing_context, pointer):  # type: ignore[no-untyped-def]
    """Return the structure at a pointer made by `pointer_to`."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        kind = context.get_value_type(pointer.dtype)
        return builder.load(builder.bitcast(arguments[0], kind.as_pointer()), align=8)

    return pointer.dtype(pointer), generate
