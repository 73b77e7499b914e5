"""Result of a night, and its form on disk."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any

from shoal.json_values import plain

SCHEMA = "shoal-night"
VERSION = 1
ROUND_OFF = 1e-10
"""Errors below this are noise."""


class Verdict(StrEnum):
    """From best to worst; only the first two are as they should be."""

    PASSED = "passed"
    NOT_POSSIBLE = "not possible"
    SLOWER = "slower"
    LESS_ACCURATE = "less accurate"
    FAILED = "failed"

    @property
    def fine(self) -> bool:
        """Return whether no one needs to look."""
        return self in (Verdict.PASSED, Verdict.NOT_POSSIBLE)


@dataclass(frozen=True)
class Result:
    """One line of a night.

    expected, found: in words; error, limit: in `unit`, None where there is none; seconds: median of whole calls;
    reason: why this limit; noise: error below which more than usual is no loss; usual_error, usual_seconds: medians of
    the nights before, None on the first one; version: of a scene of the library, since which alone nights compare;
    points: of a motion that the next night compares with [m].
    """

    problem: str
    engine: str
    method: str
    expected: str
    found: str
    error: float | None
    limit: float | None
    unit: str
    seconds: float | None
    status: str
    verdict: Verdict
    reason: str
    noise: float = ROUND_OFF
    usual_error: float | None = None
    usual_seconds: float | None = None
    version: str = ""
    points: list[float] | None = None

    @property
    def key(self) -> tuple[str, str, str]:
        """By what the same line is found in other nights."""
        return self.problem, self.engine, self.method

    @property
    def complaint(self) -> str:
        """The line as it is reported when it is not as it should be."""
        where = f"{self.problem}, {self.engine}, {self.method}"
        return f"{where}: {self.verdict}; expected {self.expected}; found {self.found}"


@dataclass(frozen=True)
class Night:
    """All lines of one run.

    started: UTC; machine: processor and cores, within which times compare; changes: since the night before, in words
    """

    started: str
    machine: str
    versions: dict[str, str]
    quick: bool
    only: str | None
    wall_s: float
    lines: tuple[Result, ...]
    changes: tuple[str, ...] = ()

    @property
    def passed(self) -> bool:
        """Return whether every line is as it should be."""
        return all(line.verdict.fine for line in self.lines)

    @property
    def counts(self) -> dict[str, int]:
        """Lines by verdict."""
        found = Counter(line.verdict for line in self.lines)
        return {str(verdict): found[verdict] for verdict in Verdict}

    def to_json(self) -> dict[str, Any]:
        """The object that `shoal validate --json` prints and that is stored."""
        head = {"schema": SCHEMA, "version": VERSION, "status": "ok" if self.passed else "failed"}
        return {**head, **dict(plain(asdict(self))), "counts": self.counts}

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Night:
        """A stored night. Raises ValueError for anything else."""
        if not isinstance(data, dict) or (data.get("schema"), data.get("version")) != (SCHEMA, VERSION):
            raise ValueError(f"not a night of version {VERSION}")
        try:
            lines = tuple(Result(**{**line, "verdict": Verdict(line["verdict"])}) for line in data["lines"])
            known = ("started", "machine", "versions", "quick", "only", "wall_s")
            return cls(**{name: data[name] for name in known}, lines=lines, changes=tuple(data.get("changes", ())))
        except (KeyError, TypeError) as error:
            raise ValueError(f"a night with other fields: {error}") from None


def apart(found: float | None, allowed: float | None) -> int:
    """Decimals of a mantissa that show the difference of two unlike numbers."""
    if found is None or allowed is None or not math.isfinite(found):
        return 1
    return next((digits for digits in range(1, 16) if f"{found:.{digits}e}" != f"{allowed:.{digits}e}"), 16)
