"""Where a body is at time zero."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shoal.mechanics.assembly.affine import Number


def as_complex(vector: tuple[Number, Number]) -> Number:
    """x + iy."""
    return vector[0] + 1j * np.asarray(vector[1]) if np.ndim(vector[0]) or np.ndim(vector[1]) else complex(*vector)


def unit(angle: Number) -> Number:
    """exp(i angle)."""
    return np.exp(1j * np.asarray(angle)) if np.ndim(angle) else complex(np.exp(1j * angle))


@dataclass(frozen=True)
class Pose:
    """Initial position [m] and direction of a body's frame, velocity [m/s] and rate [rad/s]; complex, per lane."""

    position: Number
    direction: Number
    velocity: Number
    rate: Number

    def point(self, p: Number) -> Number:
        """Initial position of the material point p."""
        return self.position + self.direction * p

    def point_velocity(self, p: Number) -> Number:
        """Initial velocity of the material point p."""
        return self.velocity + 1j * self.rate * self.direction * p
