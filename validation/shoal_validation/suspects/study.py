"""One trial: the verdict on a random model, and whether the suspects name what is wrong with it."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
from shoal.engines import get_engine
from shoal.identification import Verdict
from shoal.identification.conclude import NOTHING, conclude
from shoal.identification.forward import ForwardModel
from shoal.identification.methods import get_method
from shoal.identification.suspects import Suspect

from shoal_validation.suspects.cases import case


@dataclass(frozen=True)
class Trial:
    """What came out. named: the suspects that explain the recording best, equals together; first: the cause is there

    covered: of the sought parameters, how many intervals hold the truth; noticed: whether a misfit was seen at all
    """

    machine: str
    kind: str
    cause: str
    verdict: Verdict
    named: tuple[str, ...]
    noticed: bool
    covered: float
    ratio: float

    @property
    def first(self) -> bool:
        """Whether the cause is among the suspects named first."""
        return self.cause in self.named

    def __str__(self) -> str:
        mark = "first" if self.first else ("-" if not self.noticed else "MISSED")
        told = f"{self.verdict}, {self.ratio:.3g} times the noise, {100 * self.covered:.0f} % held"
        return f"{self.machine:15s} {self.cause:24s} {mark:6s} {told} [{', '.join(self.named)}]"


def trial(seed: int, kind: str | None = None) -> Trial:
    """Identify the case of a seed by least squares."""
    drawn = case(seed, kind)
    model = ForwardModel(drawn.problem, drawn.scene, get_engine("gauss"), drawn.measurement)
    outcome = get_method("least-squares")(model, np.random.default_rng(seed), lambda *_: None)
    estimate = conclude(model, outcome, "least-squares", seed, 0.0, [], NOTHING)
    held = [
        estimate.parameters[name].lower <= truth <= estimate.parameters[name].upper
        for name, truth in drawn.truth.items()
    ]
    tests = estimate.residual_tests
    return Trial(
        drawn.scene.name,
        drawn.kind,
        drawn.cause,
        estimate.verdict,
        first_of(estimate.suspects, tests.rows),
        tests.limited,
        float(np.mean(held)),
        tests.ratio,
    )


def first_of(suspects: list[Suspect], rows: int) -> tuple[str, ...]:
    """The best suspect and its equals."""
    return tuple(suspect.name for suspect in suspects if suspect.equals(suspects[0], rows))


def summary(trials: list[Trial]) -> tuple[tuple[str, ...], list[tuple[str, ...]], str]:
    """Head and rows of a table by kind of fault, and the shares in a sentence."""
    wrong = [t for t in trials if t.kind != "right"]
    right = [t for t in trials if t.kind == "right"]
    head = ("fault", "models", "rejected", "misfit seen", "named first", "named instead")
    rows = list[tuple[str, ...]]()
    for kind in sorted({t.kind for t in wrong}):
        mine = [t for t in wrong if t.kind == kind]
        instead = Counter(t.named[0] if t.named else "nothing" for t in mine if t.noticed and not t.first)
        rows.append(
            (
                kind,
                str(len(mine)),
                str(sum(t.verdict is Verdict.REJECTED for t in mine)),
                str(sum(t.noticed for t in mine)),
                str(sum(t.first for t in mine)),
                ", ".join(f"{name} {count}" for name, count in instead.most_common()),
            )
        )
    seen = [t for t in wrong if t.noticed]
    named = sum(t.first for t in wrong)
    last = f"cause named first: {named} of {len(wrong)} ({named} of {len(seen)} whose misfit is seen)"
    rejected = sum(t.verdict is Verdict.REJECTED for t in right)
    return head, rows, f"{last}; right models rejected: {rejected} of {len(right)}"
