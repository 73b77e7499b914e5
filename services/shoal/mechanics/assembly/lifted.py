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
from shoal.mechanics import plane
from shoal.mechanics.affine import Affine, fixed
from shoal.mechanics.numerics.tile import Array, Number
from shoal.mechanics.ropes import NEARER


@dataclass(frozen=True)
class Lifted:
    """Unknowns of a measure. joint: whose it is; lever: what makes a rate of them one of a place [m] or of a turn.

    turns: whether it is the angle of a body, whose inertia counts, and not the motion of a place; span: whether it is
    the length of one, which may not vanish
    """

    unknowns: tuple[int, ...]
    joint: str
    lever: Number = 1.0
    turns: bool = False
    span: bool = False


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

    def span(self, name: str, gap: Affine, c: Number) -> tuple[Affine, Affine | None]:
        """Return the length s [m] of the straight span between circles, and its unit vector t if c is not 0.

        gap: between the centres, s t - c n, n being t turned by 90 degrees (`ropes`). Raises InputError where no span
        is between them, as of two places that are one.
        """
        way, rate = self.start_of(gap)  # type: ignore[attr-defined]
        square = np.sum(way**2, axis=0) - np.asarray(c, dtype=float) ** 2
        if np.any(square <= 0.0):
            near, least = float(np.min(np.sqrt(np.sum(way**2, axis=0)))), float(np.max(np.abs(c)))
            raise InputError(
                f"joints.{name}: two places that follow each other are {near:g} m apart at the start, and no straight "
                f"span is between them; it needs more than {least:g} m"
            )
        size = np.sqrt(square)
        if not np.any(c):
            found = self.new_number(size, np.sum(way * rate, axis=0) / size)
            pairs = [(gap, gap), (found * -1.0, found)]
            self.terms.sum(name, pairs, lengths=2, of_start=False)  # type: ignore[attr-defined]
            self.lifted.append(Lifted(tuple(found.terms), name, span=True))
            return found, None
        # D = s t - c n is t turned by the angle of (s, -c) and stretched.
        x, y = way
        along = np.stack([x * size - y * c, y * size + x * c]) / (square + c**2)
        across = np.stack([-along[1], along[0]])
        turning = np.sum(rate * across, axis=0) / size
        length = self.new_number(size, np.sum(rate * along, axis=0) - c * turning)
        vector: Affine = self.new_vector(along, turning * across)  # type: ignore[attr-defined]
        apart = gap + vector.turned(plane.QUARTER) * c
        for axis in np.eye(2):
            pairs = [(fixed(axis[:, None]), apart), (length.turned(np.outer(axis, first_axis(2))) * -1.0, vector)]
            self.terms.sum(name, pairs, lengths=1, of_start=False)  # type: ignore[attr-defined]
        self.terms.dot(name, vector, vector, 0, -1.0)  # type: ignore[attr-defined]
        self.lifted += [
            Lifted(tuple(length.terms), name, span=True),
            Lifted(tuple(vector.terms), name, NEARER * float(np.min(size))),
        ]
        return length, vector

    def count(self, name: str, vector: Affine, lever: Number | None = None) -> Affine:
        """Return the angle of a unit vector with all its turns [rad]; it starts within half a turn.

        lever: at which it moves a place [m]; None of the angle of a body
        """
        (x, y, *_), (xdot, ydot, *_) = self.start_of(vector)  # type: ignore[attr-defined]
        found = self.new_number(np.arctan2(y, x), x * ydot - y * xdot)
        first = fixed(first_axis(self.scene.dimensions))  # type: ignore[attr-defined]
        self.terms.sum(name, [(first, found * -1.0)], angles=[(1.0, vector)], period=2.0 * np.pi)  # type: ignore[attr-defined]
        self.lifted.append(Lifted(tuple(found.terms), name, 1.0 if lever is None else lever, lever is None))
        return found
