"""Pose of a body at time zero."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shoal.mechanics.numerics.tile import Array, Number
from shoal.scene import Function


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


def value_and_rate(f: Function) -> tuple[float, float]:
    """A function of time and its slope at time zero."""
    h = 1e-6
    before, now, after = (float(v) for v in f(np.array([0.0, h, 2 * h])))
    return before, (4 * now - 3 * before - after) / (2 * h)
