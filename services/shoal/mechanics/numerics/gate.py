"""Calls through a function's address, so that what many loops share is compiled once and not into each of them.

Compiled code takes in everything it calls by name. The forces and constraints of a machine are large; the integrators
that call them are small and many. A gate is the address of a compiled kernel that gets its structures from memory: a
structure is stored once in its own `home`, and a typed pointer to it is passed on.
"""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from shoal.mechanics.numerics.tile import Array

HOME = 8192


def home() -> Array:
    """Memory for one structure, in bytes."""
    return np.zeros(HOME // 8)


def put(place: Array, structure: tuple[Any, ...]) -> None:
    """Write a structure with pointers in place of its arrays, which must outlive its use, into its home.

    It is what `store` writes of `pointers.raw`, without a kernel of its own for every type of structure: members in
    order, each at a multiple of its alignment, 8 bytes but for yes or no.
    """
    memory = place.view(np.uint8).data
    end, _ = _laid(structure, 0, memory)
    assert end <= HOME


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
    """Write a structure of numbers and pointers into its home (a pointer to float64)."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        where, value = arguments
        if context.get_abi_sizeof(value.type) > HOME:
            raise NotImplementedError("gate: the structure is larger than its home")
        builder.store(value, builder.bitcast(where, value.type.as_pointer()), align=8)
        return context.get_dummy_value()

    return types.void(place, structure), generate


@intrinsic
def typed(typing_context, place, structure):  # type: ignore[no-untyped-def]
    """The home as a pointer that carries the structure's type; the structure itself is not looked at."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        return builder.bitcast(arguments[0], context.get_value_type(signature.return_type))

    return types.CPointer(structure)(place, structure), generate


@intrinsic
def load(typing_context, pointer):  # type: ignore[no-untyped-def]
    """The structure at a pointer made by `typed`."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        kind = context.get_value_type(pointer.dtype)
        return builder.load(builder.bitcast(arguments[0], kind.as_pointer()), align=8)

    return pointer.dtype(pointer), generate


@intrinsic
def call(typing_context, address, arguments):  # type: ignore[no-untyped-def]
    """Call the kernel at an address with a tuple of arguments; it returns nothing."""
    kinds = tuple(arguments)

    def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
        where, packed = values
        parts = [builder.extract_value(packed, k) for k in range(len(kinds))]
        kind = context.call_conv.get_function_type(types.none, kinds)
        function = builder.inttoptr(where, ir.PointerType(kind))
        context.call_conv.call_function(builder, function, types.none, kinds, parts)
        return context.get_dummy_value()

    return types.void(address, arguments), generate


@intrinsic
def ask(typing_context, address, t, out):  # type: ignore[no-untyped-def]
    """Call a C function at an address, void (double t, double *out): one of Python's, by `ctypes`."""

    def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
        where, time, place = values
        kind = ir.FunctionType(ir.VoidType(), [ir.DoubleType(), place.type])
        builder.call(builder.inttoptr(where, kind.as_pointer()), [time, place])
        return context.get_dummy_value()

    return types.void(address, t, out), generate


def address(kernel: Any, kinds: tuple[Any, ...]) -> int:
    """Compile a kernel for these argument types (or take it from the cache) and return where it is."""
    kernel.compile(kinds)
    compiled = kernel.overloads[kinds]
    return int(compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name))
