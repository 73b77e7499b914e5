"""Content-addressed cache of compiled kernels: the key of a kernel is a hash of all that its machine code depends on.

Numba looks at the file of a kernel alone, so it would go on using one whose callee in another file has changed. Here
the key follows the functions that a kernel calls and the constants that it reads, through all files. An edit compiles
those kernels again that it reaches; comments, docstrings and moved lines reach none.
"""

from __future__ import annotations

import hashlib
import opcode
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from types import BuiltinFunctionType, CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np
from numba.core import caching, config, types
from numba.core.dispatcher import Dispatcher
from numba.extending import _Intrinsic

from shoal.compile.choice import ALTERNATIVES

_OWN = "shoal."
_INSTRUCTIONS = ("choice", "function_pointers", "linking", "pointers", "simd", "structures", "tuples", "vector")
"""Modules whose functions run while a kernel is compiled and decide its code: they count as a whole."""


class _Locator(caching.UserProvidedCacheLocator):  # type: ignore[misc]
    """Finds the kernels of a module by its name: neither the path nor the lines of its file matter."""

    def __init__(self, function: Any, file: str) -> None:
        super().__init__(function, file)
        self._cache_path = str(Path(config.CACHE_DIR) / function.__module__)

    def get_source_stamp(self) -> str:
        """Return the same for all versions of a file: the keys in an index differ."""
        return ""

    def get_disambiguator(self) -> str:
        """Return the same for all functions of one name: their keys differ."""
        return "content"


class _Storage(caching.CompileResultCacheImpl):  # type: ignore[misc]
    _locator_classes = (_Locator,)


class _Cache(caching.FunctionCache):  # type: ignore[misc]
    _impl_class = _Storage

    def _index_key(self, signature: Any, generator: Any) -> tuple[Any, ...]:
        """Return a key of texts: one of types is unreadable to versions that have their classes elsewhere."""
        _, *rest = super()._index_key(signature, generator)
        kinds = " ".join(map(_text, getattr(signature, "args", signature)))
        return (kinds, *rest, key(self._py_func, kinds))


def _text(kind: Any) -> str:
    """The name of a type, with the modules of the structures in it, as two of them may have one name."""
    parts, own = getattr(kind, "types", None) or [getattr(kind, "dtype", None)], getattr(kind, "instance_class", None)
    return " ".join([str(kind), *([own.__module__] if own else []), *map(_text, filter(None, parts))])


def address_by_content(kernel: Any) -> None:
    """Let a kernel of this library be kept under its content from now on, if it is kept at all."""
    function = kernel.py_func
    kept = type(kernel._cache) is caching.FunctionCache
    if kept and config.CACHE_DIR and function.__module__.startswith(_OWN):
        kernel._cache = _Cache(function)


def key(function: FunctionType, kinds: str) -> str:
    """Return a hash of a kernel, of all that it calls with these types of arguments, and of the constants they read."""
    chosen = frozenset(kind for pairs in ALTERNATIVES.values() for kind, _ in pairs if kind.__name__ in kinds)
    return _hash(function, chosen)


@cache
def _hash(function: FunctionType, chosen: frozenset[type]) -> str:
    seen, pending, found = {id(function)}, [function], {_instructions()}
    while pending:
        own, callees = _parts(pending.pop(), chosen)
        found.add(own)
        for callee in callees:
            if id(callee) not in seen:
                seen.add(id(callee))
                pending.append(callee)
    return hashlib.sha256(b"".join(sorted(found))).hexdigest()


@cache
def _parts(function: FunctionType, chosen: frozenset[type]) -> tuple[bytes, list[FunctionType]]:
    """Return a hash of one function and of the constants it reads, and the functions of this library that it calls."""
    if function in ALTERNATIVES:
        kernels = [kernel for kind, kernel in ALTERNATIVES[function] if kind in chosen]
        return b"", [getattr(kernel, "py_func", kernel) for kernel in kernels]
    digest = hashlib.sha256(f"{function.__module__}.{function.__qualname__} {function.__defaults__}".encode())
    callees, names, attributes = _overloads(function), set[str](), set[str]()
    for code in _codes(function.__code__):
        constants = tuple(one for one in code.co_consts if not isinstance(one, CodeType) and one != function.__doc__)
        digest.update(code.co_code + _constant((constants, code.co_names, code.co_varnames)))
        names.update(_global_names(code))
        attributes.update(code.co_names)
    for name, value in sorted(_globals(function, names, attributes).items()):
        if isinstance(value, Dispatcher):
            digest.update(f"{name}: ".encode() + _constant(value.targetoptions))
            callees.append(value.py_func)
        elif isinstance(value, FunctionType) and value.__module__.startswith(_OWN):
            callees.append(value)
        else:
            digest.update(f"{name}: ".encode() + _constant(value))
    return digest.digest(), callees


def _overloads(function: FunctionType) -> list[FunctionType]:
    """Return all functions of a module that has Numba choose some by `overload`: none of them names the chosen one."""
    if "overload" not in function.__globals__:
        return []
    inside = [getattr(value, "py_func", value) for value in function.__globals__.values()]
    return [one for one in inside if isinstance(one, FunctionType) and one.__module__ == function.__module__]


def _codes(code: CodeType) -> Iterator[CodeType]:
    """Yield the code of a function and of those within it."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _codes(constant)


_LOAD_GLOBAL = opcode.opmap["LOAD_GLOBAL"]


def _global_names(code: CodeType) -> Iterator[str]:
    """Yield the names that are looked up in the module: `b`, but not the attribute `a` of `b.a`.

    The module may have another `a`, which may be a table that fills while a program runs.
    """
    extended = 0
    for operation, argument in zip(code.co_code[::2], code.co_code[1::2], strict=True):
        argument |= extended
        extended = argument << 8 if operation == opcode.EXTENDED_ARG else 0
        if operation == _LOAD_GLOBAL:
            yield code.co_names[argument >> 1]  # the last bit says whether it is called


def _globals(function: FunctionType, names: set[str], attributes: set[str]) -> dict[str, Any]:
    """Return what the names in a function stand for, attributes of modules of this library as `module.name`."""
    found = {name: function.__globals__[name] for name in names if name in function.__globals__}
    for module in [value for value in found.values() if _is_own_module(value)]:
        found |= {f"{module.__name__}.{name}": vars(module)[name] for name in attributes if name in vars(module)}
    return {name: value for name, value in found.items() if not _is_own_module(value)}


def _is_own_module(value: Any) -> bool:
    return isinstance(value, ModuleType) and value.__name__.startswith(_OWN)


def _constant(value: Any) -> bytes:
    """Return the bytes that tell a constant from every other. Raises TypeError for what is none."""
    if isinstance(value, np.ndarray):
        return f"{value.dtype}{value.shape}".encode() + value.tobytes()
    if isinstance(value, tuple):
        return repr(type(value)).encode() + b",".join(map(_constant, value))
    if isinstance(value, set | frozenset):  # each process has its own order
        return b"{" + b",".join(sorted(map(_constant, value))) + b"}"
    if isinstance(value, dict):
        return b";".join(_constant(key) + b":" + _constant(part) for key, part in value.items())
    if isinstance(value, type):
        return f"{value.__module__}.{value.__qualname__} {getattr(value, '_fields', '')}".encode()
    if isinstance(value, bool | int | float | complex | str | type(None) | np.generic | types.Type):
        return repr(value).encode()
    if isinstance(value, ModuleType | FunctionType | BuiltinFunctionType | np.ufunc):
        return value.__name__.encode()
    if isinstance(value, _Intrinsic):
        return f"{value._name}".encode()
    raise TypeError(f"{value!r}: kernels read numbers, arrays, tuples, tables and classes")


@cache
def _instructions() -> bytes:
    """Return a hash of the modules that make instructions for kernels."""
    digest = hashlib.sha256(np.__version__.encode())
    for name in _INSTRUCTIONS:
        digest.update(Path(__file__).with_name(f"{name}.py").read_bytes())
    return digest.digest()
