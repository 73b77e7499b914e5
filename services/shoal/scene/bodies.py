"""Bodies of a scene: rods, whose element chooses the beam theory and the discretisation, and those of `solids`."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from shoal.scene.record import NonNegative, Positive, Record, Vector
from shoal.scene.sections import SECTIONS, Section
from shoal.scene.solids import ModalBody, PointMass, RigidBody

Element = Literal["rigid", "ancf-cable", "ancf-quintic", "ancf-full", "simo-reissner", "director-rod", "modal"]
Quadrature = Literal["full", "reduced"]
Law = Literal["plane-stress", "lame", "enhanced", "two-point"]
End = Literal["pinned", "clamped", "free"]
SectionName = Literal["rectangle", "round", "tube", "i-beam"]

FRAMED = ("rigid", "modal")
"""Elements of a rod that moves with a frame: no element limits its step, and no section of it has a strain."""
_SHEARS = {
    "rigid": False,
    "ancf-cable": False,
    "ancf-quintic": False,
    "director-rod": False,
    "modal": False,
    "ancf-full": True,
    "simo-reissner": True,
}
_POINTS = 24
"""Quadrature points along a curved rod."""
_ONLY_FLEXIBLE = {
    "youngs_modulus": None,
    "elements": 1,
    "quadrature": "full",
    "law": "plane-stress",
    "modes": 4,
    "axial_modes": 0,
    "ends": None,
    "retardation": 0.0,
}
"""Fields of flexible rods alone, with their default values."""


@cache
def _gauss(points: int) -> tuple[tuple[float, float], ...]:
    """Nodes and weights of Gauss's rule on (0, 1)."""
    nodes, weights = np.polynomial.legendre.leggauss(points)
    return tuple(zip(((nodes + 1) / 2).tolist(), (weights / 2).tolist(), strict=True))


class Rod(Record):
    """A homogeneous rod that starts at its body's origin along the x axis."""

    kind: Literal["rod"] = "rod"
    length: Positive
    """Length of the axis [m]."""
    height: Positive
    """Thickness in the plane of motion, along the local y axis; of a `round` or `tube` section its outer diameter [m].
    """
    width: Positive | None = None
    """Thickness along the local z axis [m]; for sections `rectangle` and `i-beam`."""
    section: SectionName = "rectangle"
    """Shape of the section."""
    wall: Positive | None = None
    """Thickness of the wall of a tube [m]."""
    web: Positive | None = None
    """Thickness of the web of an I-beam [m]."""
    flange: Positive | None = None
    """Thickness of the flanges of an I-beam [m]."""
    density: Positive
    """Mass density [kg/m^3]."""
    youngs_modulus: Positive | None = None
    """Young's modulus of a flexible rod [Pa]."""
    poisson_ratio: Annotated[float, Field(gt=-1, le=0.5)] = 0.3
    """Poisson's ratio [1]."""
    element: Element = "rigid"
    """Model of the rod: rigid; `ancf-cable` (cubic, Bernoulli-Euler) or `ancf-quintic` (the same of higher order);
    `simo-reissner` (with shear); `ancf-full` (with shear and stretch of the section); `director-rod` (bends about both
    axes and twists, in space); `modal` (eigenmodes in a floating frame, in the plane). To be stated where a field of
    flexible rods is.
    """
    elements: Annotated[int, Field(ge=1, le=10_000)] = 1
    """Number of elements of equal length."""
    modes: Annotated[int, Field(ge=1, le=200)] = 4
    """Number of bending eigenmodes of a modal rod."""
    axial_modes: Annotated[int, Field(ge=0, le=201)] = 0
    """Number of axial shapes of a modal rod: an even stretch, then the shapes of the bending modes; at most `modes` +
    1.
    """
    ends: tuple[End, End] | None = None
    """How the ends of a modal rod are held in its frame; by default as the joints hold them."""
    quadrature: Quadrature = "full"
    """Integration of ancf-cable: `full` (Gauss, 5 points axial and 3 bending) or `reduced` (3 Lobatto points axial, 2
    Gauss points bending).
    """
    law: Law = "plane-stress"
    """Material law of ancf-full."""
    curvature: tuple[float, ...] = ()
    """Curvature of the unstrained axis in the local x-y plane, coefficients of a polynomial of the arc length [1/m,
    1/m^2, ...].
    """
    side_curvature: tuple[float, ...] = ()
    """Curvature of the unstrained axis of a director rod towards local z, as `curvature` [1/m, 1/m^2, ...]."""
    twist: tuple[float, ...] = ()
    """Twist of the unstrained sections of a director rod, as `curvature` [rad/m, rad/m^2, ...]."""
    end_height: Positive | None = None
    """Height at the far end of a tapered rod [m]; it changes linearly, and each element has the section of its middle.
    """
    end_width: Positive | None = None
    """Width at the far end of a tapered rod [m]."""
    retardation: NonNegative = 0.0
    """Kelvin-Voigt damping: stress is E (strain + retardation * strain rate) [s]."""
    torsion_constant: Positive | None = None
    """Torsion constant of a director rod [m^4]; by default that of the section."""
    director: Literal["y", "z"] | None = None
    """Axis of the section that the nodes of a director rod carry; by default one that a joint can share."""
    rotary_inertia: bool = False
    """Whether a rigid or modal rod has the rotary inertia of its sections; simo-reissner and ancf-full always have it,
    ancf-cable and ancf-quintic never.
    """
    limiting: ClassVar[tuple[str, ...]] = (
        *("length", "height", "width", "wall", "web", "flange"),
        *("end_height", "end_width", "twist"),
    )

    @model_validator(mode="after")
    def _nothing_is_ignored(self) -> Rod:
        if self.element == "rigid":
            flexible = {name for name, unsaid in _ONLY_FLEXIBLE.items() if getattr(self, name) != unsaid}
            if flexible and "element" not in self.model_fields_set:
                told = " and ".join(name for name in _ONLY_FLEXIBLE if name in flexible)
                raise ValueError(
                    f"element is missing, and a rigid rod has no {told}; state element: ancf-cable (or ancf-quintic, "
                    "ancf-full), or element: rigid"
                )
            return self
        if self.rotary_inertia and not self.shears and self.element != "modal":
            raise ValueError(
                f"rotary_inertia: {self.element} has none; use simo-reissner, or a rigid rod, or rotary_inertia: false"
            )
        if self.element == "modal" and self.elements != 1:
            raise ValueError(
                f"elements: a modal rod is one element, found {self.elements}; set elements to 1 as well (modes tell "
                "how finely it bends)"
            )
        if self.element == "modal" and self.axial_modes > self.modes + 1:
            raise ValueError(
                f"axial_modes: {self.axial_modes} is more than {self.modes + 1}, the even stretch and one for each mode"
            )
        if self.ends in (("clamped", "clamped"), ("clamped", "pinned"), ("pinned", "clamped")):
            raise ValueError(f"ends: {', '.join(self.ends)} keep a rod from bending with its joints; free one of them")
        for field in ("modes", "axial_modes", "ends"):
            if self.element != "modal" and getattr(self, field) != _ONLY_FLEXIBLE[field]:
                raise ValueError(f"{field}: {self.element} has elements instead; it is for element: modal")
        if self.quadrature != "full" and self.element != "ancf-cable":
            raise ValueError(f"quadrature: {self.element} has its own; {self.quadrature} is for ancf-cable")
        if self.element != "director-rod":
            fields = ("side_curvature", "twist", "torsion_constant", "director")
            ignored = [name for name in fields if getattr(self, name)]
            if ignored:
                raise ValueError(f"{ignored[0]}: {self.element} has none; it is for element: director-rod, in space")
        if self.law != "plane-stress" and self.element != "ancf-full":
            raise ValueError(f"law: {self.law} is for ancf-full; {self.element} has no choice of law")
        return self

    @model_validator(mode="after")
    def _section_is_defined(self) -> Rod:
        needs = SECTIONS[self.section].needs
        for field in ("width", "wall", "web", "flange"):
            if (getattr(self, field) is None) == (field in needs):
                raise ValueError(
                    f"{field} is missing; section {self.section} needs it (m)"
                    if field in needs
                    else f"{field}: section {self.section} has none"
                )
        if self.end_width is not None and "width" not in needs:
            raise ValueError(f"end_width: section {self.section} has no width; state end_height, its diameter there")
        if self.element == "ancf-full" and self.section != "rectangle":
            raise ValueError(f"section: that of ancf-full is a rectangle, found {self.section}; use simo-reissner")
        for end in (0.0, 1.0):
            if fault := self.section_at(end).fault():
                raise ValueError(fault)
        return self

    @model_validator(mode="after")
    def _slender_and_complete(self) -> Rod:
        if self.height > self.length:
            raise ValueError(f"height {self.height:g} m is larger than the length {self.length:g} m; a rod is slender")
        if self.width is not None and self.width > self.length:
            raise ValueError(f"width {self.width:g} m is larger than the length {self.length:g} m; a rod is slender")
        if self.element != "rigid" and self.youngs_modulus is None:
            raise ValueError(f"youngs_modulus is missing; element {self.element} needs it (Pa)")
        if self.element == "modal" and self.curvature:
            raise ValueError("curvature: a modal rod is straight; use ancf-cable, ancf-quintic or simo-reissner")
        if self.element == "ancf-full":
            if self.curvature:
                raise ValueError("curvature: an ancf-full rod is straight; use simo-reissner or ancf-cable")
            if self.retardation:
                raise ValueError("retardation: ancf-full has no material damping; use simo-reissner or ancf-cable")
            if self.poisson_ratio >= 0.5:
                raise ValueError(f"poisson_ratio {self.poisson_ratio:g} must be below 0.5 for ancf-full")
        return self

    @model_validator(mode="after")
    def _turns_are_seen(self) -> Rod:
        turn, most = self._largest_turn() if self.twist else 0.0, math.pi
        if turn > most:
            raise ValueError(
                f"twist: the section turns by {turn:.3g} rad within an element, where half a turn is the most "
                f"that it can tell; use at least {math.ceil(self.elements * turn / most)} elements"
            )
        return self

    def _largest_turn(self) -> float:
        """Return the largest twist of the unstrained section over an element [rad]."""
        ends = [self.length * k / self.elements for k in range(self.elements + 1)]
        turns = [sum(k * s ** (power + 1) / (power + 1) for power, k in enumerate(self.twist)) for s in ends]
        return max(abs(after - before) for before, after in pairwise(turns))

    @property
    def winding(self) -> float:
        """Angle [rad] by which the unstrained section would turn along the rod, were it as fast as at the fastest."""
        shapes = self.curvature, self.side_curvature, self.twist
        rates = [
            [sum(k * (x * self.length) ** power for power, k in enumerate(shape)) for shape in shapes]
            for x, _ in (*_gauss(_POINTS), (0.0, 0), (1.0, 0))
        ]
        return self.length * max(math.hypot(*rate) for rate in rates)

    @property
    def shears(self) -> bool:
        """Return whether its element has shear and the rotary inertia of its sections."""
        return _SHEARS[self.element]

    @property
    def mesh(self) -> dict[str, int]:
        """Return the fields that define the mesh of a flexible rod, and their numbers."""
        if self.element == "modal":
            return {"modes": self.modes, "axial_modes": self.axial_modes}
        return {} if self.element == "rigid" else {"elements": self.elements}

    def by_elements(self, element: str, count: int) -> dict[str, Any]:
        """Return the fields that give this rod `count` elements of a kind."""
        fields: dict[str, Any] = {"element": element, "elements": count}
        if self.element == "modal":
            fields |= {name: _ONLY_FLEXIBLE[name] for name in ("modes", "axial_modes", "ends")}
            fields["rotary_inertia"] = False
        return fields

    @property
    def straight(self) -> bool:
        """Return whether the unstrained rod is neither curved nor twisted."""
        return not (self.curvature or self.side_curvature or self.twist)

    @property
    def tapered(self) -> bool:
        """Return whether the section changes along the rod."""
        return self.end_height is not None or self.end_width is not None

    def section_at(self, x: Any) -> Section:
        """The section at the fraction x of the length."""
        return self._section_by(lambda here, there: here + (there - here) * x)

    @property
    def thinnest(self) -> Section:
        """A section that no place of the rod falls below in any length."""
        return self._section_by(np.minimum)

    def _section_by(self, tapered: Callable[[Any, Any], Any]) -> Section:
        """The section whose height and width follow from those at both ends, where these differ."""
        height, width = (
            here if here is None or there is None else tapered(here, there)
            for here, there in ((self.height, self.end_height), (self.width, self.end_width))
        )
        return SECTIONS[self.section].of(height, width, self.wall, self.web, self.flange)

    @property
    def mass(self) -> float:
        """Mass [kg]."""
        total: float = sum(mass for mass, _ in self._pieces())
        return total

    @property
    def inertia(self) -> float:
        """Moment of inertia about the centre of mass [kg m^2], of a slender rod unless `rotary_inertia` says more."""
        x, y = self.centre_of_mass
        total: float = sum(mass * abs(place - x - 1j * y) ** 2 for mass, place in self._pieces())
        return total + self.section_inertia[0] if self.rotary_inertia else total

    @property
    def section_inertia(self) -> tuple[float, float]:
        """The integrals of y^2 and of z^2 over the mass of all sections [kg m^2], y along their height."""
        parts = [(m / s.area, s) for (m, _), s in zip(self._pieces(), self._sections(), strict=True)]
        return sum(part * s.bending for part, s in parts), sum(part * s.side for part, s in parts)

    @property
    def centre_of_mass(self) -> Vector:
        """Position of the centre of mass in the body's frame [m]."""
        centre = sum(mass * place for mass, place in self._pieces()) / self.mass
        return (centre.real, centre.imag)

    def _pieces(self) -> list[tuple[Any, Any]]:
        """Masses [kg] at places x + iy [m] that have the rod's mass, centre and inertia (Gauss's quadrature)."""
        pieces = []
        for (x, weight), section in zip(self._rule(), self._sections(), strict=True):
            pieces.append((self.density * section.area * self.length * weight, self.axis(x * self.length)))
        return pieces

    def _sections(self) -> list[Section]:
        """The sections of the pieces."""
        return [self.section_at(x) for x, _ in self._rule()]

    def _rule(self) -> tuple[tuple[float, float], ...]:
        """Nodes as fractions of the length, and weights."""
        return _gauss(_POINTS if self.curvature else 3)

    def axis(self, s: Any) -> Any:
        """Point x + iy [m] of the unstrained axis at the arc length s."""
        if not self.curvature:
            return s + 0j
        return sum(weight * s * np.exp(1j * self.turn(x * s)) for x, weight in _gauss(_POINTS))

    def turn(self, s: Any) -> Any:
        """Angle [rad] of the unstrained axis at the arc length s."""
        return sum(k * s ** (power + 1) / (power + 1) for power, k in enumerate(self.curvature)) + 0.0 * s

    @property
    def axial_stiffness(self) -> float:
        """EA [N] at the start."""
        assert self.youngs_modulus is not None
        stiffness: float = self.youngs_modulus * self.section_at(0.0).area
        return stiffness

    @property
    def bending_stiffness(self) -> float:
        """EI [N m^2] at the start, bending in the plane of motion."""
        assert self.youngs_modulus is not None
        stiffness: float = self.youngs_modulus * self.section_at(0.0).bending
        return stiffness

    @property
    def points(self) -> dict[str, Vector]:
        """Named points in the body's frame [m]; on a flexible rod they are places on its axis."""
        if self.element != "rigid" or not self.curvature:
            return {"start": (0.0, 0.0), "centre": (self.length / 2, 0.0), "end": (self.length, 0.0)}
        middle, end = self.axis(self.length / 2), self.axis(self.length)
        return {"start": (0.0, 0.0), "centre": (middle.real, middle.imag), "end": (end.real, end.imag)}


Body = Annotated[Rod | RigidBody | ModalBody | PointMass, Field(discriminator="kind")]
