"""The vertex method: the corners of the box and its centre; exact where answers are monotonic (Dong and Shah, 1987)."""

from __future__ import annotations

import numpy as np

from shoal.response.extremes import corners
from shoal.response.study import Found, Study


def vertices(study: Study) -> Found:
    """2^p + 1 runs. Raises InputError."""
    study.intervals_only("vertices")
    parameters = len(study.inputs)
    study.runs(np.concatenate([np.zeros((1, parameters)), corners(parameters)]))
    return Found(f"the {2**parameters} corners of the box and its centre")
