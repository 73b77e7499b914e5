"""The degree of an expansion, for every column that which foretells best what is left out of its fit."""

from __future__ import annotations

from collections.abc import Callable

from shoal.response.expansion import Expansion, fit
from shoal.response.polynomials import size, total_degree
from shoal.response.study import Study

HIGHEST = 20
WORSE = 2
"""Degrees in a row that no column gains by, after which no higher one is tried."""


def best(study: Study, share: float, judged: Callable[[Expansion], Expansion]) -> Expansion:
    """Of `degree`, or of each column's own among those that the runs carry: so many for every term, at least.

    judged: an expansion with what else is known of its error
    """
    runs, parameters = study.runs, len(study.inputs)
    highest = study.inputs.highest(HIGHEST)
    known: Expansion | None = None
    worse = 0
    for degree in [study.degree] if study.degree else range(1, HIGHEST + 1):
        if known is not None and share * size(parameters, degree) > len(runs.germs):
            break
        terms = total_degree(parameters, degree)
        found = judged(fit(study.inputs, runs.germs, runs.values, terms[(terms <= highest).all(axis=1)]))
        if known is None:
            known = found
            continue
        better = found.left_out < known.left_out
        known = found.where(better, known)
        worse = 0 if better.any() else worse + 1
        if worse == WORSE:
            break
    assert known is not None
    return known
