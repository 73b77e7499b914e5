"""The request for the eigenfrequencies of a scene."""

from __future__ import annotations

import math
from dataclasses import KW_ONLY
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic.dataclasses import dataclass

from shoal.arguments import Limit
from shoal.requests.fields import OfScene, Verify
from shoal.requests.option import Option
from shoal.requests.request import STRICT

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    import numpy.typing as npt

_ABOUT = "About the equilibrium, or about the start; where the start moves, about its steady motion."
_SPEEDS = "Campbell diagram: at these speeds of the body that turns fastest at the start [rad/s]; at 0 it rests."


def _speeds(given: Any) -> list[float]:
    """Read LOW:HIGH:COUNT, or V,V,...."""
    low, *others = str(given).split(":")
    try:
        if len(others) == 2 and 1 <= int(others[1]) <= 1000:
            first, step = float(low), (float(others[0]) - float(low)) / max(int(others[1]) - 1, 1)
            found = [first + k * step for k in range(int(others[1]))]
        else:
            found = [] if others else [float(part) for part in low.split(",")]
    except ValueError:
        found = []
    if not found or not all(0.0 <= speed < math.inf for speed in found):
        raise ValueError(f"{given!r} is not LOW:HIGH:COUNT nor a list of speeds in rad/s, such as 0:300:31")
    return found


if TYPE_CHECKING:
    Speeds = Sequence[float] | npt.NDArray[np.float64] | None
else:
    Speeds = Annotated[Any, Option(_SPEEDS, "LOW:HIGH:COUNT", shown="Sequence[float] | ndarray | None", text=_speeds)]
Count = Annotated[int, Limit("a whole number", ge=1, whole=True), Option("How many, lowest first.")]


@dataclass(frozen=True, config=STRICT)
class Modes(OfScene):
    """Find the lowest eigenfrequencies [Hz] of a scene, their damping and shapes, with gyroscopic terms."""

    _: KW_ONLY
    count: Count = 10
    about: Annotated[Literal["equilibrium", "start"], Option(_ABOUT)] = "equilibrium"
    speeds: Speeds = None
    verify: Verify = True
