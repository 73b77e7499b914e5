"""The request for the cheapest model of a scene."""

from __future__ import annotations

from typing import Annotated

from pydantic.dataclasses import dataclass

from shoal.requests.fields import At, Length, OfScene
from shoal.requests.option import Option
from shoal.requests.request import STRICT


@dataclass(frozen=True, config=STRICT)
class Select(OfScene):
    """Find the cheapest model whose estimated error at the markers is below a tolerance, with its motion."""

    tolerance: Annotated[Length, Option("Error that the markers may have [m].", "METRES")]
    at: At = None
