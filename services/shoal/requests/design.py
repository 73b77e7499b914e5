"""The request for the design of an experiment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import KW_ONLY
from typing import Annotated, Any, Literal

from pydantic.dataclasses import dataclass

from shoal.arguments import Limit
from shoal.requests import texts
from shoal.requests.fields import Data, OfProblem
from shoal.requests.option import Option
from shoal.requests.request import STRICT

_ABOUT = "About the answer of the data, or about the start; else the first, where there are data."
_NOISE = "Standard deviation of positions [m]; else the problem's."
_ANGLE_NOISE = "Standard deviation of angles [rad]; else the problem's."
_SENSOR_NOISE = "Weigh acceleration, rate, force, torque or strain too, with this standard deviation in SI units."
_DURATION = "Of the measurement [s]; else that of the data."
_RATE = "Samples per second; else that of the data."
_PARAMETER = "The one to be known better; else the weakest."


def _sizes(given: Any) -> dict[str, float]:
    """Read SENSOR=SIZE entries."""
    found = texts.pairs("SENSOR=SIZE")(given)
    try:
        return {name: float(size) for name, size in found.items()}
    except ValueError:
        raise ValueError(f"{', '.join(texts.listed(given))} is not SENSOR=SIZE") from None


@dataclass(frozen=True, config=STRICT)
class Design(OfProblem):
    """Say what to measure to know the parameters of a problem best: which sensor where, how long and how often."""

    data: Data = None
    _: KW_ONLY
    about: Annotated[Literal["answer", "start"] | None, Option(_ABOUT)] = None
    noise: Annotated[Annotated[float, Limit("a standard deviation", "m", gt=0)] | None, Option(_NOISE, "METRES")] = None
    angle_noise: Annotated[
        Annotated[float, Limit("a standard deviation", "rad", gt=0)] | None, Option(_ANGLE_NOISE, "RADIANS")
    ] = None
    sensor_noise: Annotated[
        Mapping[str, float] | None, Option(_SENSOR_NOISE, "SENSOR=SIZE", many=True, text=_sizes)
    ] = None
    duration: Annotated[Annotated[float, Limit("a time", "s", gt=0)] | None, Option(_DURATION, "SECONDS")] = None
    rate: Annotated[Annotated[float, Limit("a frequency", "Hz", gt=0)] | None, Option(_RATE, "HERTZ")] = None
    parameter: Annotated[str | None, Option(_PARAMETER, "NAME")] = None
