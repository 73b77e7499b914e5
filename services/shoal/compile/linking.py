"""Link-time optimisation of kernels: functions that only kernels call are kept as intermediate code.

Numba makes machine code, with entry points for Python and C, of every function, also of those that are only parts of
others: they are optimised and emitted once by themselves and again within each caller, level by level. Here only an
entry (called from Python or by a function pointer) is optimised and emitted, with all that it calls; its parts stay
intermediate code, in the cache as well. A part that is called from Python later is compiled again, as an entry.

Parts that several processes compiled meet in one module, by their names. Numba distinguishes functions of one name that
enclose different values by a number that every process counts from 1: the sum of two vectors would become the product
that another process has under this number. Here each process counts from a random number.

Numba also lets a function take over `forceinline` from the caller that happens to compile it first, and all that it
calls from there: large functions would be copied to every place that calls them, or not, as the order has it. Here
only those are always inlined that say so themselves; of the others LLVM decides.

Numba offers no setting for this: private names of version 0.68 are replaced.
"""

from __future__ import annotations

import itertools
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

import llvmlite.binding as llvm
from numba.core import bytecode, caching, codegen, cpu, dispatcher, sigutils
from numba.core.environment import lookup_environment

_LINKED = "linked"
_depth = 0
"""Depth of nested compilations, each required by the one before; Numba's lock is held meanwhile."""


class Part:
    """Stands for the entry point of a function that is only linked."""


@contextmanager
def level(function: Any, signature: Any) -> Iterator[None]:
    """Enter a compilation: the outermost makes an entry, those within it make parts. Numba's lock is held."""
    global _depth
    if _depth == 0:
        kinds = tuple(sigutils.normalize_signature(signature)[0])
        found = function.overloads.get(kinds)
        if found is not None and isinstance(found.entry_point, Part):
            del function.overloads[kinds]
    _depth += 1
    try:
        yield
    finally:
        _depth -= 1


@cache
def install() -> None:
    """Install: from now on functions that kernels call are linked only, and numbered as in no other process."""
    numbas_flags = dispatcher._FunctionCompiler._customize_flags  # type: ignore[attr-defined]
    numbas_executable = cpu.CPUContext.get_executable
    numbas_set_env = codegen.JITCPUCodegen.set_env
    numbas_add = dispatcher.Dispatcher.add_overload
    numbas_key = caching.Cache._index_key
    numbas_serialize = codegen.CPUCodeLibrary.serialize_using_object_code
    numbas_unserialize = codegen.CPUCodeLibrary._unserialize.__func__
    numbas_linking = codegen.CPUCodeLibrary.add_linking_library

    def customize_flags(self: Any, flags: Any) -> Any:
        flags = numbas_flags(self, flags)
        flags.forceinline = bool(self.targetoptions.get("forceinline"))
        if _depth > 1:
            flags.no_cpython_wrapper = flags.no_cfunc_wrapper = True
        return flags

    def get_executable(self: Any, library: Any, description: Any, environment: Any) -> Any:
        if _depth > 1:
            _gather(library)
            return Part()
        entry = numbas_executable(self, library, description, environment)
        for name in [variable.name for variable in library._final_module.global_variables]:
            if name.startswith("_ZN08NumbaEnv") and (its := lookup_environment(name)) is not None:
                library.codegen.set_env(name, its)
        return entry

    def set_env(self: Any, name: str, environment: Any) -> None:
        if _depth <= 1:  # a part has no place for it until it is within an entry
            numbas_set_env(self, name, environment)

    def add_overload(self: Any, compiled: Any) -> None:
        if isinstance(compiled.entry_point, Part):
            self.overloads[tuple(compiled.signature.args)] = compiled
        else:
            numbas_add(self, compiled)

    def index_key(self: Any, signature: Any, generator: Any) -> Any:
        key = numbas_key(self, signature, generator)
        return (*key, _LINKED) if _depth > 1 else key

    def serialize(self: Any) -> Any:
        if getattr(self, _LINKED, False):
            return self.name, _LINKED, self._get_module_for_linking().as_bitcode()
        return numbas_serialize(self)

    def unserialize(cls: Any, generator: Any, state: Any) -> Any:
        name, kind, data = state
        if kind != _LINKED:
            return numbas_unserialize(cls, generator, state)
        library = generator.create_library(name)
        library._final_module = library._shared_module = llvm.parse_bitcode(data)
        library._finalized = library.linked = True
        return library

    def add_linking_library(self: Any, library: Any) -> None:
        _gather(library)
        numbas_linking(self, library)

    _number()
    os.register_at_fork(after_in_child=_number)
    dispatcher._FunctionCompiler._customize_flags = customize_flags  # type: ignore[attr-defined]
    cpu.CPUContext.get_executable = get_executable
    codegen.JITCPUCodegen.set_env = set_env
    dispatcher.Dispatcher.add_overload = add_overload  # type: ignore[method-assign, assignment]
    caching.Cache._index_key = index_key
    codegen.CPUCodeLibrary.serialize_using_object_code = serialize
    codegen.CPUCodeLibrary._unserialize = classmethod(unserialize)
    codegen.CPUCodeLibrary.add_linking_library = add_linking_library


def _number() -> None:
    """Let Numba number functions from a random number, as no other process does."""
    bytecode.FunctionIdentity._unique_ids = itertools.count(secrets.randbits(62))


def _gather(library: Any) -> None:
    """Put a function and what it calls into one module, not optimised: the entry that takes it in is."""
    if library._finalized:
        return
    for part in dict.fromkeys(library._linking_libraries):
        library._reload_init.update(part._reload_init)
        library._final_module.link_in(part._get_module_for_linking(), preserve=True)
    library._finalize_dynamic_globals()
    library._finalized = library.linked = True
