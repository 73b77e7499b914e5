"""Error estimation by a second run: how far a quantity of a run is from the same quantity of a more careful one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from shoal.engines.event_comparison import EventComparison, compare
from shoal.scene import Scene
from shoal.trajectory import Array, Trajectory


@dataclass(frozen=True, eq=False)
class Deviation:
    """Two runs whose difference, times a factor, estimates the error of a run from one source.

    source: time, mesh, theory, friction or bending; one, other: runs at the same instants; scenes: theirs
    """

    source: str
    one: Trajectory
    other: Trajectory
    scenes: tuple[Scene, Scene]
    factor: float = 1.0

    @property
    def distance(self) -> float:
        """The error of the markers [m]: the largest of all instants."""
        return self.factor * self.one.distance(self.other)

    @property
    def angle(self) -> float | None:
        """The error of the angles [rad], the largest of all instants; None in space, where an angle may jump."""
        if len(self.one.axes) == 3:
            return None
        return self.factor * float(np.max(np.abs(turned(self.one.angles - self.other.angles)), initial=0.0))

    @cached_property
    def events(self) -> EventComparison:
        """The comparison of the events of contacts, of which scenes without any have none."""
        one, other = (run.model.get("events", ()) for run in (self.one, self.other))
        return compare(one, other, self.factor)

    def of_markers(self) -> Array:
        """Return errors of x, y [m] and angle [rad] of every marker, in space of x, y and z, (instants, markers, 3).

        Each coordinate takes the distance of the two places, and each instant the largest one until then: differences
        that happen to vanish where curves cross are no sign of accuracy.
        """
        away = np.linalg.norm(self.one.points - self.other.points, axis=2)[..., 0]
        columns = [away] * len(self.one.axes)
        if len(self.one.axes) == 2:
            columns.append(np.abs(turned(self.one.angles - self.other.angles))[..., 0])
        return self.factor * np.maximum.accumulate(np.stack(columns, axis=2), axis=0)

    def of(self, quantity: Callable[[Trajectory, Scene], Array]) -> Array:
        """Return errors of a quantity over time, (instants,), each the largest until then. quantity: of one run.

        Rates jump at impacts: at instants past one in one run and before it in the other they are not compared.
        """
        one, other = (quantity(run, scene) for run, scene in zip((self.one, self.other), self.scenes, strict=True))
        apart = np.where(self.events.beside(self.one.times)[-len(one) :], 0.0, np.abs(one - other))
        return np.asarray(self.factor * np.maximum.accumulate(apart))


def turned(angles: Array) -> Array:
    """Return differences of angles between -pi and pi [rad]."""
    return angles - 2.0 * np.pi * np.rint(angles / (2.0 * np.pi))


def by_source(deviations: Sequence[Deviation], error: Callable[[Deviation], Array]) -> dict[str, Array]:
    """Return the errors of every source; deviations of one source add up."""
    found: dict[str, Array] = {}
    for one in deviations:
        found[one.source] = found[one.source] + error(one) if one.source in found else error(one)
    return found
