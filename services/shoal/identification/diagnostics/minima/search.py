"""The searches for other minima, one after the other, each from the best answer so far."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from shoal.identification.deadline import unless_late
from shoal.identification.diagnostics.minima.aliases import aliases, more_turns
from shoal.identification.diagnostics.minima.mirrors import mirror_images
from shoal.identification.findings import BETTER_FOLLOWED
from shoal.identification.forward import ForwardModel
from shoal.identification.methods.lanes import Descent
from shoal.identification.methods.outcome import Outcome

Search = Callable[[ForwardModel, Outcome], Sequence[Descent]]
"""Where descents end that start elsewhere than the search for an outcome did. Raises TimeIsUp."""

SEARCHES: dict[str, Search] = {
    "more turns from sample to sample": more_turns,
    "another frequency between the samples": aliases,
    "a mirror image": mirror_images,
}


def with_other_minima(model: ForwardModel, outcome: Outcome) -> Outcome:
    """Return the outcome with the other minima that these searches meet, as far as time allows.

    The runs are not counted: no method is charged for them.
    """
    for name, search in SEARCHES.items() if np.isfinite(outcome.fitness) else ():
        ends: Sequence[Descent] = unless_late(partial(search, model.aside(), outcome), [])
        outcome = followed(model, outcome, ends, name)
    return outcome


def followed(model: ForwardModel, outcome: Outcome, ends: Sequence[Descent], where: str) -> Outcome:
    """Return the outcome with further minima; where the search goes on from a better one, a finding says so."""
    found = outcome.joined(model, ends, where)
    if found.point is outcome.point:
        return found
    text = f"a better minimum was met as {where}, of fitness {found.fitness:.3g} instead of {outcome.fitness:.3g}"
    said = BETTER_FOLLOWED.found(text, fitness=outcome.fitness, better=found.fitness)
    return replace(found, findings=[*outcome.findings, said])
