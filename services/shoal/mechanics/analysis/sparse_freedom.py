"""The free directions of a large machine, without a basis of them: sparse saddle point problems of linear cost.

What the constraints leave of a force, and small motions, solve [H C_q'; C_q 0] [x; lambda] = [f; g] with H the mass
matrix or the shifted stiffness. It is factored as L D L' without pivoting, in an order of least fill in which every
multiplier comes after its coordinates; C_q' W C_q is added to H, which changes no solution and makes H definite where
it is so along the free directions (Benzi, Golub and Liesen, Numerical solution of saddle point problems, 2005,
section 3.3). The signs of D then count the eigenvalues below the shift (Sylvester).
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse
import scipy.sparse.linalg

from shoal.mechanics.analysis.freedom import RANK
from shoal.mechanics.numerics.tile import Array, Index

WIDE = 100
"""Rows of more entries than this fill no others: they are not added to H, nor looked at for the order."""
OUTWEIGHS = 10.0
"""What is added to H over H; as much as H itself would make a pivot of a coordinate that only inertia resists zero."""
SUSPECT = 1e-6
"""Pivot of a constraint over its square length, from which on it is looked at whether it depends on others,"""
SOFT = 1e-12
"""and by which the factors are kept finite where it does."""
REFINED = 1
"""Corrections of a solution by its residual; one leaves (SOFT / SUSPECT)^2 of what the factors are off by."""


class Saddle:
    """Factors of [H C_q'; C_q 0]. Raises LinAlgError where it is singular.

    place: of the coordinates in the order of elimination, (unknowns,). mass: M, with which C_q' W C_q is added to H,
    unless H is definite. soft: taken from the diagonal of the multipliers while factoring, (constraints,).
    """

    def __init__(
        self, matrix: Any, jacobian: Any, place: Index, *, mass: Any = None, soft: Array | None = None
    ) -> None:
        self._matrix, self._jacobian = matrix, jacobian
        whole = matrix
        if count := jacobian.shape[0]:
            corner = scipy.sparse.diags_array(np.zeros(count) if soft is None else -soft)
            if mass is not None:
                weights = scipy.sparse.diags_array(_weights(matrix, mass, jacobian))
                whole = whole + jacobian.T @ weights @ jacobian
            whole = scipy.sparse.block_array([[whole, jacobian.T], [jacobian, corner]], format="csc")
        self._order = order = _after(jacobian, place)
        try:
            self._factors = scipy.sparse.linalg.splu(
                scipy.sparse.csc_array(whole[order][:, order]),
                permc_spec="NATURAL",
                diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            )
        except RuntimeError as error:
            raise np.linalg.LinAlgError(str(error)) from None

    @cached_property
    def pivots(self) -> Array:
        """The diagonal of D, of the coordinates and the multipliers, (unknowns + constraints,)."""
        found = np.empty(len(self._order))
        found[self._order] = self._factors.U.diagonal()[self._factors.perm_c]
        return found

    @property
    def below(self) -> int:
        """Number of negative eigenvalues of H along the free directions."""
        return int(np.sum(self.pivots < 0) - self._jacobian.shape[0])

    def solve(self, force: Array, gap: Array | None = None, refined: int = REFINED) -> tuple[Array, Array]:
        """Return x and lambda with H x + C_q' lambda = force and C_q x = gap (default: 0).

        refined: corrections by the residual
        """
        rows, n = self._jacobian, len(force)
        gap = np.zeros(rows.shape[0]) if gap is None else gap
        x, multipliers = np.zeros(n), np.zeros(len(gap))
        for _ in range(1 + refined):
            left = np.concatenate([force - self._matrix @ x - rows.T @ multipliers, gap - rows @ x])
            found = np.empty_like(left)
            found[self._order] = self._factors.solve(left[self._order])
            x, multipliers = x + found[:n], multipliers + found[n:]
        if not np.all(np.isfinite(x)):
            raise np.linalg.LinAlgError("the factors are singular")
        return x, multipliers


def _weights(matrix: Any, mass: Any, jacobian: Any) -> Array:
    """Weights W of the constraints with which C_q' W C_q outweighs the matrix, (constraints,).

    A coordinate that nothing but a constraint holds, as a director along itself, takes the stiffness over the mass of
    those that it shares constraints with.
    """
    inertia, pattern = mass.diagonal(), jacobian.copy()
    pattern.data[:] = 1.0
    squares = (pattern.multiply(np.abs(matrix.diagonal()) / inertia)).max(axis=1)
    squares = pattern.T.multiply(np.ravel(squares.toarray())).max(axis=1)
    stiff = np.ravel(pattern.multiply(inertia * np.ravel(squares.toarray())).max(axis=1).toarray())
    lengths = np.ravel(jacobian.multiply(jacobian).sum(axis=1))
    weights = np.divide(OUTWEIGHS * stiff, lengths, out=np.zeros_like(lengths), where=lengths > 0)
    return np.asarray(weights * (np.diff(jacobian.indptr) <= WIDE))


def _after(jacobian: Any, place: Index) -> Index:
    """Coordinates and multipliers in the order of elimination, every multiplier after its last coordinate."""
    n, m = len(place), jacobian.shape[0]
    last = np.zeros(m, dtype=place.dtype)
    np.maximum.at(last, np.repeat(np.arange(m), np.diff(jacobian.indptr)), place[jacobian.indices])
    return np.lexsort([np.repeat([0, 1], [n, m]), np.concatenate([place, last])])


class SparseFreedom:
    """The tangent space of the constraints at one state; see `freedom.Freedom`, which has the same methods.

    dependent: as there, but for the lengths, which are those in the metric of the diagonal of M
    """

    def __init__(self, mass: Any, jacobian: Any, place: Index) -> None:
        self.mass, self._jacobian, self._place = mass, scipy.sparse.csr_array(jacobian), place
        m = self._jacobian.shape[0]
        squares = self._jacobian.multiply(self._jacobian) @ (1.0 / mass.diagonal())
        self._lengths = np.sqrt(np.where(squares > 0, squares, 1.0))
        self._kept = np.arange(m)
        self._saddle = self._of_mass(self._kept, SOFT * self._lengths**2)
        ratio = -self._saddle.pivots[len(place) :] / self._lengths**2
        self.dependent = np.zeros((m, 0))
        if np.any(ratio < SUSPECT):
            self._leave_out(np.flatnonzero(ratio < SUSPECT))

    def _leave_out(self, suspects: Index) -> None:
        """Leave out those of some constraints that depend on the others, to the rank that `RANK` says."""
        m = self._jacobian.shape[0]
        sure = np.setdiff1d(np.arange(m), suspects)
        own = self._of_mass(sure)
        rests, taken, combinations, left_out = list[Array](), list[Array](), list[Array](), list[int]()
        for k in suspects:
            row = self._jacobian[[k]].toarray().ravel() / self._lengths[k]
            rest, share = own.solve(row)
            combination = np.zeros(m)
            combination[k], combination[sure] = 1.0 / self._lengths[k], -share
            for _ in range(2):
                for other, its in zip(rests, taken, strict=True):
                    part = float(other @ (self.mass @ rest))
                    rest, combination = rest - part * other, combination - part * its
            size = float(np.sqrt(max(0.0, rest @ (self.mass @ rest))))
            if size > RANK:
                rests.append(rest / size)
                taken.append(combination / size)
            else:
                combinations.append(combination)
                left_out.append(k)
        self._kept = np.setdiff1d(np.arange(m), left_out)
        self._saddle = self._of_mass(self._kept)
        if combinations:
            scaled = np.linalg.qr(self._lengths[:, None] * np.stack(combinations, axis=1))[0]
            self.dependent = scaled / self._lengths[:, None]

    def _of_mass(self, kept: Index, soft: Array | None = None) -> Saddle:
        return Saddle(self.mass, self._jacobian[kept], self._place, soft=soft)

    @property
    def rank(self) -> int:
        """Rank of C_q."""
        return len(self._kept)

    @property
    def degrees(self) -> int:
        """Number of degrees of freedom."""
        return len(self._place) - self.rank

    def split(self, force: Array) -> tuple[Array, Array]:
        """Return the acceleration that the constraints leave of a force, and the multipliers."""
        acceleration, found = self._saddle.solve(force)
        multipliers = np.zeros(self._jacobian.shape[0])
        multipliers[self._kept] = found
        if self.dependent.shape[1]:
            unit = self._lengths[:, None] * self.dependent
            multipliers -= self.dependent @ (unit.T @ (self._lengths * multipliers))
        return acceleration, multipliers

    def shift(self, gap: Array) -> Array:
        """The smallest d (metric of M) with C_q d = gap, but for constraints that depend on others."""
        return self._saddle.solve(np.zeros(len(self._place)), gap[self._kept])[0]

    def step(self, stiffness: Any, force: Array, damping: float = 0.0) -> Array:
        """Return the displacement d along the free directions with Z' (K + damping M) d = Z' force."""
        return self.factored(stiffness + damping * self.mass if damping else stiffness).solve(force)[0]

    def anywhere(self) -> Array:
        """Return a fixed combination of all free directions."""
        return self.split(np.cos(1.0 + np.arange(len(self._place))))[0]

    def factored(self, matrix: Any) -> Saddle:
        """Return the factors of a symmetric matrix along the free directions. Raises LinAlgError."""
        return Saddle(matrix, self._jacobian[self._kept], self._place, mass=self.mass)


class SparseMetric:
    """The mass matrix of a large machine; pattern: a matrix with the entries of its stiffness."""

    def __init__(self, mass: Any, pattern: Any) -> None:
        self.mass = scipy.sparse.csc_array(mass)
        self._pattern = abs(self.mass) + abs(pattern)
        self._factors = _symmetric(self.mass)
        self._ordered: tuple[Array, Array, Index] | None = None

    def size(self, force: Array) -> float:
        """The norm of a generalised force in the metric of M^-1 [kg^1/2 m/s^2]."""
        return float(np.sqrt(max(0.0, float(force @ self._factors.solve(force)))))

    def freedom(self, jacobian: Any) -> SparseFreedom:
        """The tangent space of the constraints with the Jacobian C_q."""
        rows = scipy.sparse.csr_array(jacobian)
        return SparseFreedom(self.mass, rows, self._place(rows))

    def _place(self, rows: Any) -> Index:
        """Place of every coordinate in an order of least fill, worked out anew where the constraints' pattern is."""
        kept = self._ordered
        if kept is None or not (np.array_equal(kept[0], rows.indptr) and np.array_equal(kept[1], rows.indices)):
            narrow = rows[np.diff(rows.indptr) <= WIDE].copy()
            narrow.data[:] = 1.0
            whole = scipy.sparse.csc_array(self._pattern + narrow.T @ narrow)
            whole.data[:] = -1.0
            degree = -np.asarray(whole.sum(axis=0)).ravel()
            place = np.asarray(_symmetric(whole + scipy.sparse.diags_array(2.0 * degree + 1.0)).perm_c)
            self._ordered = kept = rows.indptr.copy(), rows.indices.copy(), place
        return kept[2]


def _symmetric(matrix: Any) -> Any:
    """Factors of a positive definite matrix, in an order of least fill (minimum degree)."""
    return scipy.sparse.linalg.splu(
        scipy.sparse.csc_array(matrix),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
