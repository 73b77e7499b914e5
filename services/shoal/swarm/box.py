"""The box that is searched, and its image [0, 1]^d in which lengths are fractions of its sides."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from shoal.swarm.protocol import Array


@dataclass(frozen=True, eq=False)
class Box:
    """Bounds in the units of the problem; lower, upper: (d,)."""

    lower: Array
    upper: Array

    def __post_init__(self) -> None:
        lower, upper = np.array(self.lower, dtype=float), np.array(self.upper, dtype=float)
        if lower.ndim != 1 or lower.shape != upper.shape or lower.size == 0:
            raise ValueError(f"lower and upper need one number per dimension each, found {lower} and {upper}")
        if not np.all(np.isfinite(upper - lower)) or np.any(lower >= upper):
            raise ValueError(f"lower must be less than upper and both finite, found {lower} and {upper}")
        object.__setattr__(self, "lower", lower)
        object.__setattr__(self, "upper", upper)

    @property
    def dimension(self) -> int:
        """Number of unknowns d."""
        return self.lower.size

    def from_unit(self, unit: Array) -> Array:
        """Points of [0, 1]^d in the units of the problem, never outside the bounds by round-off."""
        return np.clip(self.lower + unit * (self.upper - self.lower), self.lower, self.upper)

    def to_unit(self, points: Array) -> Array:
        """Points in the units of the problem as fractions of the box; those outside move to its border."""
        return np.clip((points - self.lower) / (self.upper - self.lower), 0.0, 1.0)

    def point(self, name: str, value: Array) -> Array:
        """A finite point given by the user, (d,). Raises ValueError."""
        point = np.array(value, dtype=float)
        if point.shape != self.lower.shape or not np.all(np.isfinite(point)):
            raise ValueError(f"{name} needs {self.dimension} finite numbers, found {value}")
        return point


def reflect(unit: Array, velocity: Array) -> tuple[Array, Array]:
    """Fold points back into [0, 1]^d at its walls; a component that hits a wall loses its velocity."""
    folded = 1.0 - np.abs(1.0 - np.mod(unit, 2.0))
    return folded, np.where((unit < 0.0) | (unit > 1.0), 0.0, velocity)


@dataclass(frozen=True, kw_only=True, eq=False)
class Seeded:
    """A swarm of `size` fish in a box, of which the last two may be given.

    traditional, previous: optimum of a traditional method and of the previous time step, (d,), each optional so that an
    ablation can leave it out. Raises ValueError.
    """

    lower: Array
    upper: Array
    size: int = 40
    traditional: Array | None = None
    previous: Array | None = None

    def __post_init__(self) -> None:
        box = self.box
        if self.size < 2:
            raise ValueError(f"needs 2 fish or more, found {self.size}")
        for name in ("traditional", "previous"):
            if (seed := getattr(self, name)) is not None:
                box.point(name, seed)

    @cached_property
    def box(self) -> Box:
        """The box that is searched."""
        return Box(self.lower, self.upper)
