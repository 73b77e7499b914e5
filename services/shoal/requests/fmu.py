"""The request for a scene as a unit of the Functional Mock-up Interface."""

from __future__ import annotations

from dataclasses import KW_ONLY
from typing import Annotated, Literal

from pydantic.dataclasses import dataclass

from shoal.requests.fields import OfScene
from shoal.requests.option import Front, Option
from shoal.requests.request import STRICT

_PARAMETER = "Numbers of the scene that a host may set; else gravity and the stated initial angles."
_INPUT = "Scales or torques of loads, or drives, that a host may change during the run."
_FRONTS: tuple[Front, ...] = ("command", "form")


@dataclass(frozen=True, config=STRICT)
class Fmu(OfScene):
    """Write a scene as an FMI unit for co-simulation. A host needs this installation to run it."""

    _: KW_ONLY
    parameter: Annotated[tuple[str, ...], Option(_PARAMETER, "PATH", many=True, old="parameters", fronts=_FRONTS)] = ()
    input: Annotated[tuple[str, ...], Option(_INPUT, "PATH", many=True, old="inputs", fronts=_FRONTS)] = ()
    fmi: Annotated[Literal["2", "3"], Option("Version: 2.0 or 3.0.", fronts=("command",))] = "2"
