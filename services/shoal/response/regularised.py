"""Expansions of more terms than runs, held by how fast the coefficients of a smooth function fall.

The coefficient of a product of polynomials is taken for a normal variable. Its variance is a product over the
parameters in it: s r^(k - 1) / k! for the degree k, as those of exponentials fall, with the size s and the ratio r of
each parameter that make the runs most likely. That is a Gaussian process with a kernel for each parameter and their
products (Durrande, Ginsbourger, Roustant and Carraro, ANOVA kernels and RKHS of zero mean functions for model-based
sensitivity analysis, Journal of Multivariate Analysis 115, 2013). Errors at runs that are left out follow in closed
form (Rasmussen and Williams, Gaussian Processes for Machine Learning, 2006, section 5.4.2).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate

import numpy as np
from scipy.linalg import cho_solve, cholesky
from scipy.optimize import minimize
from scipy.special import gammaln

from shoal.response.expansion import Expansion, outermost, unexplained
from shoal.response.inputs import Inputs
from shoal.response.polynomials import Terms
from shoal.trajectory import Array

HIGHEST = 24
"""Degree in each parameter, at most."""
SIZES, RATIOS, NOISE = (-14.0, 6.0), (-7.0, 4.0), (-27.0, 0.0)
"""Logarithms within which the most likely values are sought; noise: what is left of the answers' variance."""
FIRST = -1.0, -1.0, -20.0
"""Logarithms of size, ratio and noise with which the search begins."""
STEPS = 80
"""Steps of the search (L-BFGS-B), at most."""
TOLD = 320
"""Runs to which the hyperparameters are fitted; all determine the coefficients."""
TERMS = 1500
"""Terms that are kept, those of the largest variances."""
NOTHING = 1e-5
"""Share of the deviation that all coefficients may have together that are left out."""


@dataclass(frozen=True)
class Decay:
    """Logarithms of the size and the ratio of every parameter, (parameters, 2), and of the noise."""

    parameters: Array
    noise: float

    def variances(self, degrees: tuple[int, ...]) -> list[Array]:
        """Return the variances of each parameter's coefficients from degree 1 up to these, (degrees,) each."""
        found = []
        for (size, ratio), degree in zip(self.parameters, degrees, strict=True):
            k = np.arange(degree)
            found.append(np.exp(size + k * ratio - gammaln(k + 2.0)))
        return found


def likeliest(inputs: Inputs, xi: Array, answers: Array, begun: Decay | None = None) -> Decay:
    """Return the maximum-likelihood decay of columns, (runs,) or (runs, columns), each with a size of its own.

    begun: where the search begins
    """
    count, some = len(inputs), slice(TOLD)
    y = answers[some].reshape(len(xi[some]), -1)
    bases, y = _bases(inputs, xi[some]), y - y.mean(axis=0)

    def unlikely(x: Array) -> tuple[float, Array]:
        return _unlikely(Decay(x[:-1].reshape(count, 2), float(x[-1])), bases, y)

    first = begun or Decay(np.tile(FIRST[:2], (count, 1)), FIRST[2])
    start = np.append(first.parameters.ravel(), first.noise)
    limits = [*[SIZES, RATIOS] * count, NOISE]
    found = minimize(unlikely, start, jac=True, method="L-BFGS-B", bounds=limits, options={"maxiter": STEPS}).x
    return Decay(found[:-1].reshape(count, 2), float(found[-1]))


def _bases(inputs: Inputs, xi: Array) -> list[Array]:
    """Polynomials of every parameter from degree 1, (runs, degrees) each."""
    degrees = inputs.highest(HIGHEST)
    return [inputs.polynomials(k, xi[:, k], degree)[:, 1:] for k, degree in enumerate(degrees)]


def _unlikely(decay: Decay, bases: list[Array], y: Array) -> tuple[float, Array]:
    """Twice the negative logarithm of the likelihood, but for a constant, and its slope; y: (runs, columns)."""
    (runs, columns), every = y.shape, decay.variances(tuple(basis.shape[1] for basis in bases))
    parts = [(basis * of) @ basis.T for basis, of in zip(bases, every, strict=True)]
    # Products of the factors before each parameter, and of those from it on.
    before = list(accumulate((1 + part for part in parts), np.multiply, initial=np.ones((runs, runs))))
    behind = list(accumulate((1 + part for part in parts[::-1]), np.multiply, initial=before[0]))[::-1]
    kernel = before[-1]
    middle = float(np.mean(np.diag(kernel)))
    noise = np.exp(decay.noise)
    try:
        factor = cholesky(kernel + noise * middle * np.eye(runs), lower=True)
    except np.linalg.LinAlgError:
        return 1e10, np.zeros(2 * len(bases) + 1)
    inverse = cho_solve((factor, True), np.eye(runs))
    weights = inverse @ y
    squares = np.maximum(np.sum(y * weights, axis=0), np.finfo(float).tiny)
    slope = columns * inverse - runs * (weights / squares) @ weights.T
    found, trace = np.empty((len(bases), 2)), np.trace(slope)
    for k, (basis, of) in enumerate(zip(bases, every, strict=True)):
        others = before[k] * behind[k + 1]
        there, part = slope * others, np.diag(others)
        for j, share in enumerate((of, of * np.arange(len(of)))):
            # The sum of slope times change, of all pairs of runs, and that of the noise.
            found[k, j] = np.sum((there @ basis) * basis * share)
            found[k, j] += noise * trace * np.mean(part * ((basis**2) @ share))
    value = runs * np.log(squares / runs).sum() + 2 * columns * np.log(np.diag(factor)).sum()
    return float(value), np.append(found, noise * middle * trace)


def regularised(inputs: Inputs, xi: Array, values: Array, decay: Decay) -> Expansion:
    """Return the expansion of all columns, (runs, columns), with coefficients of these variances."""
    terms, variances = _largest(inputs, decay)
    basis, mean = inputs.basis(xi, terms), values.mean(axis=0)
    kernel = (basis * variances) @ basis.T
    kernel += np.exp(decay.noise) * np.mean(np.diag(kernel)) * np.eye(len(xi))
    factor = cholesky(kernel, lower=True)
    inverse = cho_solve((factor, True), np.eye(len(xi)))
    weights = cho_solve((factor, True), values - mean)
    coefficients = variances[:, None] * (basis.T @ weights)
    coefficients[0] += mean
    missed = weights / np.diag(inverse)[:, None]
    left_out, squares = unexplained(values, missed)
    outer = outermost(inputs, xi)
    if outer.any():
        beyond = np.linalg.solve(inverse[np.ix_(outer, outer)], weights[outer])
        left_out = np.maximum(left_out, np.sqrt((beyond**2).sum(axis=0) / len(xi)))
    return Expansion(inputs, terms, coefficients, left_out, squares)


def _largest(inputs: Inputs, decay: Decay) -> tuple[Terms, Array]:
    """The terms with the largest variances, the constant first, and these, (terms,).

    A product of some parameters that is not among the largest of those has no larger successors.
    """
    terms, sizes = np.zeros((1, 0), dtype=np.int64), np.zeros(1)
    for of in decay.variances(inputs.highest(HIGHEST)):
        logarithms = np.append(0.0, np.log(np.maximum(of, 1e-300)))
        sums = (sizes[:, None] + logarithms).ravel()
        kept = np.argsort(-sums, kind="stable")[:TERMS]
        before, degree = np.divmod(kept, len(logarithms))
        terms, sizes = np.column_stack([terms[before], degree]), sums[kept]
    constant = ~terms.any(axis=1)
    terms = np.vstack([np.zeros((1, len(inputs)), dtype=np.int64), terms[~constant]])
    return terms, np.exp(np.append(0.0, sizes[~constant]))


def trimmed(found: Expansion) -> Expansion:
    """Return an expansion without terms that are negligible in every column; the constant stays."""
    shares = found.coefficients**2 / np.maximum(found.variance, 1e-300)
    kept = np.asarray((shares * len(shares) > NOTHING**2).any(axis=1))
    kept[0] = True
    lost = np.sqrt((found.coefficients[~kept] ** 2).sum(axis=0))
    return Expansion(
        found.inputs, found.terms[kept], found.coefficients[kept], np.hypot(found.left_out, lost), found.squares
    )
