"""Rotations of space: what `plane` is for the plane.

A vector is an array (3,) or (3, lanes), a rotation a matrix (3, 3) or (3, 3, lanes) whose columns are the turned axes.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from shoal.mechanics.numerics.tile import Array, Number

_SMALL = 1e-4
"""Below this angle [rad] series are more accurate than quotients of sines."""


def skew(u: Array) -> Array:
    """The matrix of u x w, (3, 3, ...)."""
    x, y, z = u
    none = 0.0 * x
    return np.array([[none, -z, y], [z, none, -x], [-y, x, none]])


def cross(u: Any, w: Any) -> Array:
    """u x w."""
    return np.stack([u[1] * w[2] - u[2] * w[1], u[2] * w[0] - u[0] * w[2], u[0] * w[1] - u[1] * w[0]])


def unit(u: Array) -> Array:
    """A vector divided by its length."""
    return np.asarray(u / np.sqrt(np.sum(u * u, axis=0)))


def of_vector(rotation: Array) -> Array:
    """The rotation of a rotation vector [rad], (3, 3, lanes) of (3, lanes), by Rodrigues' formula."""
    square = np.sum(rotation * rotation, axis=0)
    angle = np.sqrt(square)
    small = angle < _SMALL
    safe = np.where(small, 1.0, angle)
    sine = np.where(small, 1.0 - square / 6.0, np.sin(safe) / safe)
    cosine = np.where(small, 0.5 - square / 24.0, 2.0 * (np.sin(0.5 * safe) / safe) ** 2)
    turn = skew(rotation)
    return np.asarray(np.eye(3)[..., None] + sine * turn + cosine * product(turn, turn))


def about_z(angle: Number) -> Array:
    """The rotation by an angle [rad] about z, (3, 3, lanes); by right angles it is exact."""
    cosine, sine = (np.atleast_1d(part) for part in (np.cos(angle), np.sin(angle)))
    cosine, sine = (np.where(np.abs(part) < 4e-16, 0.0, part) for part in (cosine, sine))
    none, one = 0.0 * cosine, 1.0 + 0.0 * cosine
    return np.array([[cosine, -sine, none], [sine, cosine, none], [none, none, one]])


def vector_of(rotation: Array) -> Array:
    """The rotation vector [rad] of a matrix (3, 3), of at most half a turn."""
    twice = np.array(
        [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]
    )
    sine, cosine = 0.5 * np.linalg.norm(twice), 0.5 * (np.trace(rotation) - 1.0)
    angle = np.arctan2(sine, cosine)
    if sine > 1e-6:
        return np.asarray(0.5 * angle / sine * twice)
    if cosine > 0:
        return np.asarray(0.5 * twice)
    square = 0.5 * (rotation + np.eye(3))  # near half a turn: the axis times itself
    column = square[:, int(np.argmax(np.diag(square)))]
    return np.asarray(angle * column / np.linalg.norm(column))


def product(a: Array, b: Array) -> Array:
    """The product of matrices (3, 3, lanes)."""
    return np.asarray(np.einsum("ijl,jkl->ikl", *np.broadcast_arrays(a, b)))


def turned(matrix: Array, u: Array) -> Array:
    """A matrix (3, 3, lanes) times a vector (3, lanes)."""
    lanes = max(matrix.shape[-1], u.shape[-1])
    u = np.broadcast_to(u, (3, lanes))
    return np.asarray(np.einsum("ijl,jl->il", np.broadcast_to(matrix, (3, 3, lanes)), u))


def back(matrix: Array, u: Array) -> Array:
    """The transpose of a matrix (3, 3, lanes) times a vector (3, lanes)."""
    return turned(matrix.transpose(1, 0, 2), u)


def across(u: Array) -> tuple[Array, Array]:
    """Two unit vectors (3, lanes) that make a right-handed frame with the unit vector u (3, lanes): (a, u x a)."""
    least = np.argmin(np.abs(u[:, 0]))
    axis = np.eye(3)[least][:, None]
    first = unit(axis - u * u[least])
    return first, cross(u, first)
