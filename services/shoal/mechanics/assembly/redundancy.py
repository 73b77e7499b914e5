"""Redundant joints, by the null space of the transposed Jacobian of the loop closure equations.

Their forces are not unique. Every place of a flexible rod is of a body of its own, as the rod does not hold them
rigidly. What depends on others at a singular position only is not redundant.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from shoal.mechanics import plane
from shoal.mechanics import rotation as turns
from shoal.mechanics.assembly.space.rigid_bodies import SpatialBodies
from shoal.mechanics.numerics.newton import newton
from shoal.mechanics.numerics.tile import Array
from shoal.mechanics.reach import span
from shoal.mechanics.start.closure import Closure, Poses, Rows
from shoal.mechanics.start.rigid_bodies import RigidBodies
from shoal.scene import InitialState, Scene

RANK = 1e-7
"""Singular values of the rows of unit length below this are of rows that depend on others."""
SHARE = 1e-3
"""Part in a dependence from which a row counts as one of those that make it."""
BESIDE = 1e-5
"""The same beside the position: joints that close to 1e-14 leave open its root where they hold in second order only."""
ASIDE = 0.02
"""How far [1, rad] the machine is moved to leave a singular position."""
CLOSED = 1e-9
"""Joints with a smaller residual, relative to the size of the machine or in rad, are closed."""
DENSE = 150
"""Up to so many rows all singular values are found."""
LARGEST = 400
"""Up to so many rows a dependence is looked for beside the position, too."""
SOUGHT, ROUNDS = 24, 4
"""Of more rows, so many of the smallest singular values are sought, by so many inverse iterations."""


def redundant_joints(scene: Scene, start: Mapping[str, InitialState]) -> tuple[str, ...]:
    """Return the joints that depend on others at a start and, if the machine can move, also near it.

    start: of all bodies, as it is used
    """
    if not scene.joints:
        return ()
    bodies = (RigidBodies if scene.dimensions == plane.DIMENSIONS else SpatialBodies)(scene, apart=True)
    poses = _poses(scene, bodies, start)
    closure, size = Closure(scene, poses, bodies=bodies), float(np.max(span(scene)))
    rows = closure.rows(poses)
    found = _dependent(rows, size)
    if found and len(rows.names) <= LARGEST:
        aside = _moved_aside(closure, poses, rows, size)
        found = found if aside is None else _dependent(closure.rows(aside), size, BESIDE)
    return tuple(name for name in scene.joints if name in found)


def _poses(scene: Scene, bodies: RigidBodies, start: Mapping[str, InitialState]) -> Poses:
    """Poses of all rigid bodies and of the ground, of one lane."""
    d, owners = scene.dimensions, bodies.owners
    places = np.array([[float(np.ravel(x)[0]) for x in start[name].position or ()] for name in owners])
    places = np.pad(places, ((0, 1), (0, 0)))[None]
    if isinstance(bodies, SpatialBodies):
        axes = np.array([_axes(bodies, name, start[name]) for name in owners] + [np.eye(3)])[None]
        return Poses(places, axes, np.zeros(places.shape[:2]))
    angles = np.array([[float(np.ravel(start[name].angle or 0.0)[0]) for name in owners] + [0.0]])
    axes = np.moveaxis(plane.rotation(angles[0]), -1, 0)[None]
    return Poses(places[..., :d], axes, angles)


def _axes(bodies: SpatialBodies, name: str, start: InitialState) -> Array:
    """The rotation of a body, (3, 3)."""
    if start.rotation is None:  # of a rod, whose sections turn each by themselves, and of a point
        return bodies.attitudes.rotation(name)[..., 0]
    return turns.of_vector(np.array([np.ravel(x)[0] for x in start.rotation])[:, None])[..., 0]


def _dependent(rows: Rows, size: float, rank: float = RANK) -> set[str]:
    """Return the names of dependent rows."""
    share = _shares(rows, size, rank)
    return {name for name, part in zip(rows.names, share, strict=True) if part > SHARE}


def _scaled(rows: Rows, size: float) -> Any:
    """Jacobian by displacements in parts of the machine's size, its rows of unit length, (rows, displacements)."""
    import scipy.sparse

    entries = []
    for numbers, owners, part in rows.parts:
        width = part.shape[-1]
        d = width - 1 if width == 3 else 3
        each = part[0] * np.where(np.arange(width) < d, 1.0, 1.0 / size)
        columns = owners[:, None] * width + np.arange(width)
        entries.append((each.ravel(), np.repeat(numbers, width), columns.ravel()))
    value, row, column = (np.concatenate(one) for one in zip(*entries, strict=True))
    shape = len(rows.names), rows.bodies * rows.parts[0][2].shape[-1]
    slope = scipy.sparse.csr_array((value, (row, column)), shape=shape)
    length = np.sqrt(np.asarray((slope * slope).sum(axis=1)).ravel()) + 1e-300
    return scipy.sparse.diags_array(1 / length) @ slope


def _shares(rows: Rows, size: float, rank: float) -> Array:
    """The part of every row in all dependences, (rows,)."""
    if not rows.parts:
        return np.zeros(len(rows.names))
    slope = _scaled(rows, size)
    if slope.shape[0] > DENSE:
        vectors, sizes = _smallest(slope @ slope.T)
        if not np.all(sizes < rank):
            return np.asarray(np.linalg.norm(vectors[:, sizes < rank], axis=1))
    left, sizes, _ = np.linalg.svd(slope.toarray())
    return np.asarray(np.linalg.norm(left[:, int(np.sum(sizes > rank)) :], axis=1))


def _smallest(gram: Any) -> tuple[Array, Array]:
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


def _moved_aside(closure: Closure, poses: Poses, rows: Rows, size: float) -> Poses | None:
    """Poses beside, which close the joints; none where the machine comes back, as it cannot move.

    What holds such a machine twice does so for good.
    """
    slope = _scaled(rows, size).toarray()
    _, sizes, right = np.linalg.svd(slope)
    free = right[int(np.sum(sizes > RANK)) :]
    width = slope.shape[1] // rows.bodies
    unit = np.tile(np.where(np.arange(width) < (2 if width == 3 else 3), 1.0, 1.0 / size), rows.bodies)
    if not len(free):
        return None
    step = free.T @ np.cos(1.0 + np.arange(len(free))) * unit
    total = ASIDE * step / np.max(np.abs(step))
    length = np.where(rows.angular, 1.0, size)

    def correct(place: tuple[Poses, Array]) -> tuple[Array, float]:
        found = closure.rows(place[0])
        gap = found.gap[0] / length
        if np.max(np.abs(gap)) < 1e-14:
            return np.zeros_like(total), 0.0
        back = unit * np.linalg.lstsq(found.slope[0] / length[:, None] * unit, -gap, RANK)[0]
        return back, float(np.max(np.abs(back / unit)))

    def move(place: tuple[Poses, Array], step: Array) -> tuple[Poses, Array]:
        return place[0].moved(step.reshape(1, rows.bodies, width)), place[1] + step

    (near, way), *_ = newton(correct, move((poses, np.zeros_like(total)), total), close=0.0, move=move)
    closed = np.max(np.abs(closure.rows(near).gap[0] / length)) < CLOSED
    return near if closed and np.max(np.abs(way)) > 0.25 * ASIDE else None
