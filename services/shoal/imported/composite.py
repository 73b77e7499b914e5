"""Mass and inertia of links that are fixed together, and what a body needs so that it can move."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from shoal.imported.rounding import ROUNDED, Array

SMALL = float(np.sqrt(np.finfo(float).eps))
"""Mass of a body without one, per mass that it carries, 1.5e-8: accelerations change by as much, and their round-off is
eps over it."""
LEAST = 2e-14
"""Moment of inertia [kg m^2] that MuJoCo takes; it refuses less than 1e-14."""
TOUCHING = 1e-6
"""The same in machines with contacts, whose events ask for forces without so much round-off: a humanoid of 38 contacts
moves through 37 events, and with 1e-7 makes no headway between the first ones."""


@dataclass
class Moments:
    """Mass [kg], and its first [kg m] and second moments [kg m^2] about the origin: integrals of 1, x and x x' dm."""

    mass: float = 0.0
    first: Array = field(default_factory=lambda: np.zeros(3))
    second: Array = field(default_factory=lambda: np.zeros((3, 3)))

    @classmethod
    def of(cls, mass: float, centre: Array, inertia: Array) -> Moments:
        """Return those of a body with a centre of mass [m] and an inertia about that [kg m^2], along the same axes."""
        spread = np.eye(3) * np.trace(inertia) / 2 - inertia
        return cls(mass, mass * centre, spread + mass * np.outer(centre, centre))

    def moved(self, turn: Array, place: Array) -> Moments:
        """Return the same in a frame in which the old one has these axes as columns, and this origin [m]."""
        first = turn @ self.first
        shifted = np.outer(first, place)
        second = turn @ self.second @ turn.T + shifted + shifted.T + self.mass * np.outer(place, place)
        return Moments(self.mass, first + self.mass * place, second)

    def __add__(self, other: Moments) -> Moments:
        return Moments(self.mass + other.mass, self.first + other.first, self.second + other.second)

    @property
    def centre(self) -> Array:
        """Return the centre of mass [m]; of nothing the origin."""
        return self.first / self.mass if self.mass else np.zeros(3)

    @property
    def inertia(self) -> Array:
        """Return the inertia about the centre of mass [kg m^2]."""
        spread = self.second - self.mass * np.outer(self.centre, self.centre)
        return np.asarray(np.trace(spread) * np.eye(3) - spread)

    @property
    def size(self) -> float:
        """Return a length [m]: the radius of gyration about the origin, or of nothing 0.1."""
        return float(np.sqrt(np.trace(self.second) / self.mass)) if self.mass and np.any(self.second) else 0.1


def movable(own: Moments, carried: Moments, small: float = SMALL) -> tuple[Moments, str, str]:
    """Return moments with which a body can move, a note on what was added, and an error.

    carried: of the body with all that it carries. A body without mass gets `small` of what it carries, one without
    inertia about an axis that of so much of its mass at its size, and moments that no body has are raised to the
    nearest that one has. A negative one is an error.
    """
    if own.mass < small / 2 * carried.mass:
        mass = small * carried.mass
        added = Moments.of(mass, own.centre, np.eye(3) * mass * carried.size**2)
        return own + added, f"has no mass; given {mass:.2g} kg, {small:.2g} of what it carries", ""
    values, axes = np.linalg.eigh(own.inertia)
    if values[0] < -ROUNDED * abs(values[2]):
        return own, "", f"its moment of inertia {values[0]:.3g} kg m^2 is negative"
    least = max(small * own.mass * own.size**2, LEAST)
    if values[0] >= least / 2 and values[2] <= (1.0 + ROUNDED) * (values[0] + values[1]):
        return own, "", ""
    # Second moments along the axes: of a mass in one point none, of a thin rod one, of no body a negative one.
    spread = np.maximum(values.sum() / 2 - values, least)
    new = spread.sum() - spread
    raised = Moments.of(own.mass, own.centre, np.einsum("ik,k,jk->ij", axes, new, axes))
    if values[2] <= (1.0 + ROUNDED) * (values[0] + values[1]):
        return raised, f"has the principal moment of inertia {max(values[0], 0.0):.2g} kg m^2; given {new[0]:.2g}", ""
    before, after = (", ".join(f"{value:.3g}" for value in each) for each in (values, new))
    told = f"no body has the principal moments of inertia {before} kg m^2, the largest above the others' sum"
    return raised, f"{told}; taken as {after}", ""
