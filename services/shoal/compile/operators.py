"""Type inference of operators on numbers without NumPy's rules for arrays.

Numba tries the rules of NumPy's universal functions first for every `+`, `*` and `<`, finds the loop that fits, and
rejects it where no operand is an array: a seventh of the time that a time loop takes to compile. Here they are tried
where there is an array. Kernels are the same. A private class of version 0.68 is changed.
"""

from __future__ import annotations

from functools import cache
from typing import Any

from numba.core import types
from numba.core.typing import npydecl


@cache
def install() -> None:
    """Install: from now on numbers have their own rules only."""
    numbas_generic = npydecl.NumpyRulesArrayOperator.generic

    def generic(self: Any, args: Any, kws: Any) -> Any:
        arrays = any(isinstance(one, types.ArrayCompatible) for one in args)
        return numbas_generic(self, args, kws) if arrays else None

    npydecl.NumpyRulesArrayOperator.generic = generic
