"""Lines of machines drawn at random, with contacts and under feedback: none may be wrong and called right."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from shoal_validation.benchmarks.timing import undisturbed
from shoal_validation.nightly.line import Line
from shoal_validation.nightly.measure import Measured
from shoal_validation.random_contacts.machines import pushed
from shoal_validation.random_contacts.study import judged as with_contacts
from shoal_validation.random_feedback.study import judged as under_feedback
from shoal_validation.random_machines import WRONG, Judged

SEEDS = range(24)
LEAST = len(SEEDS) // 2
"""Machines that must be right, as a night in which all are refused guards nothing."""


def lines() -> Iterator[Line]:
    """One line for each study."""
    reason = "no machine may be further from the judge than three times its estimated error"
    for name, judged, source in (
        ("contacts", with_contacts, "Newton's and Euler's equations, every mode of contacts tried"),
        ("jumps", partial(with_contacts, machine_of=pushed), "the same, under forces that begin and end at once"),
        ("feedback", under_feedback, "Lagrange's equations, formulas by Python, DOP853 of scipy"),
    ):
        yield Line(f"random/{name}", "gauss", "default", 0.0, reason, partial(wrong, judged), source,
                   "machines", quick=False, noise=0.5)  # fmt: skip


def wrong(judged: Callable[[int], Judged]) -> Measured:
    """Return how many machines are wrong and called right, as the error; failed if few are judged right."""
    seconds, found = undisturbed(lambda: [judged(seed) for seed in SEEDS])
    verdicts = [one.verdict for one in found]
    if verdicts.count("right") < LEAST:
        return Measured("failed", np.nan, seconds, f"only {verdicts.count('right')} of {len(found)} are right")
    named = "; ".join(str(one).strip() for one in found if one.verdict == WRONG)
    return Measured("ok", float(verdicts.count(WRONG)), seconds, named)
