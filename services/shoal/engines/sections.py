"""The sections of a rod's elements, and what follows from them: masses and stiffnesses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from shoal.scene import Rod
from shoal.scene.sections import Section
from shoal.trajectory import Array


@dataclass(frozen=True)
class Sections:
    """The section of each element, that of its middle; every property is (elements,)."""

    rod: Rod
    section: Section

    @classmethod
    def of(cls, rod: Rod) -> Sections:
        """The sections of a rod."""
        return cls(rod, rod.section_at((np.arange(rod.elements) + 0.5) / rod.elements))

    def _each(self, value: Any) -> Array:
        return np.asarray(value * np.ones(self.rod.elements))

    @property
    def mass(self) -> Array:
        """Mass per length [kg/m]."""
        return self._each(self.rod.density * self.section.area)

    @property
    def inertia(self) -> Array:
        """Rotary inertia per length, rho I [kg m]."""
        return self._each(self.rod.density * self.section.bending)

    @property
    def axial(self) -> Array:
        """EA [N]."""
        assert self.rod.youngs_modulus is not None
        return self._each(self.rod.youngs_modulus * self.section.area)

    @property
    def bending(self) -> Array:
        """EI [N m^2]."""
        assert self.rod.youngs_modulus is not None
        return self._each(self.rod.youngs_modulus * self.section.bending)

    @property
    def shear(self) -> Array:
        """k G A [N], G = E / (2 (1 + nu)), k of the section."""
        nu = self.rod.poisson_ratio
        return self._each(self.section.shear(nu)) * self.axial / (2 * (1 + nu))
