"""A scene as a function of some of its fields: where its markers are at all instants. Failed runs are repeated."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from shoal.engines.contract import Engine
from shoal.errors import InputError
from shoal.response.inputs import BoolArray
from shoal.response.kept import Keep
from shoal.response.runs import Answers
from shoal.scene import Scene
from shoal.trajectory import Array, Status, Trajectory

CHUNK = 2_000_000
"""So many numbers of an answer are computed in one call."""
FINER = 4.0, 16.0
"""A run that failed is repeated with a step, and adaptive errors, smaller by this, then by that."""
LEAST_TOLERANCE = 1e-14


@dataclass(frozen=True)
class Machine:
    """Call it with path -> values. Columns: instants, markers and quantities, in this order.

    Quantities are x, y [m] and angle [rad]; in space x, y and z, where an angle in the plane z = 0 may jump.

    columns: their number along each of the three; told: what is told instead, (lanes, columns), of the motion of a
    scene with some values of its lanes; keep: of the runs; fixed: values of parameters that are set in the scene, in
    words, by which these are told apart
    """

    scene: Scene
    times: Array
    engine: Engine
    told: Callable[[Trajectory, Scene, Mapping[str, Array]], Array] = field(default_factory=lambda: _columns)
    keep: Keep | None = None
    fixed: str = ""

    def at(self, values: Mapping[str, float]) -> Machine:
        """The same machine with these values. Raises InputError."""
        return replace(self, scene=self.scene.with_values(values), fixed=f"{self.fixed}{dict(values)}")

    @property
    def quantities(self) -> tuple[str, ...]:
        """What is told of every marker."""
        return ("x", "y", "angle") if self.scene.dimensions == 2 else ("x", "y", "z")

    @property
    def columns(self) -> tuple[int, int, int]:
        """Instants, markers, quantities."""
        return len(self.times), len(self.scene.markers), len(self.quantities)

    def __call__(self, values: Mapping[str, Array]) -> Answers:
        """The answers of all runs. Raises InputError."""
        count = len(next(iter(values.values())))
        chunk = max(64, CHUNK // int(np.prod(self.columns)))
        parts = [
            self._known({path: lanes[k : k + chunk] for path, lanes in values.items()}) for k in range(0, count, chunk)
        ]
        return Answers(
            np.concatenate([part.values for part in parts]),
            np.concatenate([part.good for part in parts]),
            sum(part.repeated for part in parts),
            next((part.why for part in parts if part.why), ""),
        )

    def _known(self, values: Mapping[str, Array]) -> Answers:
        if self.keep is None:
            return self._some(values)
        return self.keep(repr(getattr(self.told, "__self__", "markers")) + self.fixed, values, self._some)

    def _some(self, values: Mapping[str, Array]) -> Answers:
        motion = self.engine.simulate_many(self.scene, values, self.times)
        found, good = self.told(motion, self.scene, values), _good(motion)
        why, repeated = motion.message, 0
        for finer in FINER:
            left = np.flatnonzero(~good)
            if not left.size:
                break
            repeated = max(repeated, left.size)
            careful = self.scene.with_values(_careful(self.scene, motion, finer))
            those = {path: at[left] for path, at in values.items()}
            try:
                again = self.engine.simulate_many(careful, those, self.times)
            except InputError as error:
                why = str(error)
                break
            found[left], good[left] = self.told(again, careful, those), _good(again)
            why = again.message
        return Answers(found, good, repeated, "" if good.all() else why)


def _careful(scene: Scene, motion: Trajectory, finer: float) -> dict[str, float]:
    """Settings of the solver for runs that failed."""
    solver = scene.solver
    return {
        "solver.step": solver.step / finer,
        "solver.relative_tolerance": max(solver.relative_tolerance / finer, LEAST_TOLERANCE),
        "solver.absolute_tolerance": solver.absolute_tolerance / finer,
    }


def _columns(motion: Trajectory, _scene: Scene, _values: Mapping[str, Array]) -> Array:
    """(lanes, instants * markers * 3)."""
    plane = motion.points.shape[2] == 2
    whole = np.concatenate([motion.points, motion.angles[:, :, None]], axis=2) if plane else motion.points
    return np.moveaxis(whole, -1, 0).reshape(motion.lanes, -1).copy()


def _good(motion: Trajectory) -> BoolArray:
    good = np.array([status is Status.OK for status in motion.status])
    finite = np.isfinite(motion.points).all(axis=(0, 1, 2)) & np.isfinite(motion.angles).all(axis=(0, 1))
    return np.asarray(good & finite)
