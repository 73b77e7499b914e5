"""Imported once by the process that forks the workers, so that they begin with everything loaded and compiled."""

from __future__ import annotations

import sys

import matplotlib.figure  # noqa: F401 - to have it loaded
import shoal.engines.compare
import shoal.identification  # noqa: F401
from shoal.errors import ShoalError
from shoal.mechanics.warm import warm

failure: ShoalError | None = None
"""Why the kernels could not be compiled: raised where a computation is asked for, as this process only forks."""
try:
    warm(("leapfrog",), lambda line: print(line, file=sys.stderr, flush=True), every=False)  # noqa: T201 - progress
except ShoalError as error:
    failure = error
