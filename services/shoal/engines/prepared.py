"""A scene for the native solver: checked once, simulated many times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from shoal.arguments import numbers
from shoal.engines import swarm_motion
from shoal.engines.capabilities import check_acceleration, is_moved_by_swarm
from shoal.engines.contract import Extremes, check_lanes, sampling_times
from shoal.engines.ways import first_believed
from shoal.errors import InputError
from shoal.mechanics.machine import Machine
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene
from shoal.scene.paths import unwrapped
from shoal.trajectory import Array, Trajectory

KEPT = 16
"""So many scenes with values, and lists of sampling times, are remembered."""


class Prepared:
    """A scene that the native solver simulates repeatedly; call it to simulate.

    What depends on the scene alone is computed once and kept by its `Machine`: its model, its integrator and stability
    limit, its reach and its start. Repeated runs use it, in memory that exists already. Later changes to the mappings
    of the given scene do not reach it. Threads may call it at the same time: each call takes a work space of its own.
    """

    def __init__(self, scene: Scene, threads: int | None = None) -> None:
        check_acceleration(scene)
        self._threads = threads
        self._machine = Machine.of(scene)
        self._scene = self._machine.scene.model_copy(update={"solver": scene.solver})
        self._checked: dict[tuple[str, tuple[int, ...], bytes], Array] = {}
        self._set: dict[str, Prepared] = {}

    @property
    def scene(self) -> Scene:
        """A copy of the scene, as scenes of equal content share what is kept."""
        return self._scene.model_copy(deep=True)

    def __reduce__(self) -> tuple[Any, ...]:
        # What is kept holds addresses of this process.
        return Prepared, (self._scene, self._threads)

    def __repr__(self) -> str:
        return f"Prepared({self._scene.name})"

    def __call__(
        self,
        values: Mapping[str, Any] | None = None,
        times: Sequence[float] | Array | None = None,
        *,
        whole: bool = False,
    ) -> Trajectory:
        """Return the motion of `shoal.simulate` without its second runs, to the last bit.

        values: fields of the scene to set, by dotted path; one-dimensional numpy arrays have one number per lane, and
        values equal in all lanes may be numbers. times: sampling instants [s], else the scene's own. New values
        make a new model; lanes that only start differently share the scene's model and integrator.
        whole: whether the trajectory holds its states, which those of swarms do not. Raises InputError.
        """
        lanes = {path: value for path, value in values.items() if _of_lanes(value)} if values else {}
        if values and len(lanes) < len(values):
            return self._with({path: unwrapped(value) for path, value in values.items() if path not in lanes})(
                lanes, times, whole=whole
            )
        wanted = self._wanted(times)
        alone = self._scene.alone(lanes)
        if alone is not None:
            raise InputError(f"{alone}: cannot differ from lane to lane; call once for each of its values")
        if lanes:
            count = check_lanes(self._scene, lanes, self._machine.kept("accepted", Extremes))
            if is_moved_by_swarm(self._scene):
                return swarm_motion.simulate(swarm_motion.only_lane(self._scene, lanes, count), wanted)
            return simulate(self._scene, wanted, lanes, threads=self._threads, machine=self._machine, whole=whole)
        if is_moved_by_swarm(self._scene):
            return swarm_motion.simulate(self._scene, wanted)
        first = simulate(self._scene, wanted, threads=self._threads, machine=self._machine, whole=whole)
        return first_believed(
            self._scene, first, lambda other: simulate(other, wanted, threads=self._threads, whole=whole)
        )

    def _with(self, values: dict[str, Any]) -> Prepared:
        """The scene with some of its fields set."""
        key = repr(values)
        found = self._set.get(key)
        if found is None:
            found = self._set[key] = Prepared(self._scene.with_values(values), self._threads)
            _forget(self._set)
        return found

    def _wanted(self, times: Sequence[float] | Array | None) -> Array:
        if times is None:
            return sampling_times(self._scene, None)
        given = times if type(times) is np.ndarray else numbers("times", times, "times in s")
        key = given.dtype.str, given.shape, given.tobytes()
        wanted = self._checked.get(key)
        if wanted is None:
            wanted = self._checked[key] = sampling_times(self._scene, given)
            _forget(self._checked)
        return wanted.copy()


def prepared(scene: Scene, threads: int | None = None) -> Prepared:
    """Return a scene for repeated runs, made now or by an earlier call."""
    return Machine.of(scene).kept(("prepared", scene.solver, threads), lambda: Prepared(scene, threads))


def _of_lanes(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.ndim == 1


def _forget(kept: dict[Any, Any]) -> None:
    """Remove the oldest entries beyond the limit."""
    for old in list(kept)[:-KEPT]:
        kept.pop(old, None)
