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
from shoal.scene.sections import SECTIONS, Rectangle, Section, Weighted
from shoal.scene.solids import ModalBody, PointMass, RigidBody

Element = Literal["rigid", "ancf-cable", "ancf-quintic", "ancf-full", "simo-reissner", "director-rod", "modal"]
Quadrature = Literal["full", "reduced"]
Law = Literal["plane-stress", "lame", "enhanced", "two-point"]
End = Literal["pinned", "clamped", "free"]
SectionName = Literal["rectangle", "round", "tube", "i-beam", "numbers"]

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
    **dict.fromkeys(("EA", "EI", "EI_side", "GJ", "GA")),
}
"""Fields of flexible rods alone, with their default values."""
_SHAPED = ("width", "wall", "web", "flange", "end_height", "end_width", "density", "youngs_modulus", "torsion_constant")
"""Fields of rods whose section has a shape and one material."""
_NUMBERS = {
    **{"rho_A": "kg/m", "rho_I": "kg m", "rho_I_side": "kg m"},
    **{"EA": "N", "EI": "N m^2", "EI_side": "N m^2", "GJ": "N m^2", "GA": "N"},
}
"""Fields of rods whose section is stated by numbers, with their units."""
_POISSON = 0.3
"""Poisson's ratio by default: that of steel."""


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
    """Shape of the section; `numbers` for stiffnesses and masses per length, of composite or measured rods."""
    wall: Positive | None = None
    """Thickness of the wall of a tube [m]."""
    web: Positive | None = None
    """Thickness of the web of an I-beam [m]."""
    flange: Positive | None = None
    """Thickness of the flanges of an I-beam [m]."""
    density: Positive | None = None
    """Mass density [kg/m^3]; of every section but `numbers`."""
    youngs_modulus: Positive | None = None
    """Young's modulus of a flexible rod [Pa]."""
    rho_A: Positive | None = None
    """Mass per length [kg/m], of section `numbers`."""
    rho_I: Positive | None = None
    """Rotary inertia per length about z, for bending in the plane of motion [kg m]."""
    rho_I_side: Positive | None = None
    """Rotary inertia per length about y, for bending out of that plane [kg m]; by default as `rho_I`."""
    EA: Positive | None = None
    """Axial stiffness [N]."""
    EI: Positive | None = None
    """Bending stiffness in the plane of motion [N m^2]."""
    EI_side: Positive | None = None
    """Bending stiffness out of that plane [N m^2]; by default as `EI`."""
    GJ: Positive | None = None
    """Torsional stiffness [N m^2]."""
    GA: Positive | None = None
    """Shear stiffness, with its coefficient: shear force over shear angle [N]."""
    poisson_ratio: Annotated[float, Field(gt=-1, le=0.5)] = _POISSON
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
        if fault := self._number_fault():
            raise ValueError(fault)
        needs = () if self.section == "numbers" else SECTIONS[self.section].needs
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

    def _number_fault(self) -> str:
        """Return which field of its section is missing or superfluous; empty if none is."""
        if self.section != "numbers":
            if found := [name for name in _NUMBERS if getattr(self, name) is not None]:
                return (
                    f"{found[0]}: section {self.section} has a shape and a density instead; it is for section: numbers"
                )
            return "density is missing (kg/m^3)" if self.density is None else ""
        if self.element == "ancf-full":
            return "section: ancf-full needs a rectangle, whose stretch numbers do not define; use simo-reissner"
        ignored = [name for name in _SHAPED if getattr(self, name) is not None]
        ignored += ["poisson_ratio"] if self.poisson_ratio != _POISSON else []
        if ignored:
            return f"{ignored[0]}: section numbers has none; state {', '.join(_NUMBERS)}"
        if missing := self.lacking(self.element):
            return (
                f"{missing[0]} is missing; element {self.element} of section numbers needs it ({_NUMBERS[missing[0]]})"
            )
        return ""

    def lacking(self, element: str) -> list[str]:
        """Return which numbers of its section are missing for an element; none for a section with a shape."""
        needs = ["rho_A"] if element == "rigid" else ["rho_A", "EA", "EI"]
        needs += {"simo-reissner": ["GA"], "director-rod": ["GJ"]}.get(element, [])
        if self.rotary_inertia or element in ("simo-reissner", "director-rod"):
            needs.append("rho_I")
        return [name for name in needs if self.section == "numbers" and getattr(self, name) is None]

    @model_validator(mode="after")
    def _slender_and_complete(self) -> Rod:
        if self.height > self.length:
            raise ValueError(f"height {self.height:g} m is larger than the length {self.length:g} m; a rod is slender")
        if self.width is not None and self.width > self.length:
            raise ValueError(f"width {self.width:g} m is larger than the length {self.length:g} m; a rod is slender")
        if self.element != "rigid" and self.section != "numbers" and self.youngs_modulus is None:
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

    @property
    def modulus(self) -> Any:
        """Young's modulus of `section_at` [Pa]: 1 for a section by numbers, whose area is EA; None if unknown."""
        return self.youngs_modulus if self.section != "numbers" else None if self.lacking("modal") else 1.0

    @property
    def mass_field(self) -> str:
        """Return the field to which its mass is proportional."""
        return "rho_A" if self.section == "numbers" else "density"

    @property
    def bending_fields(self) -> tuple[str, ...]:
        """Return the fields to which its bending stiffness is proportional."""
        if self.section != "numbers":
            return ("youngs_modulus",)
        return ("EI",) if self.EI_side is None else ("EI", "EI_side")

    def masses_at(self, x: Any) -> tuple[Any, Section]:
        """The density [kg/m^3] and the section at the fraction x of the length: 1 and rho A for one by numbers."""
        if self.section != "numbers":
            return self.density, self.section_at(x)
        assert self.rho_A is not None
        height, line = self.height, self.rho_A
        across = line * height**2 / 12 if self.rho_I is None else self.rho_I
        return 1.0, Weighted(height, height, line, across, across if self.rho_I_side is None else self.rho_I_side)

    def section_at(self, x: Any) -> Section:
        """The section at the fraction x of the length, as it resists: weighted by the modulus if by numbers."""
        return self._section_by(lambda here, there: here + (there - here) * x)

    @property
    def thinnest(self) -> Section:
        """A section that no place of the rod falls below in any length."""
        return self._section_by(np.minimum)

    def _section_by(self, tapered: Callable[[Any, Any], Any]) -> Section:
        """The section whose height and width follow from those at both ends, where these differ."""
        if self.section == "numbers":
            return self._weighted()
        height, width = (
            here if here is None or there is None else tapered(here, there)
            for here, there in ((self.height, self.end_height), (self.width, self.end_width))
        )
        return SECTIONS[self.section].of(height, width, self.wall, self.web, self.flange)

    def _weighted(self) -> Weighted:
        """The section by its stiffnesses; without GA as much shear as a homogeneous square has."""
        nu, height = self.poisson_ratio, self.height
        over = 2 * (1 + nu)  # E/G, by which elements divide
        shear = Rectangle(height, height).shear(nu) if self.GA is None or self.EA is None else self.GA * over / self.EA
        twist = None if self.GJ is None else self.GJ * over
        side = self.EI if self.EI_side is None else self.EI_side
        return Weighted(height, height, self.EA, self.EI, side, twist, shear)

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
        parts = [(m / s.area, s) for (m, _), (_, s) in zip(self._pieces(), self._sections(), strict=True)]
        return sum(part * s.bending for part, s in parts), sum(part * s.side for part, s in parts)

    @property
    def centre_of_mass(self) -> Vector:
        """Position of the centre of mass in the body's frame [m]."""
        centre = sum(mass * place for mass, place in self._pieces()) / self.mass
        return (centre.real, centre.imag)

    def _pieces(self) -> list[tuple[Any, Any]]:
        """Masses [kg] at places x + iy [m] that have the rod's mass, centre and inertia (Gauss's quadrature)."""
        pieces = []
        for (x, weight), (density, section) in zip(self._rule(), self._sections(), strict=True):
            pieces.append((density * section.area * self.length * weight, self.axis(x * self.length)))
        return pieces

    def _sections(self) -> list[tuple[Any, Section]]:
        """The densities and sections of the pieces."""
        return [self.masses_at(x) for x, _ in self._rule()]

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
        stiffness: float = self.modulus * self.section_at(0.0).area
        return stiffness

    @property
    def bending_stiffness(self) -> float:
        """EI [N m^2] at the start, bending in the plane of motion."""
        stiffness: float = self.modulus * self.section_at(0.0).bending
        return stiffness

    @property
    def points(self) -> dict[str, Vector]:
        """Named points in the body's frame [m]; on a flexible rod they are places on its axis."""
        if self.element != "rigid" or not self.curvature:
            return {"start": (0.0, 0.0), "centre": (self.length / 2, 0.0), "end": (self.length, 0.0)}
        middle, end = self.axis(self.length / 2), self.axis(self.length)
        return {"start": (0.0, 0.0), "centre": (middle.real, middle.imag), "end": (end.real, end.imag)}


Body = Annotated[Rod | RigidBody | ModalBody | PointMass, Field(discriminator="kind")]
