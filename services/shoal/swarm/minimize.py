"""Minimisation by an ask-and-tell optimiser."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from shoal.swarm.counter import BatchFunction, BudgetExhausted
from shoal.swarm.protocol import Optimizer, State

S = TypeVar("S", bound=State)


def minimize(
    optimizer: Optimizer[S],
    function: BatchFunction,
    *,
    rng: np.random.Generator,
    iterations: int | None = None,
    budget: int | None = None,
    callback: Callable[[S], None] | None = None,
) -> S:
    """Search until `iterations` are done, the next batch would exceed `budget`, or the optimiser is finished.

    `function` maps points (n, d) to values (n,); when it raises BudgetExhausted the search ends as well. `callback`
    sees every state after the first swarm's. Returns the last state, which holds `best` and `best_value`.
    """
    if iterations is None and budget is None:
        raise ValueError("give iterations or budget, else the search may never end")
    state = optimizer.init(rng)
    evaluations = 0
    while not state.finished and (iterations is None or state.iteration < iterations):
        candidates = optimizer.ask(state)
        evaluations += len(candidates)
        if budget is not None and evaluations > budget:
            break
        try:
            values = function(candidates)
        except BudgetExhausted:
            break
        state = optimizer.tell(state, values)
        if callback is not None:
            callback(state)
    return state
