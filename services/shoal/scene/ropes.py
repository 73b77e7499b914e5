"""Ropes over pulleys, drums and eyes."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from shoal.scene.attachments import Attachment, Tie
from shoal.scene.contact_law import ContactLaw
from shoal.scene.record import NonNegative, Positive


class RopePlace(Attachment):
    """An end of a rope, fixed at a place or, with a radius, wound on a drum about it."""

    radius: NonNegative = 0.0
    """Radius of the drum or pulley [m]; 0 of a fixed end or an eye."""
    side: Literal["left", "right"] = "left"
    """Side of the rope from first to second on which the centre is: left where the rope turns counter-clockwise."""

    @property
    def signed_radius(self) -> Any:
        """The radius, positive where the rope turns counter-clockwise around the place [m]."""
        return self.radius if self.side == "left" else -self.radius


class RopeGuide(RopePlace):
    """A place that a rope goes over: an eye, or a pulley on which it slips or which it turns."""

    turns: Annotated[int, Field(ge=0)] = 0
    """Whole turns of the rope around it at the start, besides the part of a turn between both spans."""
    grips: bool = False
    """Whether the rope turns the body and does not slip, so that both parts have lengths of their own."""

    @model_validator(mode="after")
    def _has_a_radius(self) -> RopeGuide:
        if not np.any(self.radius) and (self.grips or self.turns):
            raise ValueError(f"{'grips' if self.grips else 'turns'}: is of a pulley; state its radius")
        return self


class Rope(Tie):
    """A rope, belt or cable without mass over pulleys and drums, whose length its spans share."""

    kind: Literal["rope"] = "rope"
    turned: ClassVar[tuple[str, ...]] = ()
    first: RopePlace
    """Where it begins."""
    second: RopePlace
    """Where it ends."""
    over: tuple[RopeGuide, ...] = ()
    """What it goes over between, in this order."""
    length: Positive | None = None
    """Its length from end to end, along spans and arcs, without what is wound on drums [m]; by default that of the
    start.
    """
    keeps: Literal["at-most", "exactly"] = "at-most"
    """Whether it goes slack where it would push, or keeps its length and pushes as well, as a chain in a tube."""
    restitution: Annotated[float, Field(ge=0, le=1)] = 0.0
    """Rate after it is taut over that before [1]."""
    law: ContactLaw | None = None
    """Force of a rope that stretches, by its elongation, in place of one that does not."""

    @model_validator(mode="after")
    def _one_law(self) -> Rope:
        if self.keeps == "exactly":
            for field in ("restitution", "law", "length"):
                if np.any(getattr(self, field)):
                    raise ValueError(f"{field}: is of a rope that keeps at-most its length, not that of the start")
        if self.law is not None and np.any(self.restitution):
            raise ValueError("restitution: is of a rope that does not stretch; state that of the law")
        if self.length is not None:
            ends = [("first", self.first), ("second", self.second)]
            found = [f"over.{k}.grips" for k, guide in enumerate(self.over) if guide.grips]
            found += [f"{name}.radius" for name, end in ends if np.any(end.radius)]
            if found:
                raise ValueError(f"length: is of a rope of one part with fixed ends; leave it or {found[0]} out")
        return self

    def drums(self) -> dict[str, RopePlace]:
        """Return the places whose bodies turn with the rope, by the path of their field."""
        found = {name: end for name, end in (("first", self.first), ("second", self.second)) if np.any(end.radius)}
        return found | {f"over.{k}": guide for k, guide in enumerate(self.over) if guide.grips}
