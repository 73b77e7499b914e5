"""Deadline of an identification, one for all its stages, and the predicted cost of a simulation."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeVar

import numpy as np

from shoal.compile import clock
from shoal.scene import Scene
from shoal.trajectory import Array, Trajectory

T = TypeVar("T")
Run = Callable[[Scene, Array], Trajectory]

_OVER, _GRACE = 0.1, 1.0
"""Of the limit, and seconds: what the answer may take beyond it once the search was stopped."""
_PROBE, _LONGEST, _SHARE = 1.0 / 256.0, 0.25, 0.25
"""Of a record, simulated first to see its pace; at most; and of the time left, what a longer probe may take."""
_STEPS, _MORE = 1000, 4.0
"""Of an adaptive integrator, that any run may take; and times those by the pace of the runs before."""


class TimeIsUp(Exception):  # noqa: N818 - an end that is expected, not an error
    """The time allowed for an identification has passed, or what comes next would take longer than is left."""


class Deadline:
    """When an identification has to end. limit [s]: as asked for, from its beginning; cost [s]: of the dearest call.

    A simulation cannot be broken off, so each is refused that would take longer than is left, by the pace of those
    before it; of the first a beginning is run to measure it.
    """

    def __init__(self, limit: float) -> None:
        self.limit = limit
        self.cost = 0.0
        self._end = clock.now() + limit
        self._extended = False
        self._paces: dict[object, tuple[float, float, float]] = {}

    @property
    def remaining(self) -> float:
        """Seconds left, compiling aside."""
        return self._end - clock.now()

    def extend(self) -> None:
        """Allow what the answer takes after a search that was stopped, once."""
        if not self._extended:
            self._end += _OVER * self.limit + _GRACE
            self._extended = True

    def spend(self) -> None:
        """End all time that is left: every further simulation is refused."""
        self._end = -np.inf

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Time that does not count."""
        begin = clock.now()
        try:
            yield
        finally:
            self._end += clock.now() - begin

    def check(self) -> None:
        """Raises TimeIsUp."""
        if self.remaining <= 0.0:
            raise TimeIsUp

    def run(self, kind: object, scene: Scene, times: Array, run: Run) -> Trajectory:
        """A simulation of a scene at times [s]; kind: simulations of one kind take equally long. Raises TimeIsUp."""
        self.check()
        end = float(times[-1])
        if end <= 0.0:
            return run(scene, times)
        if kind not in self._paces:
            self._probe(kind, scene, times, run)
        pace, each, taken = self._paces[kind]
        self.cost = max(self.cost, pace * end)
        if pace * end > self.remaining:
            raise TimeIsUp
        # Other values of the parameters may need shorter steps.
        most = int(max(self.remaining / each, _MORE * taken * end)) + _STEPS
        if most < scene.solver.max_steps:
            scene = scene.model_copy(update={"solver": scene.solver.model_copy(update={"max_steps": most})})
        begin = clock.now()
        found = run(scene, times)
        self._learn(kind, clock.now() - begin, end, found)
        return found

    def _probe(self, kind: object, scene: Scene, times: Array, run: Run) -> None:
        """See the pace by the beginning of a record, a longer one while what every run costs may be most of it.

        Where there is no time for a longer one, a shorter one shows the fixed cost of a run, such as assembling it.
        """

        def spent_on(part: float) -> tuple[float, Trajectory]:
            begin = clock.now()
            found = run(scene, times[-1:] * part)
            return clock.now() - begin, found

        part, end = _PROBE, float(times[-1])
        while True:
            spent, found = spent_on(part)
            self._paces.pop(kind, None)
            self._learn(kind, spent, part * end, found)
            if spent / part <= self.remaining:
                return
            if part >= _LONGEST or 4 * spent > _SHARE * self.remaining:
                break
            part *= 4
        shorter, _ = spent_on(part / 4)
        whole = shorter + max(spent - shorter, 0.0) / (part - part / 4) * (1.0 - part / 4)
        self._paces[kind] = (min(whole, spent / part) / end, *self._paces[kind][1:])

    def _learn(self, kind: object, spent: float, simulated: float, found: Trajectory) -> None:
        """Note seconds for a simulated second and for a step, and steps a second; a single slow run counts for half."""
        pace, each, taken = spent / simulated, max(spent / max(found.steps, 1), 1e-9), found.steps / simulated
        before = self._paces.get(kind, (pace, each, taken))
        halfway = (min(pace, (pace + before[0]) / 2), min(each, (each + before[1]) / 2))
        self._paces[kind] = (*halfway, max(taken, before[2]))


def unless_late(function: Callable[[], T], otherwise: T) -> T:
    """Return the result of a function, or another value where no time is left for it."""
    try:
        return function()
    except TimeIsUp:
        return otherwise
