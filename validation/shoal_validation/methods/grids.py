"""Runs on a grid (`scan`, the "exact" reference of the literature), and at the corners of the box (`vertices`).

Corners are exact where answers are monotonic (Dong and Shah 1987).
"""

from __future__ import annotations

from itertools import product

import numpy as np
from shoal.response.extremes import corners
from shoal.response.study import Found, Study

MOST = 65
"""Places along an axis, unless more are asked for: Clenshaw and Curtis's grid of level 6."""


def scan(study: Study) -> Found:
    """Run a grid of `degree` + 1 places along each axis, or as many as fit, at most `MOST`. Raises InputError."""
    study.intervals_only("scan")
    parameters = len(study.inputs)
    most = int(study.runs.left ** (1 / parameters) + 1e-9)
    places = study.degree + 1 if study.degree else max(2, min(MOST, most))
    study.runs(np.array(list(product(np.linspace(-1, 1, places), repeat=parameters))))
    return Found(f"a grid of {places} places along each of {parameters} axes")


def vertices(study: Study) -> Found:
    """Run the 2^p corners of the box and its centre. Raises InputError."""
    study.intervals_only("vertices")
    parameters = len(study.inputs)
    study.runs(np.concatenate([np.zeros((1, parameters)), corners(parameters)]))
    return Found(f"the {2**parameters} corners of the box and its centre")
