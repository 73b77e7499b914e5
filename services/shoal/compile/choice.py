"""Compiled code that is chosen by the type of a structure: what one list of kinds shares with the other."""

from __future__ import annotations

import inspect
from types import FunctionType
from typing import Any

from numba.extending import overload

ALTERNATIVES: dict[Any, list[tuple[type, Any]]] = {}
"""By generic function: the kinds of structures and the kernels that compiled calls run with them."""


def choose(generic: Any, kind: type, kernel: Any, **options: bool) -> None:
    """Let compiled calls of `generic` with a structure of this kind run a kernel, whose parameters have the same names.

    kind: a NamedTuple class, with arrays or with pointers. The kernel is compiled in place of the call (a call of the
    compiled kernel would be one more layer to optimise), without its annotations, which differ from kind to kind.
    """
    function = getattr(kernel, "py_func", kernel)
    bare = FunctionType(function.__code__, function.__globals__, function.__name__, None, function.__closure__)

    def chosen(*arguments: Any) -> Any:
        return bare if any(getattr(argument, "instance_class", None) is kind for argument in arguments) else None

    chosen.__signature__ = inspect.signature(bare)  # type: ignore[attr-defined]
    ALTERNATIVES.setdefault(generic, []).append((kind, kernel))
    overload(generic, jit_options={"error_model": "numpy", **options})(chosen)
