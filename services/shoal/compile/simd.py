"""SIMD vectors of doubles as values in compiled code: `+ - * /`, `sqrt`, loads and stores.

The compiler makes vector code of a loop over lanes only if it can prove that rows do not overlap, and not through long
formulas. Here a formula is written once for a number; given vectors, it is computed for as many lanes as they have: the
simulations of a tile, or elements of a single one. The length is that of a tuple, as of a tile. LLVM splits vectors
that are longer than the processor's; results do not depend on it but for the rounding of fused products.
"""

from __future__ import annotations

import itertools
import operator
from typing import Any

from llvmlite import ir
from numba import njit, types
from numba.core import cgutils
from numba.core.datamodel import models
from numba.core.imputils import lower_builtin
from numba.core.typing import signature
from numba.core.typing.templates import AbstractTemplate, infer_global
from numba.extending import intrinsic, register_model

from shoal.compile.pointers import Pointer

EIGHT: tuple[int, ...] = (0,) * 8
"""The lanes of the longest vectors of today's processors."""
FLAGS = ("contract", "nsz")
"""What the compiler may do with operations on vectors: fuse products and sums, and forget signs of zeros."""


class Vector(types.Type):  # type: ignore[misc]
    """The compiler's type of a vector of `count` doubles."""

    def __init__(self, count: int) -> None:
        self.count = count
        super().__init__(f"Vector({count})")


@register_model(Vector)
class _Model(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Vector) -> None:
        super().__init__(manager, kind, _vector(kind.count))


def _vector(count: int) -> Any:
    return ir.VectorType(ir.DoubleType(), count)


def _place(builder: Any, base: Any, at: Any, count: int) -> Any:
    return builder.bitcast(builder.gep(base, [at]), _vector(count).as_pointer())


def spread_value(builder: Any, value: Any, count: int) -> Any:
    """Append instructions that broadcast a number to a vector."""
    kind = ir.VectorType(value.type, count)
    undefined = ir.Constant(kind, ir.Undefined)
    first = builder.insert_element(undefined, value, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(first, undefined, ir.Constant(ir.VectorType(ir.IntType(32), count), [0] * count))


@intrinsic
def load(typing_context, tile, base, at):  # type: ignore[no-untyped-def]
    """Load consecutive entries from `at` on, as many as the tile has lanes."""
    count = tile.count

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        return builder.load(_place(builder, arguments[1], arguments[2], count), align=8)

    return Vector(count)(tile, base, at), generate


@intrinsic
def store(typing_context, base, at, value):  # type: ignore[no-untyped-def]
    """Store a vector to the entries from `at` on."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        builder.store(arguments[2], _place(builder, arguments[0], arguments[1], value.count), align=8)
        return context.get_dummy_value()

    return types.void(base, at, value), generate


@intrinsic
def add_to(typing_context, base, at, value):  # type: ignore[no-untyped-def]
    """Add a vector to the entries from `at` on."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        place = _place(builder, arguments[0], arguments[1], value.count)
        builder.store(builder.fadd(builder.load(place, align=8), arguments[2], flags=FLAGS), place, align=8)
        return context.get_dummy_value()

    return types.void(base, at, value), generate


@intrinsic
def gather(typing_context, tile, base, first, step):  # type: ignore[no-untyped-def]
    """Gather the entries first, first + step, ..."""
    count = tile.count

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        _, base, at, step = arguments
        return _collected(builder, _stepped(builder, at, step, count), base)

    return Vector(count)(tile, base, first, step), generate


@intrinsic
def pick(typing_context, tile, base, rows, first, step):  # type: ignore[no-untyped-def]
    """Gather the entries with the indices rows[first], rows[first + step], ..."""
    count = tile.count

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        _, base, rows, at, step = arguments
        places = [builder.gep(rows, [place]) for place in _stepped(builder, at, step, count)]
        return _collected(builder, [builder.load(place) for place in places], base)

    return Vector(count)(tile, base, rows, first, step), generate


def _collected(builder: Any, numbers: list[Any], base: Any) -> Any:
    value = ir.Constant(_vector(len(numbers)), ir.Undefined)
    for k, number in enumerate(numbers):
        value = builder.insert_element(value, builder.load(builder.gep(base, [number])), ir.IntType(32)(k))
    return value


def _tuple(like: Any, tile: Any, arguments: tuple[Any, ...], one: Any) -> Any:
    """Return the signature and the generator of a tuple of vectors, as long as `like`.

    one: makes the vector of a number k from the builder and the values of the arguments.
    """
    kind = types.UniTuple(Vector(tile.count), like.count)

    def generate(context, builder, signature, values):  # type: ignore[no-untyped-def]
        return context.make_tuple(builder, kind, [one(builder, values, k) for k in range(like.count)])

    return kind(like, tile, *arguments), generate


@intrinsic
def loads(typing_context, like, tile, base, at, step):  # type: ignore[no-untyped-def]
    """Return a tuple, as long as `like`, of the vectors that `load` finds at, at + step, ..."""

    def one(builder, values, k):  # type: ignore[no-untyped-def]
        _, _, base, at, step = values
        place = builder.add(at, builder.mul(step, at.type(k)))
        return builder.load(_place(builder, base, place, tile.count), align=8)

    return _tuple(like, tile, (base, at, step), one)


@intrinsic
def loads_rows(typing_context, like, tile, base, rows, first, lane, width):  # type: ignore[no-untyped-def]
    """Return a tuple of the vectors at the lane of the rows rows[first], rows[first + 1], ... of a width."""

    def one(builder, values, k):  # type: ignore[no-untyped-def]
        _, _, base, rows, first, lane, width = values
        row = builder.load(builder.gep(rows, [builder.add(first, first.type(k))]))
        place = builder.add(builder.mul(row, width), lane)
        return builder.load(_place(builder, base, place, tile.count), align=8)

    return _tuple(like, tile, (base, rows, first, lane, width), one)


@intrinsic
def gathers(typing_context, like, tile, base, first, step):  # type: ignore[no-untyped-def]
    """Return a tuple of what `gather` finds from first, first + 1, ... on."""

    def one(builder, values, k):  # type: ignore[no-untyped-def]
        _, _, base, first, step = values
        begin = builder.add(first, first.type(k))
        return _collected(builder, _stepped(builder, begin, step, tile.count), base)

    return _tuple(like, tile, (base, first, step), one)


@intrinsic
def picks(typing_context, like, tile, base, rows, first, step, next_row, next_entry):  # type: ignore[no-untyped-def]
    """Return a tuple of what `pick` finds; from one to the next first grows by next_row, all indices by next_entry."""

    def one(builder, values, k):  # type: ignore[no-untyped-def]
        _, _, base, rows, first, step, next_row, next_entry = values
        begin = builder.add(first, builder.mul(next_row, first.type(k)))
        places = [builder.gep(rows, [at]) for at in _stepped(builder, begin, step, tile.count)]
        shifted = builder.gep(base, [builder.mul(next_entry, next_entry.type(k))])
        return _collected(builder, [builder.load(place) for place in places], shifted)

    return _tuple(like, tile, (base, rows, first, step, next_row, next_entry), one)


def _stepped(builder: Any, first: Any, step: Any, count: int) -> list[Any]:
    return [builder.add(first, builder.mul(step, first.type(k))) for k in range(count)]


@intrinsic
def spread(typing_context, tile, number):  # type: ignore[no-untyped-def]
    """Broadcast a number to all lanes."""
    count = tile.count

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        return spread_value(builder, arguments[1], count)

    return Vector(count)(tile, number), generate


@intrinsic
def repeat(typing_context, tile, group, base, at):  # type: ignore[no-untyped-def]
    """Load as many entries from `at` on as the group has members, and repeat them over the lanes."""
    count, members = tile.count, group.count
    if count % members:
        raise TypeError(f"repeat: {count} lanes are no multiple of {members}")

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        part = builder.load(_place(builder, arguments[2], arguments[3], members), align=8)
        numbers = ir.Constant(ir.VectorType(ir.IntType(32), count), [k % members for k in range(count)])
        return builder.shuffle_vector(part, ir.Constant(part.type, ir.Undefined), numbers)

    return Vector(count)(tile, group, base, at), generate


@intrinsic
def root(typing_context, x):  # type: ignore[no-untyped-def]
    """Return the square root of a vector."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        kind = arguments[0].type
        function = ir.FunctionType(kind, [kind])
        return builder.call(
            cgutils.get_or_insert_function(builder.module, function, f"llvm.sqrt.v{x.count}f64"), arguments
        )

    return x(x), generate


def _knows_digits(context: Any, count: int) -> bool:
    """Return whether the processor has AVX-512, for vectors of this length."""
    return count == len(EIGHT) and "+avx512f" in context.codegen().magic_tuple()[2].split(",")


def _near(builder: Any, name: str, value: Any) -> Any:
    """Return an approximate inverse of 14 bits, by AVX-512."""
    kind = value.type
    function = ir.FunctionType(kind, [kind, kind, ir.IntType(8)])
    found = cgutils.get_or_insert_function(builder.module, function, f"llvm.x86.avx512.{name}.pd.512")
    return builder.call(found, [value, ir.Constant(kind, [0.0] * kind.count), ir.IntType(8)(255)])


@intrinsic
def inverse_root(typing_context, x):  # type: ignore[no-untyped-def]
    """Return 1/sqrt of positive numbers, to the last digit or two; NaN is possible for zero and infinity.

    Square root and division are the slowest instructions. AVX-512 has an approximation of 14 bits; the first four terms
    of the series in the relative error of its square give the rest.
    """

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        (value,) = arguments
        kind = value.type
        one = ir.Constant(kind, [1.0] * x.count)
        if not _knows_digits(context, x.count):
            function = ir.FunctionType(kind, [kind])
            found = cgutils.get_or_insert_function(builder.module, function, f"llvm.sqrt.v{x.count}f64")
            return builder.fdiv(one, builder.call(found, arguments), flags=FLAGS)
        near = _near(builder, "rsqrt14", value)
        off = builder.fsub(one, builder.fmul(value, builder.fmul(near, near, flags=FLAGS), flags=FLAGS), flags=FLAGS)
        terms = ir.Constant(kind, [0.3125] * x.count)
        for factor in (0.375, 0.5):
            above = builder.fmul(terms, off, flags=FLAGS)
            terms = builder.fadd(above, ir.Constant(kind, [factor] * x.count), flags=FLAGS)
        change = builder.fmul(builder.fmul(near, off, flags=FLAGS), terms, flags=FLAGS)
        return builder.fadd(near, change, flags=FLAGS)

    return x(x), generate


@intrinsic
def reciprocal(typing_context, x):  # type: ignore[no-untyped-def]
    """Return 1/x to the last digit or two, as `inverse_root`; NaN is possible for zero and infinity."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        (value,) = arguments
        kind = value.type
        one = ir.Constant(kind, [1.0] * x.count)
        if not _knows_digits(context, x.count):
            return builder.fdiv(one, value, flags=FLAGS)
        near = _near(builder, "rcp14", value)
        off = builder.fsub(one, builder.fmul(value, near, flags=FLAGS), flags=FLAGS)
        terms = off
        for _ in range(2):
            terms = builder.fadd(builder.fmul(terms, off, flags=FLAGS), off, flags=FLAGS)
        return builder.fadd(builder.fmul(near, terms, flags=FLAGS), near, flags=FLAGS)

    return x(x), generate


@intrinsic
def heaviside(typing_context, x):  # type: ignore[no-untyped-def]
    """Return 1 where a vector is not negative, elsewhere 0."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        zero = ir.Constant(arguments[0].type, [0.0] * x.count)
        return builder.uitofp(builder.fcmp_ordered(">=", arguments[0], zero), arguments[0].type)

    return x(x), generate


@intrinsic
def inverse_below(typing_context, x, limit):  # type: ignore[no-untyped-def]
    """Return 1/x where a vector is below a limit, elsewhere 0."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        value, limit = arguments
        one, zero = (ir.Constant(value.type, [number] * x.count) for number in (1.0, 0.0))
        below = builder.fcmp_ordered("<", value, limit)
        return builder.select(below, builder.fdiv(one, value, flags=FLAGS), zero)

    return x(x, limit), generate


@intrinsic
def zeros(typing_context, x):  # type: ignore[no-untyped-def]
    """Count the zeros of a vector."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        (value,) = arguments
        same = builder.fcmp_ordered("==", value, ir.Constant(value.type, [0.0] * x.count))
        wide = ir.VectorType(ir.IntType(64), x.count)
        function = cgutils.get_or_insert_function(
            builder.module, ir.FunctionType(ir.IntType(64), [wide]), f"llvm.vector.reduce.add.v{x.count}i64"
        )
        return builder.call(function, [builder.zext(same, wide)])

    return types.int64(x), generate


@intrinsic
def least(typing_context, x):  # type: ignore[no-untyped-def]
    """Return the minimum of a vector; NaN is ignored."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        (value,) = arguments
        kind = ir.FunctionType(ir.DoubleType(), [value.type])
        function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.vector.reduce.fmin.v{x.count}f64")
        return builder.call(function, [value])

    return types.float64(x), generate


@intrinsic
def larger(typing_context, x, y):  # type: ignore[no-untyped-def]
    """Return max(|x|, |y|)."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        kind = arguments[0].type
        size, most = (
            cgutils.get_or_insert_function(
                builder.module, ir.FunctionType(kind, [kind] * count), f"llvm.{name}.v{x.count}f64"
            )
            for name, count in (("fabs", 1), ("maxnum", 2))
        )
        return builder.call(most, [builder.call(size, [value]) for value in arguments])

    return x(x, y), generate


def _define(operation: Any, instruction: str) -> None:
    """Let an operator of two vectors, or of a vector and a number, be an instruction, not a function to compile."""

    @infer_global(operation)
    class Operator(AbstractTemplate):  # type: ignore[misc]
        def generic(self, arguments: Any, _named: Any) -> Any:
            vectors = {kind for kind in arguments if isinstance(kind, Vector)}
            if len(vectors) > 1:
                lengths = " and ".join(str(kind.count) for kind in arguments)
                raise TypeError(f"{instruction}: vectors of lengths {lengths}")
            numbers = all(isinstance(kind, Vector | types.Float) for kind in arguments)
            return signature(*vectors, *arguments) if vectors and numbers else None

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        count = signature.return_type.count
        kinds = zip(signature.args, arguments, strict=True)
        values = [value if isinstance(kind, Vector) else spread_value(builder, value, count) for kind, value in kinds]
        return getattr(builder, instruction)(*values, flags=() if len(values) == 1 else FLAGS)

    numbers = (Vector,) if instruction == "fneg" else (Vector, types.Float)
    for kinds in itertools.product(numbers, repeat=1 if instruction == "fneg" else 2):
        if Vector in kinds:
            lower_builtin(operation, *kinds)(generate)


for _operation, _instruction in (
    (operator.add, "fadd"),
    (operator.sub, "fsub"),
    (operator.mul, "fmul"),
    (operator.truediv, "fdiv"),
    (operator.neg, "fneg"),
):
    _define(_operation, _instruction)


@njit(error_model="numpy", forceinline=True)
def assign(y: Pointer, x: Pointer, count: int) -> None:
    """Copy x to y, `count` numbers behind pointers; y and x do not overlap."""
    whole = count - count % len(EIGHT)
    for i in range(0, whole, len(EIGHT)):
        store(y, i, load(EIGHT, x, i))
    for i in range(whole, count):
        y[i] = x[i]


@njit(error_model="numpy", forceinline=True)
def add_scaled(y: Pointer, factor: float, x: Pointer, count: int) -> None:
    """Add factor x to y, `count` numbers behind pointers; y and x do not overlap."""
    whole = count - count % len(EIGHT)
    for i in range(0, whole, len(EIGHT)):
        add_to(y, i, factor * load(EIGHT, x, i))
    for i in range(whole, count):
        y[i] += factor * x[i]
