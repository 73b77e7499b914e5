"""Sampling: random (Monte Carlo) or quasi-random (Sobol's sequence), with Sobol's indices by Jansen's estimator.

Jansen, Analysis of variance designs for model output, Computer Physics Communications 117, 1999; Saltelli et al.,
Variance based sensitivity analysis of model output, 2010, table 2 (c, f).
"""

from __future__ import annotations

import numpy as np
from scipy.stats import qmc

from shoal.response.inputs import inside
from shoal.response.study import Found, Study
from shoal.trajectory import Array

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
    x = inside(qmc.Sobol(2 * parameters, rng=study.seed).random(base))
    one, other = x[:, :parameters], x[:, parameters:]
    designs = [one, other]
    for k in range(parameters):
        mixed = one.copy()
        mixed[:, k] = other[:, k]
        designs.append(mixed)
    total, failed = base * len(designs), study.runs.failed
    made = study.runs.all(inputs.germs(np.concatenate(designs)))
    if study.runs.failed > failed:
        return Found(f"{made} quasi-random runs; some failed, so that there are no indices")
    return Found(f"{made} quasi-random runs", indices=_jansen(study.runs.values[-total:], base, parameters))


def _jansen(values: Array, base: int, parameters: int) -> Array:
    blocks = values.reshape(parameters + 2, base, -1)
    one, other = blocks[0], blocks[1]
    variance = np.var(np.concatenate([one, other]), axis=0)
    found = np.full((2, parameters, values.shape[1]), np.nan)
    varies = variance > 0
    for k in range(parameters):
        mixed = blocks[2 + k]
        unexplained = 0.5 * np.mean((other - mixed) ** 2, axis=0)
        own = 0.5 * np.mean((one - mixed) ** 2, axis=0)
        found[0, k, varies] = 1 - unexplained[varies] / variance[varies]
        found[1, k, varies] = own[varies] / variance[varies]
    return found
