"""The sections of a rod's elements, and what follows from them: masses and stiffnesses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shoal.scene import Rod
from shoal.trajectory import Array


@dataclass(frozen=True)
class Sections:
    """Height and width [m] of each element, those of its middle, (elements,)."""

    rod: Rod
    height: Array
    width: Array

    @classmethod
    def of(cls, rod: Rod) -> Sections:
        """The sections of a rod."""
        height, width = rod.section((np.arange(rod.elements) + 0.5) / rod.elements)
        still = np.zeros(rod.elements)
        return cls(rod, height + still, width + still)

    @property
    def mass(self) -> Array:
        """Mass per length [kg/m]."""
        return self.rod.density * self.height * self.width

    @property
    def inertia(self) -> Array:
        """Rotary inertia per length, rho I [kg m]."""
        return self.rod.density * self.width * self.height**3 / 12

    @property
    def axial(self) -> Array:
        """EA [N]."""
        assert self.rod.youngs_modulus is not None
        return self.rod.youngs_modulus * self.height * self.width

    @property
    def bending(self) -> Array:
        """EI [N m^2]."""
        assert self.rod.youngs_modulus is not None
        return self.rod.youngs_modulus * self.width * self.height**3 / 12

    @property
    def shear(self) -> Array:
        """k G A [N], G = E / (2 (1 + nu)), k of a rectangle: Cowper (1966), J. Appl. Mech. 33, 335, table 1."""
        nu = self.rod.poisson_ratio
        return 10 * (1 + nu) / (12 + 11 * nu) * self.axial / (2 * (1 + nu))
