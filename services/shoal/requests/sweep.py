"""The request for a scene over a grid of values."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import KW_ONLY
from typing import TYPE_CHECKING, Annotated, Any, Self

from pydantic import BeforeValidator, model_validator
from pydantic.dataclasses import dataclass

from shoal import arguments
from shoal.errors import InputError
from shoal.requests import texts
from shoal.requests.fields import Engine, Instant, OfScene, Verify
from shoal.requests.option import Option
from shoal.requests.request import STRICT

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    import numpy.typing as npt

_VARY = "Values of fields [SI], of which every combination is simulated."
_AT = "Instant [s] at which to look; else the end of the scene's duration."


def _axes(given: Any) -> Any:
    """Read PATH=LOW:HIGH:COUNT entries as values by path."""
    return {path: _axis(path, text) for path, text in texts.pairs("PATH=LOW:HIGH:COUNT")(given).items()}


def _axis(path: str, text: str) -> Any:
    import numpy as np

    try:
        low, high, count = text.split(":")
        first, last, number = float(low), float(high), int(count)
    except ValueError:
        raise ValueError(f"{path}={text} is not PATH=LOW:HIGH:COUNT, such as initial.OA.angle=0:1.5:31") from None
    if not 1 <= number <= 1_000_000 or not (math.isfinite(first) and math.isfinite(last)):
        raise ValueError(f"{path}={text}: COUNT is between 1 and 1000000, LOW and HIGH are finite")
    if number == 1 and first != last:
        raise ValueError(f"{path}={text}: one value is not at both ends; COUNT is 2 or more, or HIGH is LOW")
    return np.linspace(first, last, number)


def _grid(given: Any) -> dict[str, Any]:
    """Return values by path as arrays. Raises ValueError."""
    try:
        fields = arguments.mapping("vary", given, "fields with their values")
        return {str(path): arguments.numbers(f"vary: {path}", values) for path, values in fields.items()}
    except InputError as error:
        raise ValueError(str(error).partition(": ")[2]) from None


if TYPE_CHECKING:
    Grid = Mapping[str, Sequence[float] | npt.NDArray[np.float64]]
else:
    Grid = Annotated[
        Any,
        BeforeValidator(_grid),
        Option(_VARY, "PATH=LOW:HIGH:COUNT", many=True, shown="Mapping[str, Sequence[float] | ndarray]", text=_axes),
    ]


@dataclass(frozen=True, config=STRICT)
class Sweep(OfScene):
    """Simulate a scene over the full grid of some of its values, and return where its markers are at one instant."""

    vary: Grid
    at: Annotated[Instant | None, Option(_AT, "T", old="time")] = None
    _: KW_ONLY
    engine: Engine = "gauss"
    verify: Verify = True

    @model_validator(mode="after")
    def _together(self) -> Self:
        arguments.check_apart(self.set, self.vary)
        return self
