"""Compiled code that is chosen by the type of a structure: what one list of kinds shares with the other."""

from __future__ import annotations

from types import FunctionType
from typing import Any

from numba import types


def is_of(structure: Any, kind: type) -> bool:
    """Whether the compiler's type of an argument is that of a NamedTuple class, with arrays or with pointers."""
    return isinstance(structure, types.BaseNamedTuple) and structure.instance_class is kind


def body(kernel: Any) -> Any:
    """The Python function of a kernel without its annotations, which differ from kind to kind.

    Compiled in place of the call: a call of the compiled kernel would be one more layer to optimise.
    """
    function = kernel.py_func
    return FunctionType(function.__code__, function.__globals__, function.__name__)
