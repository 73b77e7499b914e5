"""Verdicts for MLflow, Prefect and the terminal: a word, and the reasons against an answer."""

from __future__ import annotations

from functools import singledispatch
from typing import Any, NamedTuple

from shoal.engines.compare import Comparison
from shoal.engines.sweep import Sweep
from shoal.identification import Estimate
from shoal.identification.design import Design
from shoal.mechanics.analysis.equilibrium import Equilibrium
from shoal.response import Response
from shoal.selection import Selection
from shoal.trajectory import Trajectory

from shoal_flows.exports import Exports


class Verdict(NamedTuple):
    """word: the status of an answer; doubts: every reason not to trust it, none if it can be trusted."""

    word: str
    doubts: tuple[str, ...] = ()


@singledispatch
def verdict(answer: Any) -> Verdict:
    """Return the verdict on an answer of a flow. Raises TypeError for other objects."""
    raise TypeError(type(answer).__name__)


@verdict.register
def _(answer: Trajectory) -> Verdict:
    return _stated(answer.ok, str(answer.status[0]), answer.message)


@verdict.register(Equilibrium)
@verdict.register(Response)
def _(answer: Equilibrium | Response) -> Verdict:
    return _stated(answer.ok, str(answer.status), answer.message)


@verdict.register
def _(answer: Estimate) -> Verdict:
    return _stated(answer.verdict.trusted, str(answer.verdict), answer.message)


@verdict.register
def _(answer: Selection) -> Verdict:
    ok, motion = answer.met and answer.trajectory.ok, answer.trajectory
    return Verdict("met" if answer.met else "not met", () if ok else (motion.message or answer.reason,))


@verdict.register(Sweep)
@verdict.register(Comparison)
def _(answer: Sweep | Comparison) -> Verdict:
    return Verdict("ok") if answer.ok else Verdict("failed", (answer.complaint,))


@verdict.register(Design)
@verdict.register(Exports)
def _(answer: Design | Exports) -> Verdict:
    return Verdict("ok") if answer.ok else Verdict("failed", (answer.message,))


def _stated(ok: bool, word: str, message: str) -> Verdict:
    return Verdict(word, () if ok else (f"{word}: {message}" if message else word,))
