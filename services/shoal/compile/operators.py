"""Type inference of operators without NumPy's rules for arrays where there are none, and once for the same operands.

Numba tries the rules of NumPy's universal functions first for every `+`, `*` and `<`, finds the loop that fits, and
rejects it where no operand is an array: a seventh of the time that a time loop takes to compile. Here they are tried
where there is an array. It also tries all rules of an operator for every occurrence, and writes a message for each that
does not fit, with all that would: here the result is kept by the types of the operands. Kernels are the same. Private
names of version 0.68 are changed.
"""

from __future__ import annotations

from functools import cache
from typing import Any

from numba.core import types
from numba.core.typing import npydecl


@cache
def install() -> None:
    """Install: from now on numbers have their own rules only, which are tried once."""
    numbas_generic = npydecl.NumpyRulesArrayOperator.generic

    def generic(self: Any, args: Any, kws: Any) -> Any:
        arrays = any(isinstance(one, types.ArrayCompatible) for one in args)
        return numbas_generic(self, args, kws) if arrays else None

    npydecl.NumpyRulesArrayOperator.generic = generic

    numbas_call = types.Function.get_call_type
    found: dict[Any, Any] = {}

    def get_call_type(self: Any, context: Any, args: Any, kws: Any) -> Any:
        if kws:
            return numbas_call(self, context, args, kws)
        key = id(self), id(context), args
        if key not in found:
            found[key] = self, context, numbas_call(self, context, args, kws)  # both stay, so that their ids do
        return found[key][-1]

    types.Function.get_call_type = get_call_type  # type: ignore[method-assign]
