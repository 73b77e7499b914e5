"""Runs that start elsewhere than their scene states: which values give way, in how many of them, and by how much."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from shoal.scene import Scene
from shoal.scene.initial import ABOUT_Z, UNITS, Quantity
from shoal.trajectory import Array, Trajectory

_NAMED = 3
"""So many values are named."""


@dataclass(frozen=True)
class ChangedValue:
    """A stated value of the start that runs do not keep.

    runs: how many; by: how far what they use is away at most, in `unit`
    """

    path: str
    runs: int
    by: float
    unit: str

    def __str__(self) -> str:
        return f"{self.path} by up to {self.by:.3g} {self.unit}"


@dataclass(frozen=True)
class Elsewhere:
    """Runs that start elsewhere than stated, as the joints require it; values: the stated ones that are not kept."""

    runs: int
    elsewhere: int
    values: tuple[ChangedValue, ...]

    def __bool__(self) -> bool:
        return self.elsewhere > 0

    def describe(self, runs: str = "runs") -> str:
        """Return a sentence on these runs, empty if all start as stated; runs: what they are called."""
        if not self:
            return ""
        more = len(self.values) - _NAMED
        values = ", ".join(map(str, self.values[:_NAMED])) + (f" and {more} more" if more > 0 else "")
        return f"{self.elsewhere} of {self.runs} {runs} start elsewhere than stated, as the joints demand: {values}"

    def to_json(self) -> dict[str, Any]:
        """Return plain data: the number of runs, and by path of a value the number, the largest change and its unit."""
        values = {one.path: {"runs": one.runs, "by": one.by, "unit": one.unit} for one in self.values}
        return {"runs": self.runs, "elsewhere": self.elsewhere, "values": values}


@dataclass(frozen=True)
class StatedStart:
    """Stated values of the start of a scene that are no guesses, with which starts of runs are compared.

    values: body and quantity of each
    """

    values: tuple[tuple[str, Quantity], ...] = ()

    @classmethod
    def of(cls, scene: Scene, varied: Iterable[str] = ()) -> StatedStart:
        """Return those of a scene; varied: paths whose values the runs state."""
        return cls(scene.statements(varied))

    def given_way(self, changed: Mapping[str, Any]) -> dict[tuple[str, Quantity], Mapping[str, Any]]:
        """Return the stated values, by body and quantity, among those of `Trajectory.changed` of a run."""
        found = {}
        for body, quantity in self.values:
            quantities = changed.get(body, {})
            for name in (quantity, ABOUT_Z.get(quantity)):
                if name in quantities:
                    found[body, quantity] = quantities[name]
        return found

    def away(self, changed: Mapping[str, Any]) -> Array:
        """Return the distance of a run's start from each value, zero where it is kept, (values,)."""
        found = self.given_way(changed)
        return np.array([_apart(found[one]) if one in found else 0.0 for one in self.values])

    def elsewhere(self, away: Array) -> Elsewhere:
        """Summarise the distances from each value, (runs, values)."""
        count, most = (away > 0).sum(axis=0), away.max(axis=0, initial=0.0)
        values = tuple(
            ChangedValue(f"initial.{body}.{quantity}", int(number), float(by), UNITS[quantity])
            for (body, quantity), number, by in zip(self.values, count, most, strict=True)
            if number
        )
        return Elsewhere(len(away), int((away > 0).any(axis=1).sum()), values)


class Tally:
    """Accumulates the starts of runs over batches; stated: see `StatedStart`."""

    def __init__(self, stated: StatedStart) -> None:
        self.stated = stated
        self._away: list[Array] = []

    def of(self, motion: Trajectory) -> Array:
        """Return the distance of each lane's start from each value, (lanes, values)."""
        found = np.zeros((motion.lanes, len(self.stated.values)))
        if found.size:
            for lane in range(motion.lanes):
                if changed := motion.changed(lane):
                    found[lane] = self.stated.away(changed)
        return found

    def count(self, away: Array) -> None:
        """Count runs that start so far from each value, (runs, values)."""
        self._away.append(away)

    @property
    def elsewhere(self) -> Elsewhere:
        """Summarise all runs so far."""
        return self.stated.elsewhere(np.concatenate([np.zeros((0, len(self.stated.values))), *self._away]))


def _apart(change: Mapping[str, Any]) -> float:
    stated, used = np.atleast_1d(change["stated"]), np.atleast_1d(change["used"])
    both = min(stated.size, used.size)
    return float(np.max(np.abs(used[:both] - stated[:both])))
