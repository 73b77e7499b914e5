"""One trial: the verdict on a random model, and whether the suspects name what is wrong with it."""

from __future__ import annotations

import time
from collections import Counter
from dataclasses import dataclass

import numpy as np
from scipy.special import betaincinv
from shoal.engines import get_engine
from shoal.identification import Verdict
from shoal.identification.conclude import conclude
from shoal.identification.diagnostics.suspects import Suspect
from shoal.identification.forward import ForwardModel
from shoal.identification.methods import get_method

from shoal_validation.suspects.cases import case


@dataclass(frozen=True)
class Trial:
    """Outcome of one trial. named: the suspects that explain the recording best, equals together

    alike: those of them of which a small fault has the same effect as the cause (cosine above 0.999)
    covered: of the sought parameters, how many intervals hold the truth; noticed: whether a misfit was seen at all
    ratio: of the misfit to the noise; seconds: of the processor
    """

    seed: int
    machine: str
    kind: str
    cause: str
    verdict: str
    named: tuple[str, ...]
    alike: tuple[str, ...]
    noticed: bool
    covered: float
    ratio: float
    seconds: float

    @property
    def place(self) -> str:
        """Place of the cause: named alone, with those of the same effect, with others that fit as well, or nowhere."""
        if self.cause not in self.named:
            return "missed" if self.noticed else "unseen"
        if len(self.named) == 1:
            return "alone"
        return "same effect" if {*self.named} <= {self.cause, *self.alike} else "fits as well"

    @property
    def first(self) -> bool:
        """Return whether the cause is among the suspects named first."""
        return self.cause in self.named

    def __str__(self) -> str:
        told = f"{self.verdict}, {self.ratio:.3g} times the noise, {100 * self.covered:.0f} % held"
        named = ", ".join(self.named)
        case = f"{self.seed:4d} {self.machine:15s} {self.cause:30s} {self.place:12s}"
        return f"{case} {told} [{named}] {self.seconds:.1f} s"


def trial(seed: int, kind: str | None = None) -> Trial:
    """Identify the case of a seed by least squares."""
    begin = time.process_time()
    drawn = case(seed, kind)
    model = ForwardModel(drawn.problem, drawn.scene, get_engine("gauss"), drawn.measurement)
    outcome = get_method("least-squares")(model, np.random.default_rng(seed), lambda *_: None)
    estimate = conclude(model, outcome, "least-squares", seed)
    known = {name: estimate.parameters[name] for name in drawn.truth}
    held = [not value.identifiable or value.lower <= drawn.truth[name] <= value.upper for name, value in known.items()]
    tests = estimate.residual_tests
    named = first_of(estimate.suspects, tests.rows)
    return Trial(
        seed,
        drawn.scene.name,
        drawn.kind,
        drawn.cause,
        str(estimate.verdict),
        named,
        next((s.alike for s in estimate.suspects if s.name == drawn.cause), ()),
        tests.limited or tests.wrong_model,
        float(np.mean(held)),
        tests.ratio,
        time.process_time() - begin,
    )


def first_of(suspects: list[Suspect], rows: int) -> tuple[str, ...]:
    """The best suspect and its equals."""
    return tuple(suspect.name for suspect in suspects if suspect.equals(suspects[0], rows))


def at_most(count: int, total: int) -> float:
    """The largest chance of an event that was seen so often, at 95 % (Clopper and Pearson 1934, one-sided)."""
    return 1.0 if count >= total else float(betaincinv(count + 1, total - count, 0.95))


def at_least(count: int, total: int) -> float:
    """The smallest such chance."""
    return 1.0 - at_most(total - count, total)


def summary(trials: list[Trial]) -> tuple[tuple[str, ...], list[tuple[str, ...]], list[str]]:
    """Head and rows of a table by kind of fault, and the shares in sentences."""
    wrong = [t for t in trials if t.kind != "right"]
    right = [t for t in trials if t.kind == "right"]
    head = ("fault", "models", "rejected", "misfit seen", "named first", "alone", "same effect", "named instead")
    rows = list[tuple[str, ...]]()
    for kind in sorted({t.kind for t in wrong}):
        mine = [t for t in wrong if t.kind == kind]
        instead = Counter(t.named[0] if t.named else "nothing" for t in mine if t.place == "missed")
        counts = (
            len(mine),
            sum(t.verdict == Verdict.REJECTED for t in mine),
            sum(t.noticed for t in mine),
            sum(t.first for t in mine),
            sum(t.place == "alone" for t in mine),
            sum(t.place == "same effect" for t in mine),
        )
        words = ", ".join(f"{name} {count}" for name, count in instead.most_common())
        rows.append((kind, *map(str, counts), words))
    told = []
    if wrong:
        places = Counter(t.place for t in wrong)
        first, seen = sum(t.first for t in wrong), sum(t.noticed or t.first for t in wrong)
        ways = ", ".join(f"{name} {places[name]}" for name in ("alone", "same effect", "fits as well"))
        whole = _share(first, len(wrong))
        told.append(f"cause named first: {_share(first, seen)} whose misfit is seen, {whole} of all")
        told.append(f"of these: {ways}")
    if right:
        rejected = sum(t.verdict == Verdict.REJECTED for t in right)
        bound = 100 * at_most(rejected, len(right))
        told.append(f"right models rejected: {rejected} of {len(right)} (at most {bound:.2g} % at 95 %)")
        told.append(f"verdicts on them: {dict(Counter(t.verdict for t in right))}")
    return head, rows, told


def _share(count: int, total: int) -> str:
    return f"{count} of {total} ({100 * count / max(total, 1):.1f} %, at least {100 * at_least(count, total):.1f} %)"
