"""What Numba need not do before it is asked to.

Who only loads kernels that were compiled earlier does not compile: half a second that a command need not wait for. All
of it is Numba's private interface, of the one version that the package depends on.
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
def put_off() -> None:
    """Let Numba do later what compiling needs, and most runs do not."""
    _put_off_blas()
    caching.Cache.load_overload = _load
    JITCodeLibrary._unserialize = classmethod(_unserialize)
    JITCodeLibrary._get_module_for_linking = _module_for_linking
    JITCodeLibrary.get_pointer_to_function = _pointer_to_function


def _put_off_blas() -> None:
    """Let Numba believe, until a kernel wants linear algebra, that scipy has it.

    When its `arraymath` is imported, as many a kernel wants it, Numba looks whether `scipy.linalg` is there, by
    importing it: a sixth of a second, for kernels that multiply no matrices. It is there, as Shoal depends on scipy;
    whoever compiles `a @ b` or `np.linalg` makes Numba look then.
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
    """`Cache.load_overload`, which first has all of Numba's own functions registered.

    Who compiles needs them, and has it done then. Machine code needs the runtime only.
    """
    if not self._py_func.__module__.startswith(_OWN):
        return _numbas_load(self, sig, context)
    rtsys.initialize(context)
    with self._guard_against_spurious_io_errors():
        return self._load_overload(sig, context)


_numbas_module_for_linking = JITCodeLibrary._get_module_for_linking
_numbas_pointer_to_function = JITCodeLibrary.get_pointer_to_function


def _unserialize(cls: Any, codegen: Any, state: Any) -> Any:
    """`JITCodeLibrary._unserialize`, which also parses the code that others are compiled with, beside machine code."""
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
    """`JITCodeLibrary._get_module_for_linking`: somebody is compiled with it."""
    if (data := self.__dict__.pop("unparsed", None)) is not None:
        self._shared_module = llvm.parse_bitcode(data[1])
        self._codegen._engine._load_defined_symbols(self._shared_module)
    return _numbas_module_for_linking(self)


def _pointer_to_function(self: Any, name: str) -> Any:
    """`JITCodeLibrary.get_pointer_to_function`, which knows the names of what was parsed only."""
    if "unparsed" in self.__dict__ and name.encode() + b"\0" in self.unparsed[0]:
        self._codegen._engine._defined_symbols.add(name)
    return _numbas_pointer_to_function(self, name)
