"""The sections of a rod's elements, and what follows from them: masses and stiffnesses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from shoal.errors import InputError
from shoal.scene import Rod
from shoal.scene.sections import Section
from shoal.trajectory import Array


@dataclass(frozen=True)
class Sections:
    """The section of each element, that of its middle; every property is (elements,).

    section: as it resists; density and heavy: as it has mass, see `Rod.masses_at`
    """

    rod: Rod
    section: Section
    density: Any
    heavy: Section

    @classmethod
    def of(cls, rod: Rod) -> Sections:
        """The sections of a rod."""
        x = (np.arange(rod.elements) + 0.5) / rod.elements
        return cls(rod, rod.section_at(x), *rod.masses_at(x))

    @classmethod
    def stout(cls, rod: Rod, *elements: str) -> Sections:
        """The sections of a rod as beams with shear have them. Raises InputError where one by numbers lacks some.

        elements: those of which it has the numbers
        """
        for element in elements:
            if missing := rod.lacking(element):
                raise InputError(
                    f"bodies: engine exudyn-ge needs {missing[0]} of every flexible rod of section numbers"
                )
        return cls.of(rod)

    def _each(self, value: Any) -> Array:
        return np.asarray(value * np.ones(self.rod.elements))

    @property
    def mass(self) -> Array:
        """Mass per length [kg/m]."""
        return self._each(self.density * self.heavy.area)

    @property
    def inertia(self) -> Array:
        """Rotary inertia per length, rho I [kg m]."""
        return self._each(self.density * self.heavy.bending)

    @property
    def axial(self) -> Array:
        """EA [N]."""
        return self._each(self.rod.modulus * self.section.area)

    @property
    def bending(self) -> Array:
        """EI [N m^2]."""
        return self._each(self.rod.modulus * self.section.bending)

    @property
    def shear(self) -> Array:
        """k G A [N], G = E / (2 (1 + nu)), k of the section."""
        nu = self.rod.poisson_ratio
        return self._each(self.section.shear(nu)) * self.axial / (2 * (1 + nu))
