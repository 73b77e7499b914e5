"""Joints in space that hold what others hold already."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from shoal.mechanics.assembly.space.placement import place_in_space
from shoal.mechanics.assembly.space.values import slopes, value_of
from shoal.mechanics.assembly.terms import Mesh, Term
from shoal.mechanics.numerics.tile import Array
from shoal.scene import Scene
from shoal.scene.joints import places

Row = tuple[str, list[tuple[int, float]]]
"""Who holds it; unknowns and derivatives, those of an unknown add up."""
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
    terms = place_in_space(scene).terms.held
    if not terms:
        return ()
    rows = _rows(scene, terms, q)
    share = _shares(rows, len(q))
    return joints_of(scene, {name for (name, _), part in zip(rows, share, strict=True) if part > SHARE})


def joints_of(scene: Scene, names: Collection[str]) -> tuple[str, ...]:
    """The joints that rows are of, by the names of joints, or of bodies, which their joints hold."""
    held = {*names}
    return tuple(
        name for name, joint in scene.joints.items() if name in held or held & {side.body for side in places(joint)}
    )


def _rows(scene: Scene, terms: list[Term | Mesh], q: Array) -> list[Row]:
    """The rows of the constraints at q. Of a driven angle, whose cosine and sine are held, that of the angle itself."""
    found: list[Row] = []
    driven: dict[str, list[Term]] = {}
    for term in terms:
        joint = scene.joints.get(term.name)
        if isinstance(term, Term) and joint is not None and joint.kind == "driven-angle" and term.drive is not None:
            driven.setdefault(term.name, []).append(term)
        else:
            found.append((term.name, list(slopes(term, q[:, None], 0))))
    for name, (cosine, sine) in driven.items():
        c, s = (value_of(replace(term, constant=0.0, drive=None), q, 0) for term in (cosine, sine))
        parts = [(k, factor * x) for term, factor in ((cosine, -s), (sine, c)) for k, x in slopes(term, q[:, None], 0)]
        found.append((name, parts))
    return found


def _shares(found: list[Row], unknowns: int) -> Array:
    """The part of every row in all dependences, (rows,)."""
    import scipy.sparse

    rows = np.repeat(np.arange(len(found)), [len(slopes_of_row) for _, slopes_of_row in found])
    columns = np.array([unknown for _, slopes_of_row in found for unknown, _ in slopes_of_row], dtype=int)
    values = np.array([value for _, slopes_of_row in found for _, value in slopes_of_row], dtype=float)
    slope = scipy.sparse.csr_array((values, (rows, columns)), shape=(len(found), unknowns))
    length = np.sqrt(np.asarray((slope * slope).sum(axis=1)).ravel()) + 1e-300
    slope = scipy.sparse.diags_array(1 / length) @ slope
    if len(found) > DENSE:
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
