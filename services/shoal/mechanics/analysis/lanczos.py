"""The slowest small motions of a large machine, by shift-invert Lanczos on the constrained pencil.

(K - s M)^-1 along the free directions has the slowest motions as its largest eigenvalues (Ericsson and Ruhe 1980;
ARPACK). The shift lies below all of them, by about the slowest one that is not zero. Sylvester's law of inertia counts
the eigenvalues below a shift (Parlett, The Symmetric Eigenvalue Problem, section 3.3), so that none of equal ones, as
of a round shaft, is missed. The values are then those of the stiffness in the subspace found (`small_motions.graded`).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse.linalg

from shoal.mechanics.analysis.small_motions import (
    LEAST,
    TENSION,
    BoundedMatrix,
    Spectrum,
    by_part,
    graded,
    round_off,
)
from shoal.mechanics.analysis.sparse_freedom import Saddle, SparseFreedom
from shoal.mechanics.numerics.tile import Array, Index

SPARE = 4
"""More motions are sought than asked for by so many: the last ones are the least accurate."""
KRYLOV = 20
"""Vectors of the Krylov space beyond twice the motions sought, the choice of ARPACK."""
ROUNDS = 12
"""Steps of the power method for the stiffest motion, of which the order of magnitude counts."""
SAFE = 100.0
"""The first shift over what round-off may be worth in the squared frequencies."""
NEAR = 100.0
"""Motions that nothing holds cost the others as many digits as the slowest of these is faster than the shift."""
APART = 1e-6
"""Squared frequencies that differ by a smaller part than this are not separated by another shift."""
FEW = 4
"""A machine of fewer degrees of freedom than so many times the motions sought is solved for all of them."""


def lowest(free: SparseFreedom, stiffness: BoundedMatrix, mass: Any, parts: Index, least: int) -> Spectrum:
    """Return the lowest part of the spectrum of a symmetric stiffness.

    It has at least so many motions, all with negative values, and one that is told from zero, as far as there are
    those. mass, parts: see `small_motions.spectrum`
    """
    matrix, random = stiffness.matrix, np.random.default_rng(0)
    stiffest = _stiffest(free, matrix, mass, parts, random)
    shift = -_safe(stiffest)
    count, shifted = least, False
    while True:
        inverse = free.factored(matrix - shift * mass)
        if below := inverse.below:
            shift, count = 10.0 * shift, max(count, least + below)
            continue
        values, shapes = _above(free, inverse, matrix, mass, shift, min(count, free.degrees), random)
        levels = round_off(stiffness, shapes, mass, parts, stiffest)
        told = np.abs(values)[np.abs(values) > levels]
        if not told.size and len(values) < free.degrees:
            count *= 2
        elif told.size < len(values) and -shift < np.min(told, initial=np.inf) / NEAR and not shifted:
            shift, shifted = -float(np.min(told)), True
        else:
            return Spectrum(values, shapes, levels)


def is_firm(free: SparseFreedom, stiffness: BoundedMatrix, mass: Any, parts: Index) -> bool:
    """Return whether all squared frequencies are far above round-off, by one factorisation and no shapes.

    Where they are not, their own round-off decides (`lowest`).
    """
    stiffest = _stiffest(free, stiffness.matrix, mass, parts, np.random.default_rng(0))
    try:
        return free.factored(stiffness.matrix - _safe(stiffest) * mass).below == 0
    except np.linalg.LinAlgError:
        return False


def _safe(stiffest: Array) -> float:
    """Return a squared frequency far above round-off [rad^2/s^2]."""
    return max(SAFE * TENSION * float(np.max(stiffest, initial=0.0)), LEAST)


def _stiffest(free: SparseFreedom, matrix: Any, mass: Any, parts: Index, random: np.random.Generator) -> Array:
    """Return the largest squared frequency of every part of the machine, by the power method."""
    moves = free.split(random.normal(size=matrix.shape[0]))[0]
    for _ in range(ROUNDS):
        moves = free.split(matrix @ moves)[0]
        sizes = np.sqrt(by_part(moves * (mass @ moves), parts))
        moves = moves / np.where(sizes > 0, sizes, 1.0)[parts]
    return np.abs(by_part(moves * (matrix @ moves), parts))


def _above(
    free: SparseFreedom, inverse: Saddle, matrix: Any, mass: Any, shift: float, count: int, random: np.random.Generator
) -> tuple[Array, Array]:
    """Return the lowest squared frequencies, none of which is below the shift, and the shapes with x' M x = 1."""
    n, sought = matrix.shape[0], count + SPARE
    if FEW * sought >= free.degrees:
        every = np.stack([free.split(force)[0] for force in random.normal(size=(free.degrees, n))], axis=1)
        return _ordered(matrix, mass, every)
    shapes = np.zeros((n, 0))
    while True:
        missing, known = sought - shapes.shape[1], shapes

        def apply(force: Array, known: Array = known) -> Array:
            move = inverse.solve(force, refined=0)[0]
            return np.asarray(move - known @ (known.T @ (mass @ move)))

        _, found = scipy.sparse.linalg.eigsh(
            matrix,
            missing,
            mass,
            sigma=shift,
            OPinv=scipy.sparse.linalg.LinearOperator((n, n), apply, dtype=float),
            v0=random.normal(size=n),
            ncv=min(2 * missing + KRYLOV, free.degrees - known.shape[1]),
        )
        values, shapes = _ordered(matrix, mass, np.hstack([known, found]))
        gaps = np.diff(values[count - 1 :]) > APART * (np.abs(values[count:]) - shift)
        if not np.any(gaps):
            return values[:count], shapes[:, :count]
        kept = count + int(np.argmax(gaps))
        lost = free.factored(matrix - 0.5 * (values[kept - 1] + values[kept]) * mass).below - kept
        if lost <= 0:
            return values[:kept], shapes[:, :kept]
        sought += lost


def _ordered(matrix: Any, mass: Any, shapes: Array) -> tuple[Array, Array]:
    """Return the values of a stiffness in a subspace, lowest first, and their shapes."""
    root = np.linalg.cholesky(shapes.T @ (mass @ shapes))
    basis = scipy.linalg.solve_triangular(root, shapes.T, lower=True).T
    values, modes = graded(matrix, basis)
    return values, basis @ modes
