"""Joints in space that hold what others hold already."""

from __future__ import annotations

import numpy as np

from shoal.mechanics.assembly.space.placement import place_in_space
from shoal.mechanics.assembly.space.start import slopes
from shoal.mechanics.assembly.terms import Term
from shoal.mechanics.numerics.tile import Array
from shoal.scene import Scene
from shoal.scene.joints import places

DEPENDENT = 1e-7
"""Singular values of the rows of unit length below this are of rows that depend on others."""
SHARE = 1e-3
"""Part in a dependence from which a row counts as one of those that make it."""
DENSE = 150
"""Up to so many constraints all singular values are found."""
SOUGHT, ROUNDS = 24, 4
"""Of more, so many of the smallest are sought, by so many inverse iterations."""


def redundant(scene: Scene, q: Array) -> tuple[str, ...]:
    """Joints that hold what others hold already at these coordinates, (unknowns,): they share a dependent row."""
    terms = [one for one in place_in_space(scene).terms.held if isinstance(one, Term)]
    if not terms:
        return ()
    share = _shares(terms, q)
    guilty = {term.name for term, part in zip(terms, share, strict=True) if part > SHARE}
    return tuple(
        name for name, joint in scene.joints.items() if name in guilty or guilty & {side.body for side in places(joint)}
    )


def _shares(terms: list[Term], q: Array) -> Array:
    """The part of every row in all dependences, (constraints,)."""
    import scipy.sparse

    parts = [(row, *slope) for row, term in enumerate(terms) for slope in slopes(term, q[:, None], 0)]
    rows, columns, values = (np.array(one) for one in zip(*parts, strict=True))
    slope = scipy.sparse.csr_array((values, (rows, columns)), shape=(len(terms), len(q)))
    length = np.sqrt(np.asarray((slope * slope).sum(axis=1)).ravel()) + 1e-300
    slope = scipy.sparse.diags_array(1 / length) @ slope
    if len(terms) > DENSE:
        vectors, sizes = _smallest(slope @ slope.T)
        if not np.all(sizes < DEPENDENT):
            return np.asarray(np.linalg.norm(vectors[:, sizes < DEPENDENT], axis=1))
    left, size, _ = np.linalg.svd(slope.toarray())
    return np.asarray(np.linalg.norm(left[:, int(np.sum(size > DEPENDENT)) :], axis=1))


def _smallest(gram: Array) -> tuple[Array, Array]:
    """Left singular vectors of the smallest singular values and these, from the products of the rows.

    A value of zero comes out below 1e-8, the root of round-off; other values are not followed to the end.
    """
    import scipy.sparse
    import scipy.sparse.linalg

    count = gram.shape[0]
    factor = scipy.sparse.linalg.splu(scipy.sparse.csc_array(gram + 1e-13 * scipy.sparse.eye_array(count)))
    vectors = np.random.default_rng(0).normal(size=(count, SOUGHT))
    for _ in range(ROUNDS):
        vectors = np.linalg.qr(factor.solve(vectors))[0]
    squares, turn = np.linalg.eigh(vectors.T @ (gram @ vectors))
    return vectors @ turn, np.sqrt(np.maximum(squares, 0.0))
