"""The request for a linear model of a scene."""

from __future__ import annotations

import re
from dataclasses import KW_ONLY
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field as Constraint
from pydantic.dataclasses import dataclass

from shoal.requests.fields import Instant, OfScene
from shoal.requests.option import Option
from shoal.requests.request import STRICT

if TYPE_CHECKING:
    from collections.abc import Sequence

_INPUTS = "Signals, or loads to whose torque or scale something is added."
_OUTPUTS = "Formulas of measures and signals; by default the places that are states."


def _listed(given: Any) -> list[str]:
    """Read entries between commas that are not in brackets, or a list."""
    texts = given if isinstance(given, list | tuple) else [given]
    found = [part.strip() for text in texts for part in re.split(r",(?![^(]*\))", str(text))]
    if not all(found):
        raise ValueError("there is nothing before, after or between the commas")
    return found


if TYPE_CHECKING:
    Inputs = Sequence[str]
    Outputs = Sequence[str]
else:
    Inputs = Annotated[
        list[str], Constraint(min_length=1), Option(_INPUTS, "NAME,NAME,...", shown="Sequence[str]", text=_listed)
    ]
    Outputs = Annotated[list[str], Option(_OUTPUTS, "FORMULA,...", shown="Sequence[str]", text=_listed)]


@dataclass(frozen=True, config=STRICT)
class Linearize(OfScene):
    """Find the linear model x' = A x + B u, y = C x + D u of a scene, for the design of controllers."""

    inputs: Inputs
    outputs: Outputs = ()
    _: KW_ONLY
    about: Annotated[
        Literal["equilibrium", "start", "trajectory"],
        Option("About the equilibrium, the start, or the state that the machine has moved to at --time."),
    ] = "equilibrium"
    time: Annotated[Instant, Option("Loads and drives are those at this time [s].", "T")] = 0.0
