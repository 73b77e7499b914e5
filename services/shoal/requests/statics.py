"""The request for the static equilibrium of a scene."""

from __future__ import annotations

from dataclasses import KW_ONLY
from typing import Annotated, Self

from pydantic import model_validator
from pydantic.dataclasses import dataclass

from shoal.requests.fields import Instant, Length, OfScene, Verify, check_tolerance
from shoal.requests.option import Option
from shoal.requests.request import STRICT

_TOLERANCE = "Double the elements of the rods until the error at the markers stays below [m]."


@dataclass(frozen=True, config=STRICT)
class Statics(OfScene):
    """Find where a scene comes to rest without dry friction, drives standing still, and if it is stable there."""

    time: Annotated[Instant, Option("Loads and drives stand as they are then [s].", "T")] = 0.0
    _: KW_ONLY
    tolerance: Annotated[Length | None, Option(_TOLERANCE, "METRES")] = None
    verify: Verify = True

    @model_validator(mode="after")
    def _together(self) -> Self:
        check_tolerance(self.tolerance, self.verify)
        return self
