"""Interface of all optimisers: frozen settings with `init`, `ask` and `tell`."""

from __future__ import annotations

from typing import Protocol, TypeVar

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


class State(Protocol):
    """State of a search; never modified, `tell` returns the next one.

    best: best point so far, in the units of the problem, (d,); before any finite value the first candidate
    best_value: its value, which is the minimum of all values so far; inf before any finite one
    iteration: completed iterations; the evaluation of the first swarm is iteration 0, before it stands -1
    finished: whether the method's own stopping rule holds
    """

    @property
    def best(self) -> Array: ...  # noqa: D102 - described above
    @property
    def best_value(self) -> float: ...  # noqa: D102
    @property
    def iteration(self) -> int: ...  # noqa: D102
    @property
    def finished(self) -> bool: ...  # noqa: D102


S = TypeVar("S", bound=State)


class Optimizer(Protocol[S]):
    """Minimises a function over a box by asking for its values at candidates.

    The random stream is part of the state: the same state with the same values gives the same next state.
    """

    def init(self, rng: np.random.Generator) -> S:
        """Scatter the first candidates; the caller's generator is copied, not advanced."""
        ...

    def ask(self, state: S) -> Array:
        """Points to evaluate next, (n, d); n may differ from one call to the next."""
        ...

    def tell(self, state: S, values: Array) -> S:
        """Take the values of the points asked for, (n,); nan and inf stand for a failed evaluation."""
        ...
