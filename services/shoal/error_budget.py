"""Error budget: the known error estimates of one number, by source, and the one figure that is reported of them.

By the triangle inequality a number is off by at most the sum of what each source moves it by. So `total`, never smaller
than the largest estimate, is what tables, pages, charts, files and decisions about limits take; nothing else picks one
of the estimates.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

GOOD = 0.01
"""Share of the size of what is reported up to which its known error is small: a convention of this product."""

Grade = Literal["good", "fair", "bad"]
"""Colour of an answer: good (trusted, small known error), fair (trusted, large or unknown error), bad (rejected)."""


@dataclass(frozen=True)
class ErrorBudget:
    """Estimates of how far one number is off.

    estimates: source (time, mesh, theory, ...) -> error in `unit`, None where it could not be estimated; unit: of all
    """

    estimates: Mapping[str, float | None] = field(default_factory=dict)
    unit: str = "m"

    @property
    def known(self) -> dict[str, float]:
        """The estimates that there are, largest first."""
        found = {source: error for source, error in self.estimates.items() if error is not None}
        return dict(sorted(found.items(), key=lambda pair: -pair[1]))

    @property
    def unknown(self) -> tuple[str, ...]:
        """Sources whose error could not be estimated."""
        return tuple(source for source, error in self.estimates.items() if error is None)

    @property
    def total(self) -> float | None:
        """The sum of the known errors; None where none is known."""
        return sum(self.known.values()) if self.known else None

    @property
    def largest(self) -> str:
        """The source of the largest known error; empty where none is known."""
        return next(iter(self.known), "")

    def grade(self, trusted: bool, size: float | None) -> Grade:
        """Return the colour of an answer. size: of what is reported, in `unit`; None where it is not known."""
        if not trusted:
            return "bad"
        if self.total is None or self.unknown or size is None:
            return "fair"
        return "good" if self.total <= GOOD * size else "fair"

    @property
    def brief(self) -> str:
        """The sum alone, in words: "known error 3.1e-02 m"."""
        if not self.estimates:
            return "its error is not estimated"
        lacks = [f"its {source} error is not known" for source in self.unknown]
        known = [] if self.total is None else [f"known error {self.total:.1e} {self.unit}"]
        return ", but ".join(known + lacks)

    def __str__(self) -> str:
        """Return the sum and its parts: "3.1e-02 m: mesh 3.1e-02, time 1.9e-05"."""
        if self.total is None:
            return "not known"
        parts = [f"{source} {error:.1e}" for source, error in self.known.items()]
        parts += [f"{source} not known" for source in self.unknown]
        return f"{self.total:.1e} {self.unit}: {', '.join(parts)}"

    def to_json(self) -> dict[str, Any]:
        """Return plain data, which `from_json` reads."""
        return {"total": self.total, "largest": self.largest, "unit": self.unit, "by_source": dict(self.estimates)}

    @classmethod
    def from_json(cls, data: Mapping[str, Any] | None) -> ErrorBudget:
        """Return the budget of `to_json`; an empty one of None."""
        return cls() if data is None else cls(dict(data["by_source"]), data["unit"])


def worst(budgets: Iterable[ErrorBudget]) -> ErrorBudget:
    """Return the budget of several answers of one unit: of each source the largest error, None where none is known."""
    found: dict[str, float | None] = {}
    unit = ErrorBudget.unit
    for budget in budgets:
        unit = budget.unit
        for source, error in budget.estimates.items():
            before = found.get(source)
            found[source] = before if error is None else error if before is None else max(before, error)
    return ErrorBudget(found, unit)
