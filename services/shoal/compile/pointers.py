"""Raw pointers in place of arrays, which keep reference counting out of the time loop. The caller owns the memory."""

from __future__ import annotations

from typing import Any

from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

Pointer = Any
"""A pointer to float64 in compiled code."""


@intrinsic
def pointer(typing_context, array):  # type: ignore[no-untyped-def]
    """Return the address of an array's first entry; the array must outlive its use."""
    if not isinstance(array, types.Array) or array.layout != "C":
        raise TypeError(f"pointer: needs a contiguous array, found {array}")

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        return cgutils.create_struct_proxy(signature.args[0])(context, builder, arguments[0]).data

    return types.CPointer(array.dtype)(array), generate


@intrinsic
def shift(typing_context, base, offset):  # type: ignore[no-untyped-def]
    """Return a pointer moved on by `offset` entries."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        return builder.gep(arguments[0], [arguments[1]])

    return base(base, offset), generate


@intrinsic
def pointed(typing_context, address):  # type: ignore[no-untyped-def]
    """Return the pointer to numbers that lie at an address."""
    kind = types.CPointer(types.float64)

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        return builder.inttoptr(arguments[0], context.get_value_type(kind))

    return kind(address), generate


@intrinsic
def raw(typing_context, structure):  # type: ignore[no-untyped-def]
    """Return a structure (a tuple, named or not) with pointers in place of its arrays and of those inside its parts."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        return _converted(context, builder, structure, arguments[0])

    return raw_type(structure)(structure), generate


def raw_type(kind: Any) -> Any:
    """Return the compiler's type of the result of `raw` for a structure of this type."""
    if isinstance(kind, types.Array):
        return types.CPointer(kind.dtype)
    if isinstance(kind, types.BaseTuple):
        named = kind.instance_class if isinstance(kind, types.BaseNamedTuple) else None
        return types.BaseTuple.from_types([raw_type(part) for part in kind.types], named)
    return kind


def _converted(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    if isinstance(kind, types.Array):
        return cgutils.create_struct_proxy(kind)(context, builder, value).data
    if isinstance(kind, types.BaseTuple):
        parts = [builder.extract_value(value, k) for k in range(len(kind.types))]
        converted = [_converted(context, builder, part, one) for part, one in zip(kind.types, parts, strict=True)]
        return context.make_tuple(builder, raw_type(kind), converted)
    return value
