"""Sampling without a surrogate: random (Monte Carlo), or quasi-random, from which Sobol's indices follow."""

from __future__ import annotations

import numpy as np

from shoal.response.statistics import designs, jansen
from shoal.response.study import Found, Study

COUNT = 1024
"""Runs unless asked for otherwise."""


def monte_carlo(study: Study) -> Found:
    """`count` independent runs."""
    count = min(study.count or COUNT, study.runs.left)
    study.runs(study.inputs.drawn(count, study.seed))
    return Found(f"{count} random runs")


def sobol(study: Study) -> Found:
    """`count` quasi-random runs; for random parameters they are shared out over what the indices need."""
    count, inputs = min(study.count or COUNT, study.runs.left), study.inputs
    if inputs.random.all():
        return of_distributions(study, count)
    study.runs.all(inputs.sobol(count, study.seed))
    return Found(f"{count} quasi-random runs")


def of_distributions(study: Study, count: int) -> Found:
    """Quasi-random runs A, B and, for each parameter, A with that parameter of B; the indices that follow.

    Parameters that correlate have no such indices, and all runs are of one sequence.
    """
    inputs, parameters = study.inputs, len(study.inputs)
    if inputs.correlations:
        study.runs.all(inputs.sobol(count, study.seed))
        return Found(f"{count} quasi-random runs")
    base = 2 ** max(3, int(np.log2(max(count // (parameters + 2), 8))))
    xi = designs(inputs, base, study.seed)
    total, failed = len(xi), study.runs.failed
    made = study.runs.all(xi)
    if study.runs.failed > failed:
        return Found(f"{made} quasi-random runs; some failed, so that there are no indices")
    return Found(f"{made} quasi-random runs", indices=jansen(study.runs.values[-total:], parameters))
