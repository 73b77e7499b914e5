"""What Numba need not import before it is asked for."""

from __future__ import annotations

import sys


def put_off_blas() -> None:
    """Let Numba believe, until a kernel wants linear algebra, that scipy has it.

    When it compiles or loads its first kernel, Numba looks whether `scipy.linalg` is there, by importing it: a sixth of
    a second, for kernels that multiply no matrices. It is there, as Shoal depends on scipy; whoever compiles `a @ b` or
    `np.linalg` makes Numba look then.
    """
    if "numba.np.arraymath" in sys.modules:
        return
    from numba.np import linalg

    look = getattr(linalg, "ensure_blas", None)
    if look is None:
        return
    linalg.ensure_blas = lambda: None
    try:
        import numba.np.arraymath  # noqa: F401 - looks for it on import
    finally:
        linalg.ensure_blas = look
