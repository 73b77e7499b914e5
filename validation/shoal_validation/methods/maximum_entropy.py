"""The density that is least committed of those with the moments of the runs (maximum entropy), and its quantiles.

Jaynes, Information theory and statistical mechanics, Physical Review 106, 1957; by Newton's method on the convex dual
(Mead and Papanicolaou, Maximum entropy in the problem of moments, Journal of Mathematical Physics 25, 1984).
"""

from __future__ import annotations

import numpy as np
from shoal.response.inputs import BoolArray
from shoal.response.methods.sampling import of_distributions
from shoal.response.polynomials import LEGENDRE
from shoal.response.statistics import QUANTILES
from shoal.response.study import Found, Study
from shoal.trajectory import Array

MOMENTS = 4
COUNT = 1024
"""Runs unless asked for otherwise."""
WIDTH = 5.0
"""The density ends so many standard deviations from the mean, farther out where runs lie."""
BEYOND = 1.1
POINTS = 256
ITERATIONS = 60
ACCURACY = 1e-10
HALVINGS = 20


def maximum_entropy(study: Study) -> Found:
    """Return quantiles from `degree` moments, else four, of `count` quasi-random runs. Raises InputError."""
    study.random_only("maximum-entropy")
    moments = study.degree or MOMENTS
    found = of_distributions(study, min(study.count or COUNT, study.runs.left))
    quantiles, missed = entropic_quantiles(study.runs.values, moments)
    why = f"densities of greatest entropy with {moments} moments of {found.why}"
    if missed.any():
        why += f"; for {int(missed.sum())} of {len(missed)} columns there is none, and runs tell"
    return Found(why, indices=found.indices, quantiles=quantiles)


def entropic_quantiles(values: Array, moments: int) -> tuple[Array, BoolArray]:
    """Quantiles, (levels, columns), of values, (runs, columns); columns in which Newton's method found no density."""
    mean, deviation = values.mean(axis=0), values.std(axis=0)
    varies = deviation > 1e-12 * np.maximum(np.abs(mean), 1e-300)
    far = np.max(np.abs(values - mean), axis=0)
    half = np.where(varies, np.maximum(WIDTH * deviation, BEYOND * far), 1.0)
    nodes, weights = np.polynomial.legendre.leggauss(POINTS)
    basis = LEGENDRE(nodes, moments)[:, 1:]
    scaled = (values - mean) / half
    wanted = np.stack([LEGENDRE(one, moments)[:, 1:].mean(axis=0) for one in scaled.T])
    powers, reached = _newton(basis, weights, wanted)
    density = np.exp(powers @ basis.T - (powers @ basis.T).max(axis=1, keepdims=True)) * weights
    passed = np.cumsum(density, axis=1) - 0.5 * density
    passed /= density.sum(axis=1, keepdims=True)
    found = np.stack([np.interp(QUANTILES, row, nodes) for row in passed], axis=1) * half + mean
    missed = varies & ~reached
    plain = np.quantile(values, QUANTILES, axis=0)
    return np.where(missed | ~varies, plain, found), missed


def _newton(basis: Array, weights: Array, wanted: Array) -> tuple[Array, BoolArray]:
    """Exponents, (columns, moments), that give these moments, and where they do.

    The dual log(integral of exp(l . phi)) - l . m is convex; its gradient is the error of the moments. All columns are
    one batch, each with the line search of Armijo, which `numerics.newton` does not have.
    """
    powers = np.zeros_like(wanted)
    value, gradient, hessian = _dual(basis, weights, wanted, powers)
    for _ in range(ITERATIONS):
        if np.all(np.abs(gradient).max(axis=1) < ACCURACY):
            break
        lifted = hessian + 1e-14 * np.eye(wanted.shape[1])
        step = -np.linalg.solve(lifted, gradient[..., None])[..., 0]
        slope = np.sum(step * gradient, axis=1)
        share = np.ones(len(wanted))
        for _ in range(HALVINGS):
            tried = powers + share[:, None] * step
            better = _dual(basis, weights, wanted, tried)[0] <= value + 1e-4 * share * slope + 1e-14
            if better.all():
                break
            share = np.where(better, share, 0.5 * share)
        powers = powers + share[:, None] * step
        value, gradient, hessian = _dual(basis, weights, wanted, powers)
    return powers, np.asarray(np.abs(gradient).max(axis=1) < 1e-6)


def _dual(basis: Array, weights: Array, wanted: Array, powers: Array) -> tuple[Array, Array, Array]:
    exponent = powers @ basis.T
    top = exponent.max(axis=1, keepdims=True)
    density = np.exp(exponent - top) * weights
    whole = density.sum(axis=1)
    density /= whole[:, None]
    mean = density @ basis
    second = np.einsum("cp,pi,pj->cij", density, basis, basis, optimize=True)
    value = np.log(whole) + top[:, 0] - np.sum(powers * wanted, axis=1)
    return value, mean - wanted, second - mean[:, :, None] * mean[:, None]
