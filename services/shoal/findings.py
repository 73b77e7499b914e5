"""Findings: what an analysis found out about its answer, each with a code, a severity, a sentence and its numbers."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, TypeVar

from shoal.json_values import plain

Order = TypeVar("Order", bound=StrEnum)


class Severity(StrEnum):
    """Effect of a finding on an answer."""

    NOTE = "note"
    """The answer holds; this explains it."""
    CAUTION = "caution"
    """The answer holds, but a part of it is limited or unknown."""
    REJECTION = "rejection"
    """The answer cannot be used as it stands."""


@dataclass(frozen=True)
class Kind:
    """A kind of finding: its code, what it means, and what to do in general.

    code: lower case with hyphens, the same in every version, for programs to look for
    severity: of all findings of this kind; implies: the status or verdict that such a finding leads to, else empty
    """

    code: str
    severity: Severity
    meaning: str
    remedy: str = ""
    implies: str = ""

    def found(self, text: str, *steps: str, **numbers: float) -> Finding:
        """Return a finding of this kind. steps: what to do about this one; numbers: in SI units, by name."""
        return Finding(self, text, steps, numbers)


@dataclass(frozen=True)
class Finding:
    """Result of a diagnostic about an answer.

    text: one sentence or clause without a full stop; steps: what to do about this finding, before the general remedy
    numbers: the quantities that the text mentions, in SI units
    """

    kind: Kind
    text: str
    steps: tuple[str, ...] = ()
    numbers: dict[str, float] = field(default_factory=dict)

    @property
    def code(self) -> str:
        """The code of its kind."""
        return self.kind.code

    @property
    def severity(self) -> Severity:
        """The severity of its kind."""
        return self.kind.severity

    def to_json(self) -> dict[str, Any]:
        """Return code, severity, the status it implies, text, numbers and what to do."""
        said = {"code": self.code, "severity": str(self.severity), "implies": self.kind.implies, "text": self.text}
        return {**said, "numbers": plain(self.numbers), "do": steps([self])}

    @classmethod
    def from_json(cls, said: Mapping[str, Any]) -> Finding:
        """Return the finding that `to_json` wrote; its kind is known by its code, severity and implied status."""
        kind = Kind(said["code"], Severity(said["severity"]), "", "", said["implies"])
        return cls(kind, said["text"], tuple(said["do"]), said["numbers"])


def rejects(code: str, implies: str, meaning: str, remedy: str = "") -> Kind:
    """Return a kind of finding with which the answer cannot be used."""
    return Kind(code, Severity.REJECTION, meaning, remedy, implies)


def limits(code: str, implies: str, meaning: str, remedy: str = "") -> Kind:
    """Return a kind of finding with which a part of the answer can be used."""
    return Kind(code, Severity.CAUTION, meaning, remedy, implies)


def cautions(code: str, meaning: str, remedy: str = "") -> Kind:
    """Return a kind of finding that limits the answer, and leaves its status as it is."""
    return Kind(code, Severity.CAUTION, meaning, remedy)


def notes(code: str, meaning: str, remedy: str = "") -> Kind:
    """Return a kind of finding that explains the answer."""
    return Kind(code, Severity.NOTE, meaning, remedy)


def message(findings: Iterable[Finding]) -> str:
    """Return the texts of findings as one line."""
    return "; ".join(one.text for one in findings)


def steps(findings: Iterable[Finding]) -> list[str]:
    """Return what to do about findings, each step once: those of single findings, then the remedies of their kinds."""
    all_ = list(findings)
    found = [step for one in all_ for step in one.steps] + [one.kind.remedy for one in all_ if one.kind.remedy]
    return list(dict.fromkeys(found))


def explained(findings: Iterable[Finding]) -> str:
    """Return findings as one line with what to do about them, for an error that is raised."""
    all_ = list(findings)
    return "; ".join(filter(None, (message(all_), *steps(all_))))


def worst_implied(findings: Iterable[Finding], order: type[Order]) -> Order:
    """Return the last member of an ordered enumeration that findings imply; its first where none implies any."""
    members = list(order)
    implied = [order(one.kind.implies) for one in findings if one.kind.implies]
    return max(implied, key=members.index, default=members[0])


def sentence(text: str) -> str:
    """Return a clause with its capital and its full stop; an identifier at its beginning keeps its case."""
    first, _, rest = text.partition(" ")
    return f"{first.capitalize() if first.isalpha() and first.islower() else first} {rest}".strip().rstrip(".") + "."


class Concluded:
    """Base of answers that have findings: what follows from these."""

    findings: Sequence[Finding]

    @property
    def codes(self) -> list[str]:
        """The codes of the findings, in their order."""
        return [one.code for one in self.findings]

    @property
    def message(self) -> str:
        """The findings in one line."""
        return message(self.findings)

    @property
    def advice(self) -> list[str]:
        """Steps to take next."""
        return steps(self.findings)

    @property
    def explanation(self) -> str:
        """The findings and the steps to take next in one line."""
        return explained(self.findings)
