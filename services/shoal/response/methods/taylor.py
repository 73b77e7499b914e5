"""Taylor's series about the centre, by central differences (interval perturbation: Qiu and Wang, 2003)."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from shoal.response.expansion import fit
from shoal.response.polynomials import total_degree
from shoal.response.study import Found, Study

STEP = 0.05
"""Of the differences, as a share of half the interval."""


def taylor(study: Study) -> Found:
    """First order (2 p + 1 runs), or `degree` 2 (p (p + 1) / 2 + p + 1 runs more or less). Raises InputError."""
    study.intervals_only("taylor")
    parameters, order = len(study.inputs), min(study.degree or 1, 2)
    unit = STEP * np.eye(parameters)
    places = [np.zeros((1, parameters)), unit, -unit]
    if order == 2:
        places += [unit[i] + unit[j] for i, j in combinations(range(parameters), 2)]
    study.runs(np.vstack(places))
    runs = study.runs
    return Found(
        f"Taylor's series of order {order} about the centre, whose rest is not known",
        fit(study.inputs, runs.germs, runs.values, total_degree(parameters, order)),
    )
