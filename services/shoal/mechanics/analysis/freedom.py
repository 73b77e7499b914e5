"""The directions that the constraints leave free, and the constraint forces, in the metric of the mass matrix.

Small machines have an explicit basis of them (Golub and Van Loan, Matrix Computations, section 5.4), large ones the
sparse problem of `sparse_freedom`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import scipy.linalg

from shoal.mechanics.numerics.tile import Array

RANK = 1e-8
"""A combination of constraints, each of unit length, that is shorter than this depends on the others."""


class Freedom(NamedTuple):
    """The tangent space of the constraints at one state.

    basis: Z, with C_q Z = 0 and Z' M Z = I, (unknowns, degrees of freedom). rank: that of C_q. dependent: combinations
    w of constraints with w' C_q = 0, orthonormal after scaling each row of C_q to unit length, (constraints, defect).
    across, inverse: factors of the pseudo-inverse of C_q in that metric. states: of the user, which no constraint
    holds: the last columns of the basis are theirs.
    """

    basis: Array
    rank: int
    dependent: Array
    across: Array
    inverse: Array
    states: int = 0

    @property
    def motions(self) -> Array:
        """The basis of the directions in which the machine moves, without states of the user."""
        return self.basis[:, : self.degrees - self.states]

    @property
    def degrees(self) -> int:
        """Number of degrees of freedom."""
        return int(self.basis.shape[1])

    def split(self, force: Array) -> tuple[Array, Array]:
        """Return the acceleration that the constraints leave of a force, and the multipliers.

        These are the lambda of least norm for which Q - C_q' lambda is smallest in the metric of M^-1.
        """
        return self.basis @ (self.basis.T @ force), self.multipliers(force)

    def multipliers(self, force: Array) -> Array:
        """Return the multipliers alone."""
        return np.asarray(self.inverse @ (self.across.T @ force))

    def shift(self, gap: Array) -> Array:
        """The smallest d (metric of M) with C_q d = gap, as far as C_q reaches."""
        return np.asarray(self.across @ (self.inverse.T @ gap))

    def step(self, stiffness: Any, force: Array, damping: float = 0.0) -> Array:
        """Return the displacement d along the free directions with Z' (K + damping M) d = Z' force.

        Raises LinAlgError where it is not unique.
        """
        reduced = self.basis.T @ (stiffness @ self.basis)
        return np.asarray(self.basis @ np.linalg.solve(reduced + damping * np.eye(len(reduced)), self.basis.T @ force))

    def anywhere(self) -> Array:
        """Return a fixed combination of all free directions, long enough to leave a singular position."""
        return np.asarray(self.basis @ np.cos(1.0 + np.arange(self.degrees)))


class Metric:
    """The mass matrix, factored once. states: of the user, which are the last unknowns."""

    def __init__(self, mass: Any, states: int = 0) -> None:
        self.states = states
        self._lower = np.linalg.cholesky(np.asarray(mass.toarray()))
        n = len(self._lower)
        basis = scipy.linalg.solve_triangular(self._lower, np.eye(n), lower=True, trans="T")
        self._whole = Freedom(basis, 0, np.zeros((0, 0)), np.zeros((n, 0)), np.zeros((0, 0)), states)

    def size(self, force: Array) -> float:
        """The norm of a generalised force in the metric of M^-1 [kg^1/2 m/s^2]."""
        return float(np.linalg.norm(scipy.linalg.solve_triangular(self._lower, force, lower=True)))

    def freedom(self, jacobian: Any) -> Freedom:
        """The tangent space of the constraints with the Jacobian C_q (sparse)."""
        lower, count = self._lower, jacobian.shape[0]
        if count == 0:
            return self._whole
        rows = scipy.linalg.solve_triangular(lower, jacobian.toarray().T, lower=True)
        lengths = np.linalg.norm(rows, axis=0)
        scale = np.divide(1.0, lengths, out=np.ones_like(lengths), where=lengths > 0)
        moving = len(rows) - self.states
        left, sizes, right = np.linalg.svd((rows * scale)[:moving])
        left = scipy.linalg.block_diag(left, np.eye(self.states)) if self.states else left
        rank = int(np.sum(sizes > RANK))
        back = scipy.linalg.solve_triangular(lower, left, lower=True, trans="T")
        inverse = scale[:, None] * (right[:rank].T / sizes[:rank])
        dependent = scale[:, None] * right[rank:].T
        return Freedom(back[:, rank:], rank, dependent, back[:, :rank], inverse, self.states)
