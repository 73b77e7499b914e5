"""Emphasis of a picture of a motion: deflection magnified by a factor, stress by colour."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shoal.errors import InputError
from shoal.scene import Scene


@dataclass(frozen=True)
class Emphasis:
    """The factor by which deflections of rods are magnified, and whether they are coloured by stress."""

    magnify: float = 1.0
    stress: bool = False

    def check(self, scene: Scene) -> None:
        """Raises InputError where a scene has nothing to emphasise, or a factor is none."""
        if not (np.isfinite(self.magnify) and self.magnify > 0):
            raise InputError(f"magnify: must be a positive number, found {self.magnify:g}")
        for name, asked in (("magnify", self.magnify != 1.0), ("stress", self.stress)):
            if asked and not scene.flexible_rods:
                raise InputError(f"{name}: no rod of {scene.name} bends; leave it out, or choose another element")

    @property
    def note(self) -> str:
        """The factor, as a picture states it; empty of the true deflection."""
        return "" if self.magnify == 1.0 else f"deflection × {self.magnify:g}"


TRUE = Emphasis()
"""As it is."""
