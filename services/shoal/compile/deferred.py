"""Deferred initialisation of Numba, for processes that only load kernels that were compiled earlier.

It saves a command half a second. Private names of the one version of Numba that the package depends on are replaced.
"""

from __future__ import annotations

import sys
from functools import cache
from typing import Any

import llvmlite.binding as llvm
from numba.core import caching
from numba.core.codegen import CPUCodeLibrary, JITCodeLibrary
from numba.core.runtime import rtsys

_OWN = "shoal."


@cache
def install() -> None:
    """Install: from now on Numba prepares for compilation when it first compiles."""
    _defer_blas()
    caching.Cache.load_overload = _load
    JITCodeLibrary._unserialize = classmethod(_unserialize)
    JITCodeLibrary._get_module_for_linking = _module_for_linking
    JITCodeLibrary.get_pointer_to_function = _pointer_to_function


def _defer_blas() -> None:
    """Let Numba import `scipy.linalg` when a kernel first uses linear algebra.

    Numba imports it together with its `arraymath`, to find out whether it exists: a sixth of a second, for kernels that
    multiply no matrices. It exists, as Shoal depends on scipy; compiling `a @ b` or `np.linalg` imports it then.
    """
    from numba.np import linalg

    look = getattr(linalg, "ensure_blas", None)
    if look is None:
        return

    def ensure_blas() -> None:
        asking = sys.modules.get("numba.np.arraymath")
        if asking is None or hasattr(asking, "_HAVE_BLAS"):  # else it is being imported
            look()

    linalg.ensure_blas = ensure_blas


_numbas_load = caching.Cache.load_overload


def _load(self: Any, sig: Any, context: Any) -> Any:
    """Replace `Cache.load_overload`, which first registers all of Numba's own functions.

    Compilation registers them when it needs them; machine code needs the runtime only.
    """
    if not self._py_func.__module__.startswith(_OWN):
        return _numbas_load(self, sig, context)
    rtsys.initialize(context)
    with self._guard_against_spurious_io_errors():
        return self._load_overload(sig, context)


_numbas_module_for_linking = JITCodeLibrary._get_module_for_linking
_numbas_pointer_to_function = JITCodeLibrary.get_pointer_to_function


def _unserialize(cls: Any, codegen: Any, state: Any) -> Any:
    """Replace `JITCodeLibrary._unserialize`, which parses the intermediate code along with the machine code."""
    name, kind, data = state
    if kind != "object":
        return CPUCodeLibrary._unserialize.__func__(cls, codegen, state)
    library = codegen.create_library(name)
    library.enable_object_caching()
    library._set_compiled_object(data[0])
    library._finalize_final_module()
    library.unparsed = data
    return library


def _module_for_linking(self: Any) -> Any:
    """Replace `JITCodeLibrary._get_module_for_linking`: parse the intermediate code when a caller needs it."""
    if (data := self.__dict__.pop("unparsed", None)) is not None:
        self._shared_module = llvm.parse_bitcode(data[1])
        self._codegen._engine._load_defined_symbols(self._shared_module)
    return _numbas_module_for_linking(self)


def _pointer_to_function(self: Any, name: str) -> Any:
    """Replace `JITCodeLibrary.get_pointer_to_function`, which knows the names of parsed code only."""
    if "unparsed" in self.__dict__ and name.encode() + b"\0" in self.unparsed[0]:
        self._codegen._engine._defined_symbols.add(name)
    return _numbas_pointer_to_function(self, name)
