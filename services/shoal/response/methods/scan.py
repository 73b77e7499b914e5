"""The scanning method: every point of a grid over the box (the "exact" reference of the literature)."""

from __future__ import annotations

from itertools import product

import numpy as np

from shoal.response.study import Found, Study


def scan(study: Study) -> Found:
    """As many places along each axis as `degree` + 1 says, or as the runs allow (at most 65). Raises InputError."""
    study.intervals_only("scan")
    parameters = len(study.inputs)
    most = int(study.runs.left ** (1 / parameters) + 1e-9)
    places = study.degree + 1 if study.degree else max(2, min(65, most))
    study.runs(np.array(list(product(np.linspace(-1, 1, places), repeat=parameters))))
    return Found(f"a grid of {places} places along each of {parameters} axes")
