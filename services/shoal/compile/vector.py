"""Row operations on tiles as vector instructions, on raw pointers.

Compiled loops over the lanes of a row only become vector code when the compiler can prove that rows
do not overlap, which it cannot for rows picked by an index. These operations say it.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

_CONTRACT = ("contract",)


def _row(builder: Any, base: Any, row: Any, width: int) -> Any:
    vector = ir.VectorType(ir.DoubleType(), width)
    first = builder.gep(base, [builder.mul(row, ir.Constant(row.type, width))])
    return builder.bitcast(first, vector.as_pointer())


def _operation(combine: Any, operands: int) -> Any:
    """A row operation y[i] = combine(y[i], a[j], ...) with that many operands besides y."""

    def build(tile: Any, pairs: Any) -> Any:
        width = tile.count
        signature = types.void(tile, *pairs)

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            rows = [_row(builder, arguments[1 + 2 * k], arguments[2 + 2 * k], width) for k in range(operands + 1)]
            values = [builder.load(row, align=8) for row in rows]
            builder.store(combine(builder, *values), rows[0], align=8)
            return context.get_dummy_value()

        return signature, generate

    return build


_copy = _operation(lambda b, y, x: x, 1)
_clear = _operation(lambda b, y: ir.Constant(y.type, [0.0] * y.type.count), 0)
_add = _operation(lambda b, y, x: b.fadd(y, x), 1)
_subtract = _operation(lambda b, y, x: b.fsub(y, x), 1)
_scale = _operation(lambda b, y, a: b.fmul(y, a), 1)
_add_product = _operation(lambda b, y, a, x: b.fadd(y, b.fmul(a, x, flags=_CONTRACT), flags=_CONTRACT), 2)
_subtract_product = _operation(lambda b, y, a, x: b.fsub(y, b.fmul(a, x, flags=_CONTRACT), flags=_CONTRACT), 2)


@intrinsic
def copy(typing_context, tile, y, i, x, j):  # type: ignore[no-untyped-def]
    """Row i of y = row j of x."""
    return _copy(tile, (y, i, x, j))


@intrinsic
def clear(typing_context, tile, y, i):  # type: ignore[no-untyped-def]
    """Row i of y = 0."""
    return _clear(tile, (y, i))


@intrinsic
def add(typing_context, tile, y, i, x, j):  # type: ignore[no-untyped-def]
    """Row i of y += row j of x."""
    return _add(tile, (y, i, x, j))


@intrinsic
def subtract(typing_context, tile, y, i, x, j):  # type: ignore[no-untyped-def]
    """Row i of y -= row j of x."""
    return _subtract(tile, (y, i, x, j))


@intrinsic
def scale(typing_context, tile, y, i, a, j):  # type: ignore[no-untyped-def]
    """Row i of y *= row j of a."""
    return _scale(tile, (y, i, a, j))


@intrinsic
def add_product(typing_context, tile, y, i, a, j, x, k):  # type: ignore[no-untyped-def]
    """Row i of y += row j of a * row k of x."""
    return _add_product(tile, (y, i, a, j, x, k))


@intrinsic
def subtract_product(typing_context, tile, y, i, a, j, x, k):  # type: ignore[no-untyped-def]
    """Row i of y -= row j of a * row k of x."""
    return _subtract_product(tile, (y, i, a, j, x, k))


@intrinsic
def subtract_dot(typing_context, tile, x, i, a, slots, rows, begin, end, first):  # type: ignore[no-untyped-def]
    """Row i of x -= sum over begin <= p < end of (row slots[p] of a) * (row first + rows[p] of x)."""
    width = tile.count

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        _, x, i, a, slots, rows, begin, end, first = arguments
        target = _row(builder, x, i, width)
        total = cgutils.alloca_once_value(builder, builder.load(target, align=8))
        with cgutils.for_range(builder, end, start=begin) as loop:
            slot = builder.sext(builder.load(builder.gep(slots, [loop.index])), first.type)
            row = builder.sext(builder.load(builder.gep(rows, [loop.index])), first.type)
            factor = builder.load(_row(builder, a, slot, width), align=8)
            value = builder.load(_row(builder, x, builder.add(first, row), width), align=8)
            product = builder.fmul(factor, value, flags=_CONTRACT)
            builder.store(builder.fsub(builder.load(total), product, flags=_CONTRACT), total)
        builder.store(builder.load(total), target, align=8)
        return context.get_dummy_value()

    return types.void(tile, x, i, a, slots, rows, begin, end, first), generate
