"""Numba's analysis of variables without work that kernels do not need.

Most of the time of a compilation is Numba's own Python, not LLVM. Parts of it are replaced: the list of the variables
of a statement, which is asked for a dozen times, looks at types in place of classes; which variables are live at the
beginning of a block is found for generators only, as nothing else asks; whether a type is of a class is asked of
Python, as no class of types has virtual subclasses; and messages of failed attempts to find a type, most of which
nobody sees, are not coloured. Kernels are the same. Private names of version 0.68 are replaced.
"""

from __future__ import annotations

from functools import cache
from typing import Any

from numba.core import errors, ir, postproc, transforms, types

_PLAIN = (str, int, bool, float, type(None), ir.Loc)
"""Types of members of a statement, beside functions, that hold no variable."""


@cache
def install() -> None:
    """Install: from now on variables are listed, and lifetimes found, where they are needed."""
    numbas_run = postproc.PostProcessor.run

    def run(self: Any, emit_dels: bool = False, extend_lifetimes: bool = False) -> None:
        own = self.func_ir
        if own.is_generator or emit_dels:
            numbas_run(self, emit_dels, extend_lifetimes)
            return
        own.blocks = transforms.canonicalize_cfg(own.blocks)
        own.variable_lifetime = postproc.VariableLifetime(own.blocks)
        own.generator_info = None

    postproc.PostProcessor.run = run
    ir.Inst._rec_list_vars = lambda self, value: variables(value)
    type(types.Type).__instancecheck__ = type.__instancecheck__  # type: ignore[method-assign]
    if hasattr(errors, "HighlightColorScheme"):
        errors.HighlightColorScheme._markup = lambda self, text, color=None, style="": text


def variables(value: Any) -> list[Any]:
    """Return the variables in a member of a statement, in order."""
    kind = type(value)
    if kind is ir.Var:
        return [value]
    if kind in _PLAIN:
        return []
    if kind is dict:
        value = value.values()
    elif kind is not tuple and kind is not list:
        return value.list_vars() if isinstance(value, ir.Inst) else []
    return [one for part in value if type(part) not in _PLAIN for one in variables(part)]
