"""The plane: the one file that knows what a right angle is, how an angle turns a vector and how two vectors cross.

A vector is an array whose first axis has the components, (2,) or (2, lanes); a rotation is a matrix (2, 2, lanes) whose
columns are the turned axes. What is written for vectors of any dimension elsewhere comes here for its rotations.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from shoal.mechanics.numerics.tile import Array, Number

DIMENSIONS = 2
QUARTER = np.array([[0.0, -1.0], [1.0, 0.0]])
"""The turn by a right angle, counter-clockwise."""
CROSS = QUARTER.T
"""The form u' CROSS w = u x w."""


def vector(*components: Number) -> Array:
    """The vector of these components, (d, lanes)."""
    if all(type(one) is float for one in components):
        return np.array(components)[:, None]
    return np.stack(np.broadcast_arrays(*(np.atleast_1d(np.asarray(one, dtype=float)) for one in components)))


def unit(angle: Number) -> Array:
    """The unit vector at an angle [rad] from the x axis, (2, ...)."""
    return np.stack([np.cos(angle), np.sin(angle)])


def quarter(u: Any) -> Array:
    """A vector turned by a right angle, counter-clockwise."""
    return np.stack([-u[1], u[0]])


def cross(u: Any, w: Any) -> Any:
    """u x w = u_x w_y - u_y w_x."""
    return u[0] * w[1] - u[1] * w[0]


def angle(u: Any) -> Any:
    """The angle [rad] of a vector from the x axis."""
    return np.arctan2(u[1], u[0])


def rotation(turn: Number) -> Array:
    """The rotation by an angle [rad], (2, 2, lanes); by right angles it is exact."""
    along = vector(*unit(turn))
    along = np.where(np.abs(along) < 4e-16, 0.0, along)
    return np.stack([along, quarter(along)], axis=1)


def aligning(place: Array) -> Array:
    """The matrix that maps the way to a place in a body's frame to the body's first director, (2, 2, lanes)."""
    x, y = place / sum(place**2)
    return np.array([[x, y], [-y, x]])


def as_complex(u: Any) -> Any:
    """x + iy: for who poses rigid bodies in the plane (`start`), one number a vector."""
    return u[0] + 1j * np.asarray(u[1]) if np.ndim(u[0]) or np.ndim(u[1]) else complex(*u)


def phasor(turn: Number) -> Number:
    """exp(i angle), which turns such a number."""
    return np.exp(1j * np.asarray(turn)) if np.ndim(turn) else complex(np.exp(1j * turn))
