"""Contacts between bodies: what touches what, how it rebounds and how it rubs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from shoal.scene.attachments import origin_of_ground
from shoal.scene.contact_law import ContactLaw
from shoal.scene.joints import Attachment
from shoal.scene.polygons import check_polygon
from shoal.scene.record import Angle, Axis, NonNegative, Positive, Record

SHAPES = ("line", "plane", "hole", "polygon", "cam")
FULL = 2.0 * math.pi


class Cam(Record):
    """The outline of a cam about a place: its radius over the angle in the body, counter-clockwise from the x axis.

    A periodic cubic spline leads through the points.
    """

    table: Annotated[tuple[tuple[float, Positive], ...], Field(min_length=3)]
    """Angles [rad] with radii [m]; the angles grow, by less than the period."""
    period: Annotated[float, Field(gt=0, le=FULL * (1.0 + 1e-9))] = FULL
    """Angle [rad] after which the outline repeats, a full turn over a whole number of lobes."""

    @property
    def lobes(self) -> int:
        """Return how often the outline repeats in a turn."""
        return round(FULL / self.period)

    @model_validator(mode="after")
    def _closes(self) -> Cam:
        if abs(self.lobes * self.period / FULL - 1.0) > 1e-9:
            raise ValueError(
                f"period: must be 2 pi over a whole number, as 6.283185307179586, found {self.period:.12g}"
            )
        angles = [angle for angle, _ in self.table]
        for k, (one, other) in enumerate(pairwise([*angles, angles[0] + self.period]), 1):
            if not one < other:
                end = k == len(angles)
                why = (
                    f"must be less than a period beyond the first one, {angles[0]:g}"
                    if end
                    else f"must grow from {one:g}"
                )
                raise ValueError(f"table.{k - end}: {why}, found {one if end else other:g}")
        return self


class ContactSurface(Attachment):
    """A place on a body and the surface there: a point, circle or sphere, a line, plane, hole, polygon or cam."""

    radius: NonNegative = 0.0
    """Radius of a circle, in space of a sphere, about the place [m]; 0 of a point."""
    axis: Axis | None = None
    """Axle of a disc of that radius in space, as it points at the start, in place of a sphere [1]."""
    line: Angle | None = None
    """Angle [rad] in the body's frame of a line through the place, in the plane; the other body is on its left."""
    plane: Axis | None = None
    """Normal of a plane through the place, as it points at the start, in space; it leads to the other body [1]."""
    hole: Positive | None = None
    """Radius of a hole about the place, in space hollow sphere, in which the other body is [m]."""
    polygon: tuple[tuple[float, float], ...] | None = None
    """Corners of a polygon from the place, in the axes of the body, in the plane [m]: counter-clockwise of a solid,
    clockwise of a room in which the other body is."""

    cam: Cam | None = None
    """Outline of a cam about the place, in the plane."""

    @property
    def shape(self) -> str:
        """Return `line`, `plane`, `hole`, `polygon` or `cam`, or `round` of a circle, a sphere or a point."""
        return next((name for name in SHAPES if getattr(self, name) is not None), "round")

    @model_validator(mode="after")
    def _one_shape(self) -> ContactSurface:
        stated = ["radius"] * bool(np.any(self.radius)) + [name for name in SHAPES if getattr(self, name) is not None]
        if len(stated) > 1:
            raise ValueError(f"{stated[1]}: {stated[0]} is stated as well; a surface has one shape")
        if self.axis is not None and not np.all(self.radius):
            raise ValueError("axis: is that of a disc; state its radius")
        if self.polygon is not None:
            check_polygon(self.polygon)
        return self


Side = Annotated[ContactSurface, BeforeValidator(origin_of_ground)]


class Contact(Record):
    """Two surfaces that do not penetrate: they strike, rest, slide, stick and separate."""

    first: Side
    """A point, a circle or a sphere."""
    second: Side
    """The surface that it may touch."""
    restitution: Annotated[float, Field(ge=0, le=1)] = 0.0
    """Normal rate after an impact over that before [1] (Newton's law in the form of Moreau)."""
    tangential_restitution: Annotated[float, Field(ge=0, le=1)] = 0.0
    """Slip rate after an impact in which the surfaces stick over that before, with the opposite sign [1]."""
    mu: NonNegative = 0.0
    """Coefficient of friction by Coulomb's law, of slip [1]; below the limit the surfaces stick."""
    mu_static: NonNegative | None = None
    """Coefficient of the limit of stick [1]; by default `mu`."""
    rolling: bool = False
    """Whether the surfaces stick however large the force of friction has to be."""
    law: ContactLaw | None = None
    """Force of surfaces that give way, in place of rigid ones with a restitution."""

    @property
    def rubs(self) -> bool:
        """Return whether it has friction, in any lane."""
        return self.rolling or bool(np.any(self.mu)) or bool(np.any(self.mu_static or 0.0))

    @model_validator(mode="after")
    def _two_surfaces(self) -> Contact:
        if self.first.shape != "round" and (self.first.shape, self.second.shape) != ("polygon", "line"):
            raise ValueError(f"first.{self.first.shape}: the first side is a point or round; let this be the second")
        if self.first.body == self.second.body:
            raise ValueError(f"second.body: {self.second.body!r} is the first body as well; a contact needs two")
        if self.second.axis is not None or (self.first.axis is not None and self.second.plane is None):
            raise ValueError("axis: a disc is the first side, on a plane")
        if self.second.shape == "round" and not np.all(np.add(self.first.radius, self.second.radius) > 0.0):
            raise ValueError("second: is a point as the first side is; state a radius, a line, a plane or a hole")
        if self.second.hole is not None and not np.all(self.second.hole > self.first.radius):
            raise ValueError(
                f"second.hole: must be larger than the radius of the first side, found {self.second.hole:g} and "
                f"{self.first.radius:g}"
            )
        if self.law is not None and (np.any(self.restitution) or np.any(self.tangential_restitution)):
            raise ValueError("restitution: is of rigid surfaces; state that of the law")
        if self.law is not None and self.second.polygon is not None and not np.all(self.first.radius):
            raise ValueError("law: of a polygon into which a point sinks past its corners; state first.radius")
        if self.mu_static is not None and np.any(self.mu_static < self.mu):
            raise ValueError(f"mu_static: must be at least mu, found {self.mu_static:g} and {self.mu:g}")
        return self


def check_contacts(scene: Any, contacts: Mapping[str, Contact]) -> None:
    """Raises ValueError where surfaces are of other dimensions than the scene, or of bodies that have none.

    contacts: by the path of what states them
    """
    for path, contact in contacts.items():
        wrong, right = ("line", "plane") if scene.dimensions == 3 else ("plane", "line")
        if contact.second.shape == wrong:
            where = f"{path}.second.{wrong}"
            raise ValueError(f"{where}: with dimensions: {scene.dimensions} a flat surface is a {right}")
        if scene.dimensions == 3 and contact.second.shape in ("polygon", "cam"):
            where = f"{path}.second.{contact.second.shape}"
            raise ValueError(f"{where}: is of the plane; with dimensions: 3 state a plane, or a sphere")
        for field in ("first", "second"):
            side = getattr(contact, field)
            body = scene.bodies.get(side.body)
            kind = getattr(body, "kind", "")
            turns = kind == "rigid-body" or getattr(body, "element", "") == "rigid"
            if body is None or turns:
                continue
            if side.axis is not None:
                raise ValueError(f"{path}.{field}.axis: {side.body} is no rigid body, which a disc needs")
            if side.shape in ("line", "plane", "polygon", "cam"):
                where = f"{path}.{field}.{side.shape}"
                raise ValueError(f"{where}: {side.body} is no rigid body, which such a surface needs")
            if contact.rubs and kind != "point-mass" and np.any(side.radius or side.hole or 0.0):
                raise ValueError(
                    f"{path}.{field}: friction at a radius of {side.body}, which bends; weld a rigid body to it, or "
                    "leave out mu"
                )
