"""One line of a plan: what is run, and how far from right it may be."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from shoal_validation.nightly.measure import Measured
from shoal_validation.nightly.result import ROUND_OFF
from shoal_validation.problems import PROBLEMS


@dataclass(frozen=True)
class Line:
    """One line of the plan.

    limit: largest error in `unit`, None where no answer is expected; reason: why; run: what the worker process calls;
    source: the reference, None for that of the problem of this name; quick: whether a quick night has it;
    noise: error below which a larger one than usual is no loss of accuracy; version: of an own scene;
    as_before: whether the night before is the reference
    """

    problem: str
    engine: str
    method: str
    limit: float | None
    reason: str
    run: Callable[[], Measured] = field(repr=False)
    source: str | None = None
    unit: str = "m"
    quick: bool = True
    noise: float = ROUND_OFF
    version: str = ""
    as_before: bool = False

    def reference(self) -> str:
        """Source of the reference."""
        return self.source or PROBLEMS[self.problem].reference.source
