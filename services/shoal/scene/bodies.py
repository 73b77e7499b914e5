"""Bodies: a rod whose element decides how much of it is modelled, and a rigid body."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from shoal.scene.record import NonNegative, Positive, Record, Vector

Element = Literal["rigid", "ancf-cable"]
Quadrature = Literal["full", "reduced"]


class Rod(Record):
    """A straight, prismatic, homogeneous rod along its body's x axis, starting at its origin.

    Lengths in m, density in kg/m^3, moduli in Pa. `height` is the thickness in the plane of
    motion. `element` is the model of the rod: `rigid`, or `ancf-cable` (the gradient-deficient
    Bernoulli-Euler element) with `elements` elements of equal length. `quadrature` is `full`
    (Gauss, 5 points axial and 3 bending) or `reduced` (3 Lobatto points axial, 2 Gauss points bending).
    """

    kind: Literal["rod"] = "rod"
    length: Positive
    height: Positive
    width: Positive
    density: Positive
    youngs_modulus: Positive | None = None
    poisson_ratio: Annotated[float, Field(gt=-1, le=0.5)] = 0.3
    element: Element = "rigid"
    elements: Annotated[int, Field(ge=1, le=10_000)] = 1
    quadrature: Quadrature = "full"

    @model_validator(mode="after")
    def _slender_and_complete(self) -> Rod:
        if self.height > self.length:
            raise ValueError(f"height {self.height:g} m is larger than the length {self.length:g} m; a rod is slender")
        if self.width > self.length:
            raise ValueError(f"width {self.width:g} m is larger than the length {self.length:g} m; a rod is slender")
        if self.element != "rigid" and self.youngs_modulus is None:
            raise ValueError(f"youngs_modulus is missing; element {self.element} needs it (Pa)")
        return self

    @property
    def area(self) -> float:
        """Cross-section [m^2]."""
        return self.width * self.height

    @property
    def mass_per_length(self) -> float:
        """Line density [kg/m]."""
        return self.density * self.area

    @property
    def mass(self) -> float:
        """Mass [kg]."""
        return self.mass_per_length * self.length

    @property
    def inertia(self) -> float:
        """Moment of inertia about the centre of mass [kg m^2] of the slender rod (no rotary part)."""
        return self.mass * self.length**2 / 12

    @property
    def centre_of_mass(self) -> Vector:
        """Position of the centre of mass in the body's frame [m]."""
        return (self.length / 2, 0.0)

    @property
    def axial_stiffness(self) -> float:
        """EA [N]."""
        assert self.youngs_modulus is not None
        return self.youngs_modulus * self.area

    @property
    def bending_stiffness(self) -> float:
        """EI [N m^2], bending in the plane of motion."""
        assert self.youngs_modulus is not None
        return self.youngs_modulus * self.width * self.height**3 / 12

    @property
    def points(self) -> dict[str, Vector]:
        """Named points in the body's frame [m]."""
        return {"start": (0.0, 0.0), "centre": (self.length / 2, 0.0), "end": (self.length, 0.0)}


class RigidBody(Record):
    """A rigid body of any shape: mass [kg], inertia about the centre of mass [kg m^2], named points [m].

    The point `start` is the origin of the body's frame unless `named_points` says otherwise.
    """

    kind: Literal["rigid-body"] = "rigid-body"
    mass: Positive
    inertia: NonNegative
    centre_of_mass: Vector = (0.0, 0.0)
    named_points: dict[str, Vector] = {}
    element: Literal["rigid"] = "rigid"

    @property
    def points(self) -> dict[str, Vector]:
        """Named points in the body's frame [m]."""
        return {"start": (0.0, 0.0), **self.named_points}


Body = Annotated[Rod | RigidBody, Field(discriminator="kind")]
