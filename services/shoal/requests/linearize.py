"""The request for a linear model of a scene."""

from __future__ import annotations

import re
from dataclasses import KW_ONLY
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import model_validator
from pydantic.dataclasses import dataclass

from shoal.requests.fields import Instant, OfScene
from shoal.requests.option import Option
from shoal.requests.request import STRICT, wrong

if TYPE_CHECKING:
    from collections.abc import Sequence

_INPUTS = "Signals, or loads to whose torque or scale something is added."
_LOOP = "Break the loop at this signal: its open loop, with gain and phase margin."
_REQUIRE = "Of a loop what must hold: gain_margin, gain_reduction, phase_margin [deg], delay_margin [s]."
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
    Requirements = Sequence[str]
else:
    Inputs = Annotated[list[str], Option(_INPUTS, "NAME,NAME,...", shown="Sequence[str]", text=_listed)]
    Requirements = Annotated[
        list[str], Option(_REQUIRE, '"MARGIN > NUMBER"', many=True, shown="Sequence[str]", text=list)
    ]
    Outputs = Annotated[list[str], Option(_OUTPUTS, "FORMULA,...", shown="Sequence[str]", text=_listed)]


@dataclass(frozen=True, config=STRICT)
class Linearize(OfScene):
    """Find the linear model x' = A x + B u, y = C x + D u of a scene, for the design of controllers."""

    inputs: Inputs = ()
    outputs: Outputs = ()
    _: KW_ONLY
    about: Annotated[
        Literal["equilibrium", "start", "trajectory"],
        Option("About the equilibrium, the start, or the state that the machine has moved to at --time."),
    ] = "equilibrium"
    time: Annotated[Instant, Option("Loads and drives are those at this time [s].", "T")] = 0.0
    loop: Annotated[str, Option(_LOOP, "SIGNAL")] = ""
    require: Requirements = ()

    @model_validator(mode="after")
    def _inputs_or_a_loop(self) -> Self:
        if not self.inputs and not self.loop:
            wrong("inputs", "name one or more signals or loads, or a loop that is broken at a signal")
        return self
