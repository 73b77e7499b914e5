"""What a study holds on to: runs that outlive it in a file, and the time that it may take."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from shoal.compile import clock
from shoal.memory import Memory
from shoal.response.runs import Answers, TooManyRunsError
from shoal.trajectory import Array


class TimeIsUpError(TooManyRunsError):
    """The study has used up its time."""


@dataclass
class Keep:
    """memory: of the runs, None if they are not kept; end: by `clock` [s], None if there is none; over: whether a run
    was refused because of it
    """

    memory: Memory | None = None
    end: float | None = None
    over: bool = False

    def close(self) -> None:
        """Close the file, if there is one."""
        if self.memory is not None:
            self.memory.close()

    def __call__(
        self, label: str, values: Mapping[str, Array], run: Callable[[Mapping[str, Array]], Answers], stated: int = 0
    ) -> Answers:
        """What is known of these runs, else what making them tells. Raises TimeIsUpError.

        label: of what is told; stated: of so many values of the start runs tell how far they are away
        """
        points = np.stack(list(values.values()))
        known = None if self.memory is None else self.memory.recall(label, points)
        if known is not None:
            good, told = known[:-1, -1] == 1.0, known.shape[1] - 1 - stated
            why = "" if good.all() else "they failed before the study was broken off"
            away = known[:-1, told:-1].copy() if stated else None
            return Answers(known[:-1, :told].copy(), good, int(known[-1, -1]), why, away)
        if self.end is not None and clock.now() > self.end:
            self.over = True
            raise TimeIsUpError
        found = run(values)
        if self.memory is not None:
            parts = [found.values, *([found.away] if found.away is not None and stated else []), found.good]
            rows = np.column_stack(parts)
            last = np.zeros((1, rows.shape[1]))
            last[0, -1] = found.repeated
            self.memory.keep(label, points, np.concatenate([rows, last]))
        return found
