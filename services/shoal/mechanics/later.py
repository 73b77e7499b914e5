"""What Numba need not import before it is asked for."""

from __future__ import annotations

import sys
from functools import cache


@cache
def put_off_blas() -> None:
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
