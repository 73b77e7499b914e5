"""Integrals of a body's modes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from shoal.mechanics.numerics.tile import Array, Number

Shapes = Callable[[tuple[Number, ...]], tuple[list[Any], list[Any]]]


@dataclass(frozen=True)
class Modes:
    """across: how many have a vector of their own; along: how many of a rod stretch it, first evenly.

    moments: Hermitian, (2 + across, 2 + across, lanes), the first two of the frame; stiffness, damping: (modes, modes,
    lanes), first those across; shapes: place -> complex displacement and slope (that of the body's x direction) of
    every mode there; length [m]: of a rod.
    """

    across: int
    along: int
    length: Number
    moments: Array
    stiffness: Array
    damping: Array
    shapes: Shapes
