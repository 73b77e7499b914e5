"""The request for the motion of a scene."""

from __future__ import annotations

from dataclasses import KW_ONLY
from typing import Annotated, Self

from pydantic import model_validator
from pydantic.dataclasses import dataclass

from shoal.requests.fields import At, Engine, Length, OfScene, Seconds, Verify, check_tolerance
from shoal.requests.option import Option
from shoal.requests.request import STRICT, wrong

_TOLERANCE = "Find the cheapest model whose error [m] at the markers stays below; overrides elements, integrator, step."
_PATIENCE = "With a tolerance: give up where a refinement would take longer [s] (default: 60)."


@dataclass(frozen=True, config=STRICT)
class Simulate(OfScene):
    """Simulate a scene; the `status` of the answer says whether the motion can be trusted."""

    at: At = None
    _: KW_ONLY
    engine: Engine = "gauss"
    tolerance: Annotated[Length | None, Option(_TOLERANCE, "METRES")] = None
    patience: Annotated[Seconds | None, Option(_PATIENCE, "SECONDS")] = None
    verify: Verify = True

    @model_validator(mode="after")
    def _together(self) -> Self:
        if self.patience is not None and self.tolerance is None:
            wrong("patience", "is that of a search; state a tolerance as well")
        check_tolerance(self.tolerance, self.verify, self.engine)
        return self
