"""Measures of a machine as further unknowns (lifting), so that constraints on them stay at most quadratic.

A length l of a vector w has the constraint l l = w . w, an angle that counts its turns that of the unit vector whose
angle it is, a hinge on a body that moves u = (a . b, d . b) by directions a and d of the first body, at right angles to
the axis, and b of the second. Such an unknown moves no mass. It has a negligible mass, and an added one that iterative
refinement takes out again (`least.lent`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shoal.errors import InputError
from shoal.mechanics.affine import Affine, fixed
from shoal.mechanics.numerics.tile import Array, Number


@dataclass(frozen=True)
class Lifted:
    """Unknowns of a measure. joint: whose it is; lever: what makes a rate of them one of a place [m] or of a turn.

    turns: whether it is the angle of a body, whose inertia counts, and not the motion of a place
    """

    unknowns: tuple[int, ...]
    joint: str
    lever: Number = 1.0
    turns: bool = False


def first_axis(dimensions: int) -> Array:
    """Return the unit vector along the first axis, (d, 1)."""
    return np.asarray(np.eye(dimensions)[0][:, None])


class LiftedMeasures:
    """Measures with unknowns of their own, of a `coordinates.Placement`."""

    positions: list[Number]
    velocities: list[Number]
    lifted: list[Lifted]

    def new_number(self, value: Number, rate: Number) -> Affine:
        """Add an unknown, as the first component of a vector."""
        axis = first_axis(self.scene.dimensions)  # type: ignore[attr-defined]
        self.positions.append(value)
        self.velocities.append(rate)
        return Affine({len(self.positions) - 1: axis}, 0.0 * axis)

    def length(self, name: str, gap: Affine) -> Affine:
        """Return the length of a vector [m]. Raises InputError where it is zero, and has no direction."""
        way, rate = self.start_of(gap)  # type: ignore[attr-defined]
        size = np.sqrt(np.sum(way**2, axis=0))
        if np.any(size == 0.0):
            raise InputError(f"joints.{name}: a distance that it counts is 0 at the start, which has no direction")
        found = self.new_number(size, np.sum(way * rate, axis=0) / size)
        self.terms.sum(name, [(gap, gap), (found * -1.0, found)], lengths=2, of_start=False)  # type: ignore[attr-defined]
        self.lifted.append(Lifted(tuple(found.terms), name))
        return found

    def count(self, name: str, vector: Affine, lever: Number = 1.0, turns: bool = True) -> Affine:
        """Return the angle of a unit vector with all its turns [rad]; it starts within half a turn."""
        (x, y, *_), (xdot, ydot, *_) = self.start_of(vector)  # type: ignore[attr-defined]
        found = self.new_number(np.arctan2(y, x), x * ydot - y * xdot)
        first = fixed(first_axis(self.scene.dimensions))  # type: ignore[attr-defined]
        self.terms.sum(name, [(first, found * -1.0)], angles=[(1.0, vector)], period=2.0 * np.pi)  # type: ignore[attr-defined]
        self.lifted.append(Lifted(tuple(found.terms), name, lever, turns))
        return found
