"""Redundant joints in space, by the null space of the transposed Jacobian of the constraints."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

import numpy as np

from shoal.mechanics.assembly.space.placement import place_in_space
from shoal.mechanics.numerics.tile import Array
from shoal.mechanics.term_values import TermValues
from shoal.mechanics.terms import Term
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
    """Return the joints that are redundant at these coordinates, (unknowns,): they have a part in a dependent row."""
    terms = place_in_space(scene).terms.held
    if not terms:
        return ()
    values = TermValues(terms, 3).of_lane(0)
    names, combine = _combined(scene, terms, values, q)
    share = _shares(values, combine, q)
    return joints_of(scene, {name for name, part in zip(names, share, strict=True) if part > SHARE})


def joints_of(scene: Scene, names: Collection[str]) -> tuple[str, ...]:
    """The joints that rows are of, by the names of joints, or of bodies, which their joints hold."""
    held = {*names}
    return tuple(
        name for name, joint in scene.joints.items() if name in held or held & {side.body for side in places(joint)}
    )


def _combined(scene: Scene, terms: Sequence[Term], values: TermValues, q: Array) -> tuple[list[str], Any]:
    """Names of the rows, and the combinations of the terms that they are, (rows, terms).

    The cosine and the sine of a driven angle make one row, that of the angle itself.
    """
    found = values.at(q[None])[0][0] - values.offset[0]
    driven: dict[str, list[int]] = {}
    names, rows = list[str](), list[dict[int, float]]()
    for number, term in enumerate(terms):
        joint = scene.joints.get(term.name)
        if joint is not None and joint.kind == "driven-angle" and term.drive is not None:
            driven.setdefault(term.name, []).append(number)
        else:
            names.append(term.name)
            rows.append({number: 1.0})
    for name, (cosine, sine) in driven.items():
        names.append(name)
        rows.append({cosine: -found[sine], sine: found[cosine]})
    import scipy.sparse

    parts = [(row, number, factor) for row, one in enumerate(rows) for number, factor in one.items()]
    each = [np.array(part) for part in zip(*parts, strict=True)]
    return names, scipy.sparse.csr_array((each[2], (each[0], each[1])), shape=(len(rows), len(terms)))


def _shares(values: TermValues, combine: Any, q: Array) -> Array:
    """The part of every row in all dependences, (rows,)."""
    import scipy.sparse

    slopes = values.at(q[None])[1][0]
    slope = combine @ scipy.sparse.csr_array((slopes, (values.rows, values.unknowns)), shape=(values.count, len(q)))
    length = np.sqrt(np.asarray((slope * slope).sum(axis=1)).ravel()) + 1e-300
    slope = scipy.sparse.diags_array(1 / length) @ slope
    if slope.shape[0] > DENSE:
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
