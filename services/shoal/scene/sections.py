"""Sections of rods by name: each is one class, with its area, second moments and torsion constant.

Heights lie along the local y axis, in the plane of motion, widths along z. All numbers may be arrays, one entry a lane.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

Number = Any
_TERMS = np.arange(1, 400, 2)


@dataclass(frozen=True)
class Section(ABC):
    """A section with its extent [m]. needs: the fields of a rod that define it, besides the height."""

    height: Number
    width: Number
    needs: ClassVar[tuple[str, ...]] = ()

    @classmethod
    def of(cls, height: Number, width: Number, wall: Number, web: Number, flange: Number) -> Section:
        """From the fields of a rod [m], those that it needs."""
        return cls(height, width)

    def fault(self) -> str:
        """Return why the section is impossible; empty if it is not."""
        return ""

    @property
    @abstractmethod
    def area(self) -> Number:
        """A [m^2]."""

    @property
    @abstractmethod
    def bending(self) -> Number:
        """Second moment for bending in the plane of motion, the integral of y^2 [m^4]."""

    @property
    @abstractmethod
    def side(self) -> Number:
        """Second moment for bending out of that plane, the integral of z^2 [m^4]."""

    @property
    @abstractmethod
    def torsion(self) -> Number:
        """Saint-Venant's constant J: torque over shear modulus and twist [m^4]."""

    @abstractmethod
    def shear(self, poisson: Number) -> Number:
        """Coefficient of shear, by which k G A is the stiffness: Cowper (1966), J. Appl. Mech. 33, 335, table 1."""

    @property
    def polar(self) -> Number:
        """Polar second moment [m^4]."""
        return self.bending + self.side

    def gyration(self, dimensions: int) -> tuple[float, ...]:
        """Radii of gyration [m] of the directions in which it bends, one in the plane and two in space."""
        moments = (self.bending, self.side)[: dimensions - 1]
        return tuple(float(np.sqrt(moment / self.area)) for moment in moments)


@dataclass(frozen=True)
class Rectangle(Section):
    """Height by width."""

    needs: ClassVar[tuple[str, ...]] = ("width",)

    @property
    def area(self) -> Number:
        """See Section."""
        return self.height * self.width

    @property
    def bending(self) -> Number:
        """See Section."""
        return self.width * self.height**3 / 12

    @property
    def side(self) -> Number:
        """See Section."""
        return self.height * self.width**3 / 12

    @property
    def torsion(self) -> Number:
        """Timoshenko and Goodier, Theory of Elasticity, art. 109: with the sides a >= b
        J = a b^3/3 (1 - 192 b/(pi^5 a) sum over odd n of tanh(n pi a/(2 b))/n^5).
        """
        long, short = np.maximum(self.height, self.width), np.minimum(self.height, self.width)
        terms = np.tanh(np.multiply.outer(_TERMS * np.pi / 2, long / short)).T / _TERMS**5.0
        return long * short**3 / 3 * (1 - 192 / np.pi**5 * short / long * terms.sum(axis=-1))

    def shear(self, poisson: Number) -> Number:
        """See Section."""
        return 10 * (1 + poisson) / (12 + 11 * poisson)


@dataclass(frozen=True)
class Tube(Section):
    """A circle of the height as outer diameter, with a wall; one as thick as half of it leaves no hole."""

    wall: Number
    needs: ClassVar[tuple[str, ...]] = ("wall",)

    @classmethod
    def of(cls, height: Number, width: Number, wall: Number, web: Number, flange: Number) -> Section:
        """See Section."""
        return cls(height, height, wall)

    def fault(self) -> str:
        """See Section."""
        return f"wall {self.wall:g} m is more than half the diameter" if 2 * self.wall > self.height else ""

    @property
    def _hole(self) -> Number:
        return self.height - 2 * self.wall

    @property
    def area(self) -> Number:
        """See Section."""
        return np.pi / 4 * (self.height**2 - self._hole**2)

    @property
    def bending(self) -> Number:
        """See Section."""
        return np.pi / 64 * (self.height**4 - self._hole**4)

    @property
    def side(self) -> Number:
        """See Section."""
        return self.bending

    @property
    def torsion(self) -> Number:
        """See Section."""
        return 2 * self.bending

    def shear(self, poisson: Number) -> Number:
        """See Section."""
        m = 1 + (self._hole / self.height) ** 2
        return 6 * (1 + poisson) * m**2 / ((7 + 6 * poisson) * m**2 + (20 + 12 * poisson) * (m - 1))


@dataclass(frozen=True)
class Round(Tube):
    """A full circle of the height as diameter."""

    needs: ClassVar[tuple[str, ...]] = ()

    @classmethod
    def of(cls, height: Number, width: Number, wall: Number, web: Number, flange: Number) -> Section:
        """See Section."""
        return cls(height, height, height / 2)

    def fault(self) -> str:
        """See Section."""
        return ""


@dataclass(frozen=True)
class IBeam(Section):
    """An I: two flanges of the width at the height's ends, and the web between them.

    Torsion and shear are those of thin walls; the ends warp freely.
    """

    web: Number
    flange: Number
    needs: ClassVar[tuple[str, ...]] = ("width", "web", "flange")

    @classmethod
    def of(cls, height: Number, width: Number, wall: Number, web: Number, flange: Number) -> Section:
        """See Section."""
        return cls(height, width, web, flange)

    def fault(self) -> str:
        """See Section."""
        if 2 * self.flange >= self.height:
            return f"flange {self.flange:g} m: two of them leave nothing of the height {self.height:g} m"
        return f"web {self.web:g} m is thicker than the width {self.width:g} m" if self.web > self.width else ""

    @property
    def _clear(self) -> Number:
        return self.height - 2 * self.flange

    @property
    def area(self) -> Number:
        """See Section."""
        return 2 * self.width * self.flange + self._clear * self.web

    @property
    def bending(self) -> Number:
        """See Section."""
        return (self.width * self.height**3 - (self.width - self.web) * self._clear**3) / 12

    @property
    def side(self) -> Number:
        """See Section."""
        return (2 * self.flange * self.width**3 + self._clear * self.web**3) / 12

    @property
    def torsion(self) -> Number:
        """Return the torsion constant: of each strip a third of length times thickness cubed, along its middle line."""
        return (2 * self.width * self.flange**3 + (self.height - self.flange) * self.web**3) / 3

    def shear(self, poisson: Number) -> Number:
        """See Section; thin walls."""
        deep = self.height - self.flange
        m, n = 2 * self.width * self.flange / (deep * self.web), self.width / deep
        bending = 12 + 72 * m + 150 * m**2 + 90 * m**3 + poisson * (11 + 66 * m + 135 * m**2 + 90 * m**3)
        flanges = 30 * n**2 * (m + m**2) + 5 * poisson * n**2 * (8 * m + 9 * m**2)
        return 10 * (1 + poisson) * (1 + 3 * m) ** 2 / (bending + flanges)


@dataclass(frozen=True)
class Weighted(Section):
    """A section known by its stiffnesses or masses per length: area and moments weighted by a modulus or a density,
    of which the reference value is 1 (transformed section).

    torque: the torsion constant, weighted alike; coefficient: of shear
    """

    line: Number
    across: Number
    sideways: Number
    torque: Number = None
    coefficient: Number = None

    @property
    def area(self) -> Number:
        """EA [N] or rho A [kg/m]."""
        return self.line

    @property
    def bending(self) -> Number:
        """EI [N m^2] or rho I [kg m]."""
        return self.across

    @property
    def side(self) -> Number:
        """EI [N m^2] or rho I [kg m] of bending out of the plane of motion."""
        return self.sideways

    @property
    def torsion(self) -> Number:
        """See Section."""
        return self.torque

    def shear(self, poisson: Number) -> Number:
        """See Section."""
        return self.coefficient


SECTIONS: Mapping[str, type[Section]] = {"rectangle": Rectangle, "round": Round, "tube": Tube, "i-beam": IBeam}
"""By the name that a scene gives them."""
