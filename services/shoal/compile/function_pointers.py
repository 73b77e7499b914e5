"""Calls through function pointers, so that what many loops share is compiled once and not into each of them.

Compiled code takes in everything it calls by name. The forces and constraints of a machine are large; the integrators
that call them are small and many: they call a compiled kernel by its address.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic


@intrinsic
def call(typing_context, address, arguments):  # type: ignore[no-untyped-def]
    """Call the kernel at an address with a tuple of arguments; it returns nothing."""
    return _call(types.none, address, arguments)


@intrinsic
def ask(typing_context, address, arguments):  # type: ignore[no-untyped-def]
    """Call the kernel at an address with a tuple of arguments and return the number that it returns."""
    return _call(types.float64, address, arguments)


def _call(result: Any, address: Any, arguments: Any) -> Any:
    kinds = tuple(arguments)

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        where, packed = values
        parts = [builder.extract_value(packed, k) for k in range(len(kinds))]
        kind = context.call_conv.get_function_type(result, kinds)
        function = builder.inttoptr(where, ir.PointerType(kind))
        _, value = context.call_conv.call_function(builder, function, result, kinds, parts)
        return value

    return result(address, arguments), generate


@intrinsic
def call_back(typing_context, address, t, out):  # type: ignore[no-untyped-def]
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
