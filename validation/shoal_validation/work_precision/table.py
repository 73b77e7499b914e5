"""Cost of an error: ours beside the cheapest Exudyn setting that comes within it."""

from __future__ import annotations

from dataclasses import dataclass

from shoal_validation.judge import WRONG
from shoal_validation.work_precision.contract import MANY, OURS, Point
from shoal_validation.work_precision.exudyn import FAMILY as EXUDYN
from shoal_validation.work_precision.front import cheapest
from shoal_validation.work_precision.measure import Study, size

REACHES = (1e-2, 1e-3, 1e-4, 1e-5)
"""Errors [m] whose cost is asked for."""


@dataclass(frozen=True)
class Cost:
    """The cheapest believed runs within an error `reach` [m]; None where a family has none.

    exudyn is the cheapest by its whole call, loop by its time loop alone; other: the best of all other families.
    """

    problem: str
    reach: float
    ours: Point | None
    many: Point | None
    exudyn: Point | None
    loop: Point | None
    other: Point | None

    @property
    def ratio(self) -> float | None:
        """Ratio of the time of Exudyn's whole call to ours."""
        return self.exudyn.seconds / self.ours.seconds if self.ours and self.exudyn else None

    @property
    def loop_ratio(self) -> float | None:
        """Ratio of the time of Exudyn's time loop alone to our whole call."""
        if not (self.ours and self.loop and self.loop.loop_seconds):
            return None
        return self.loop.loop_seconds / self.ours.seconds


def costs(study: Study) -> list[Cost]:
    """One line per error that its reference resolves and that is small for the machine."""
    by = {family: [p for p in study.points if p.family == family] for family in (OURS, MANY, EXUDYN)}
    others = [p for p in study.points if p.family not in by]
    return [
        Cost(
            study.problem.name,
            reach,
            cheapest(by[OURS], reach),
            cheapest(by[MANY], reach),
            cheapest(by[EXUDYN], reach),
            cheapest(by[EXUDYN], reach, lambda point: point.loop_seconds),
            cheapest(others, reach),
        )
        for reach in REACHES
        if 3 * study.problem.reference.error < reach <= WRONG * size(study.problem)
    ]
