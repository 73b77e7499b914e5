"""Where a body is at time zero."""

from __future__ import annotations

from dataclasses import dataclass

from shoal.mechanics.numerics.tile import Array, Number


@dataclass(frozen=True)
class Pose:
    """Initial position [m] (d, lanes) and directors of a body's frame, with their rates of change [m/s, 1/s].

    directors, turning: one vector for each axis of the body and its rate, (d, d, lanes).
    """

    position: Array
    directors: Array
    velocity: Array
    turning: Array

    def point(self, place: tuple[Number, ...]) -> Array:
        """Initial position of a material point."""
        return self.position + arm(self.directors, place)

    def point_velocity(self, place: tuple[Number, ...]) -> Array:
        """Initial velocity of a material point."""
        return self.velocity + arm(self.turning, place)


def arm(directors: Array, place: tuple[Number, ...]) -> Array:
    """The way from a body's origin to a place in its frame [m], (d, lanes)."""
    total: Array = sum(director * part for director, part in zip(directors, place, strict=True))
    return total
