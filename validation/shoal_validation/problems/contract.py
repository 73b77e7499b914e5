"""Problem of the library: a scene, its sampling instants, and a reference that others computed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache

import numpy as np
from shoal.scene import Scene, load_scene
from shoal.trajectory import Array, Trajectory


@dataclass(frozen=True)
class Reference:
    """Positions of the watched marker at the problem's times.

    points: [m], (times, d); source: who computed or published it, and how; error: its own error [m], as far as its
    source tells.
    """

    points: Array
    source: str
    error: float


@dataclass(frozen=True)
class Problem:
    """A scene with a reference that is not ours.

    marker: the one that is watched; times: sampling instants [s], (times,); settle: computes or reads the reference
    (asked once); flexible: whether a mesh error exists beside the time error, so that the reference is the continuum;
    about: one line for a person; changes: fields of the scene that the problem sets.
    """

    name: str
    about: str
    scene_name: str
    marker: str
    times: Array
    settle: Callable[[Array], Reference]
    flexible: bool = False
    changes: dict[str, object] = field(default_factory=dict)

    def scene(self) -> Scene:
        """The scene, whose duration is the last of the times."""
        return load_scene(self.scene_name).with_values({**self.changes, "solver.duration": float(self.times[-1])})

    @property
    def reference(self) -> Reference:
        """The reference; computed or read at the first call."""
        return _settled(self)

    def error(self, trajectory: Trajectory) -> float:
        """Largest distance of the watched marker from the reference over all times [m]; nan where not finite."""
        away = np.linalg.norm(trajectory.marker(self.marker) - self.reference.points, axis=1)
        return float(np.max(away))

    def __hash__(self) -> int:
        return hash(self.name)


@cache
def _settled(problem: Problem) -> Reference:
    return problem.settle(problem.times)
