"""How long an identification may take: one deadline for all its stages, and what a simulation will cost."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, TypeVar

from shoal.scene import Scene
from shoal.trajectory import Array, Trajectory

if TYPE_CHECKING:
    from shoal.identification.forward import ForwardModel

T = TypeVar("T")
Run = Callable[[Scene, Array], Trajectory]

_OVER, _GRACE = 0.1, 1.0
"""Of the limit, and seconds: what the answer may take beyond it once the search was stopped."""
_PROBE, _TOLD = 1.0 / 256.0, 0.02
"""Of a record, simulated first to see its pace; and how long [s] such a run takes to tell it."""
_STEPS = 1000
"""Of an adaptive integrator, that any run may take."""


class TimeIsUp(Exception):  # noqa: N818 - an end that is expected, not an error
    """The time allowed for an identification has passed, or what comes next would take longer than is left.

    model: whose best so far stands, where it is not the one that was asked
    """

    def __init__(self, model: ForwardModel | None = None) -> None:
        super().__init__()
        self.model = model


class Deadline:
    """When an identification has to end. limit [s]: as asked for, from its beginning; cost [s]: of the dearest call.

    A simulation cannot be broken off, so each is refused that would take longer than is left, by the pace of those
    before it; of the first the beginning is run to tell.
    """

    def __init__(self, limit: float) -> None:
        self.limit = limit
        self.cost = 0.0
        self._end = time.monotonic() + limit
        self._extended = False
        self._paces: dict[object, tuple[float, float]] = {}

    @property
    def remaining(self) -> float:
        """Seconds left."""
        return self._end - time.monotonic()

    def extend(self) -> None:
        """Allow what the answer takes after a search that was stopped, once."""
        if not self._extended:
            self._end += _OVER * self.limit + _GRACE
            self._extended = True

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Time that does not count."""
        begin = time.monotonic()
        try:
            yield
        finally:
            self._end += time.monotonic() - begin

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
        part = _PROBE
        while kind not in self._paces and part < 0.5:
            begin = time.monotonic()
            probe = run(scene, times[-1:] * part)
            if (spent := time.monotonic() - begin) > _TOLD:
                self._learn(kind, spent, part * end, probe)
            part *= 4
            self.check()
        if kind in self._paces:
            pace, each = self._paces[kind]
            self.cost = max(self.cost, pace * end)
            if pace * end > self.remaining:
                raise TimeIsUp
            # Other values of the parameters may need shorter steps.
            most = int(self.remaining / each) + _STEPS
            if most < scene.solver.max_steps:
                scene = scene.model_copy(update={"solver": scene.solver.model_copy(update={"max_steps": most})})
        begin = time.monotonic()
        found = run(scene, times)
        self._learn(kind, time.monotonic() - begin, end, found)
        return found

    def _learn(self, kind: object, spent: float, simulated: float, found: Trajectory) -> None:
        """Note seconds for a simulated second, and for a step."""
        self._paces[kind] = (spent / simulated, max(spent / max(found.steps, 1), 1e-9))


def unless_late(function: Callable[[], T], otherwise: T) -> T:
    """What a function gives, or something else where no time is left for it."""
    try:
        return function()
    except TimeIsUp:
        return otherwise
