"""The request for the parameters of a problem from measured motion."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Self

from pydantic import model_validator
from pydantic.dataclasses import dataclass

from shoal.arguments import Limit
from shoal.requests.fields import Data, Engine, Length, OfProblem, Seconds, Seed, check_tolerance
from shoal.requests.option import HERE, Option
from shoal.requests.request import STRICT
from shoal.requests.texts import listed

if TYPE_CHECKING:
    from collections.abc import Sequence

_HOLD_OUT = "Windows from, to [s] that are predicted instead of fitted; by name of several recordings."
_METHOD = "Method of the search; the problem's by default."
_TOLERANCE = (
    "Error [m] the model may have at the markers: coarse models for the search, the cheapest good one at the end."
)
_TIME_LIMIT = "End after this time [s] with what is known."
_CHECKPOINT = "Keep the evaluations in this file; where it exists, go on from it."
_SAMPLE = "Draw from the posterior until so many draws are effective."
_PROGRESS = "Called with iteration, best fitness, mean fitness of the iteration, and evaluations so far."


def _windows(given: Any) -> Any:
    """Read [NAME=]FROM:TO entries."""
    found: dict[str, list[tuple[float, float]]] = {}
    for one in listed(given):
        name, _, span = one.rpartition("=")
        try:
            begin, end = map(float, span.split(":"))
        except ValueError:
            raise ValueError(f"{one!r} is not FROM:TO in s, such as 1.5:2, nor NAME=FROM:TO") from None
        found.setdefault(name, []).append((begin, end))
    if "" in found and len(found) > 1:
        raise ValueError("NAME=FROM:TO is needed for all of several recordings")
    return found.get("", found)


if TYPE_CHECKING:
    Windows = Sequence[tuple[float, float]] | Mapping[str, Sequence[tuple[float, float]]] | None
else:
    Windows = Annotated[
        Any,
        Option(
            _HOLD_OUT,
            "[NAME=]FROM:TO",
            many=True,
            shown="Sequence[tuple[float, float]] | Mapping[str, Sequence[tuple[float, float]]] | None",
            text=_windows,
        ),
    ]
Count = Annotated[int, Limit("a whole number", ge=0, whole=True)]


@dataclass(frozen=True, config=STRICT)
class Identify(OfProblem):
    """Find the parameters of a problem from measured motion, with intervals and a verdict."""

    data: Data = None
    _: KW_ONLY
    hold_out: Windows = None
    method: Annotated[str | None, Option(_METHOD, "NAME", names="methods")] = None
    seed: Seed = 0
    engine: Engine = "gauss"
    tolerance: Annotated[Length | None, Option(_TOLERANCE, "METRES")] = None
    time_limit: Annotated[Seconds | None, Option(_TIME_LIMIT, "SECONDS")] = None
    checkpoint: Annotated[str | Path | None, Option(_CHECKPOINT, "FILE", fronts=HERE)] = None
    profiles: Annotated[bool, Option("Intervals by the profile likelihood as well.")] = False
    bootstrap: Annotated[Count, Option("Refit so many resampled data sets.", "N")] = 0
    sample: Annotated[Count, Option(_SAMPLE, "[N]", bare="1000")] = 0
    progress: Annotated[Callable[[int, float, float, int], None] | None, Option(_PROGRESS, fronts=("python",))] = None

    @model_validator(mode="after")
    def _together(self) -> Self:
        check_tolerance(self.tolerance, True, self.engine)
        return self
