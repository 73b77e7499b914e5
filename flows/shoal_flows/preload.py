"""Imported once by the process that forks the workers, so that they begin with everything loaded and compiled."""

from __future__ import annotations

import sys

import matplotlib.figure  # noqa: F401 - to have it loaded
import shoal.engines.compare
import shoal.identification  # noqa: F401
from shoal.mechanics.warm import warm

warm(("leapfrog",), lambda line: print(line, file=sys.stderr, flush=True), every=False)  # noqa: T201 - for who waits
