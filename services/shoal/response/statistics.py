"""Statistics of distributions of answers: moments, quantiles and Sobol's indices, with their errors.

Sobol's indices by Jansen's estimator: Jansen, Analysis of variance designs for model output, Computer Physics
Communications 117, 1999; Saltelli et al., Variance based sensitivity analysis of model output, 2010, table 2 (c, f).

Errors of the moments of an expansion: what is left out of a fit says how much single runs are off. It says nothing of
tails that runs do not reach, nor of a standard deviation that a smooth polynomial loses. Half of the runs know less of
both than all: the differences between expansions of either half and of all estimate what is missing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy import special
from scipy.stats import qmc

from shoal.response.expansion import Expansion
from shoal.response.inputs import BoolArray, Inputs, inside
from shoal.response.study import Study, TransformedMoments, share_of
from shoal.trajectory import Array

CONFIDENCE = float(special.ndtri(0.975))
"""Standard deviations within which a normal variable lies with 95 % probability."""
QUANTILES = 0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99
"""Levels of the quantiles that are reported."""
DRAWN = 2**14
"""Places at which an expansion is evaluated for quantiles."""
NOTHING = 1e-9
"""A deviation below this share of the largest of its group has no Sobol indices."""


@dataclass(frozen=True, eq=False)
class Statistics:
    """mean, std: (columns,); quantiles: (quantiles, columns); first, total: Sobol's indices, (parameters, columns), nan
    where nothing varies or nothing is known; error, std_error: within which mean and std lie with 95 % confidence
    """

    mean: Array
    std: Array
    quantiles: Array
    first: Array
    total: Array
    error: Array
    std_error: Array


def of_expansion(found: Expansion, inputs: Inputs, error: Array | None, runs: int, seed: int) -> Statistics:
    """Return the statistics of a polynomial chaos; error: its own at runs it had not seen, (columns,)."""
    variance = found.variance
    first = np.full((len(inputs), len(variance)), np.nan)
    total = first.copy()
    varies = variance > 0
    if not inputs.correlations:
        squares = found.coefficients**2
        for k in range(len(inputs)):
            involved = found.terms[:, k] > 0
            alone = involved & (np.delete(found.terms, k, axis=1).sum(axis=1) == 0)
            first[k, varies] = squares[alone].sum(axis=0)[varies] / variance[varies]
            total[k, varies] = squares[involved].sum(axis=0)[varies] / variance[varies]
    quantiles = np.empty((len(QUANTILES), len(variance)))
    places = inputs.basis(inputs.sobol(DRAWN, seed + 1), found.terms)
    block = 256
    for k in range(0, len(variance), block):
        quantiles[:, k : k + block] = np.quantile(places @ found.coefficients[:, k : k + block], QUANTILES, axis=0)
    unknown = np.full(len(variance), np.nan)
    known = unknown if error is None else CONFIDENCE * error / np.sqrt(runs)
    deviation = unknown
    if error is not None and found.squares is not None:
        # What is not explained is missing in the deviation as a whole, and what is explained scatters.
        missing = share_of(error**2, 2 * np.sqrt(variance))
        deviation = CONFIDENCE * np.hypot(np.maximum(found.squares, error) / np.sqrt(runs), missing)
    return Statistics(found.mean, np.sqrt(variance), quantiles, first, total, known, deviation)


def of_runs(values: Array, indices: Array | None, parameters: int) -> Statistics:
    """Return the statistics of runs drawn from the distributions; indices: Sobol's, (2, parameters, columns)."""
    # Runs for indices share their parameters with others.
    independent = len(values) if indices is None else 2 * len(values) / (parameters + 2)
    unknown = np.full((2, parameters, values.shape[1]), np.nan)
    first, total = unknown if indices is None else indices
    deviation = values.std(axis=0, ddof=1) if len(values) > 1 else np.full(values.shape[1], np.nan)
    squares = ((values - values.mean(axis=0)) ** 2).std(axis=0)
    off = share_of(squares, 2 * deviation) / np.sqrt(independent)
    return Statistics(
        values.mean(axis=0),
        deviation,
        np.quantile(values, QUANTILES, axis=0),
        first,
        total,
        CONFIDENCE * deviation / np.sqrt(independent),
        CONFIDENCE * off,
    )


def either(first: BoolArray, one: Statistics, other: Statistics) -> Statistics:
    """The one in some columns, the other elsewhere."""
    chosen = {name: np.where(first, getattr(one, name), of) for name, of in vars(other).items()}
    return Statistics(**chosen)


def masked(found: Statistics, scale: Array) -> Statistics:
    """Return statistics without indices where the deviation is negligible; scale: the largest deviation, (columns,)."""
    nothing = (scale == 0) | ~(found.std > NOTHING * scale)
    first, total = found.first.copy(), found.total.copy()
    first[:, nothing] = total[:, nothing] = np.nan
    return replace(found, first=first, total=total)


def designs(inputs: Inputs, base: int, seed: int) -> Array:
    """Germs of A, of B and of A with each parameter of B, (parameters + 2) times `base`, (places, parameters)."""
    parameters = len(inputs)
    x = inside(qmc.Sobol(2 * parameters, rng=seed).random(base))
    one, other = x[:, :parameters], x[:, parameters:]
    found = [one, other]
    for k in range(parameters):
        mixed = one.copy()
        mixed[:, k] = other[:, k]
        found.append(mixed)
    return inputs.quantiles(np.concatenate(found))


def jansen(values: Array, parameters: int) -> Array:
    """First and total indices, (2, parameters, columns), of the answers at `designs`, (places, columns)."""
    blocks = values.reshape(parameters + 2, len(values) // (parameters + 2), -1)
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


HALVES = 2.0
"""Factor on the difference of a half from all: 1 / (sqrt(2) - 1) = 2.4 if errors fall with the root of the runs; those
of expansions fall faster."""


def moment_errors(
    study: Study, found: TransformedMoments, fitted: Callable[[Study], TransformedMoments]
) -> tuple[Array, Array]:
    """Return the 95 % confidence errors of mean and std, (columns,) each; fitted: the expansion of fewer runs."""
    made, std, left_out = len(study.runs.xi), np.sqrt(found.variance), found.left_out
    squares = np.maximum(found.squares, left_out)
    missing = share_of(left_out**2, 2 * std)
    scatter = CONFIDENCE * np.array([left_out / np.sqrt(made), np.hypot(squares / np.sqrt(made), missing)])
    apart, first = np.zeros_like(scatter), np.arange(made) < made // 2
    for half in (first, ~first):
        part = fitted(replace(study, runs=study.runs.part(half)))
        apart = np.maximum(apart, np.abs([part.mean - found.mean, np.sqrt(part.variance) - std]))
    mean, deviation = np.hypot(scatter, HALVES * apart)
    return mean, deviation
