"""The motion of a scene at instants that are asked for one after the other.

The native solver starts at time zero from angles and rates; it cannot be started from the bent shape in which it
stopped, its functions of time begin at zero, and its checks are those of a whole run. So a motion is computed ahead up
to the horizon and sampled where the next questions are expected, with the solver's own interpolation. A question that
was not expected costs a new run from zero; its answer is still the one that `shoal simulate --at` gives. So does an
input that changes: the run is the one of a scene that has the input as a table.
"""

from __future__ import annotations

import math

import numpy as np

from shoal.engines import get_engine
from shoal.errors import ComputationError
from shoal.fmu.energy import energies
from shoal.fmu.inputs import InputSignals
from shoal.scene import Scene
from shoal.trajectory import Array, Trajectory

SAME = 1e-9
"""Two instants closer than this part of a communication step are one."""
MOST = 100_000
"""Samples of one run ahead."""


class Ahead:
    """A scene in motion. stop [s]: up to where it will be asked for, as far as that is known.

    inputs: values by path that change during the run
    """

    def __init__(self, scene: Scene, stop: float | None = None, inputs: dict[str, float] | None = None) -> None:
        self._inputs, self._stated = InputSignals(inputs or {}), scene
        self._scene, self._horizon = self._inputs.applied(scene), stop or scene.solver.duration
        self._fresh = False
        self._run: Trajectory | None = None
        self._energies: Array | None = None

    def take(self, time: float, step: float, values: dict[str, float]) -> None:
        """Take the inputs from a time on [s], for a communication step. Raises InputError."""
        if self._inputs.take(time, step, values):
            self._scene = self._inputs.applied(self._stated)
            self._run, self._energies, self._fresh = None, None, True

    def point(self, marker: str, time: float, step: float) -> tuple[float, ...]:
        """A marker [m] at a time [s]; step [s]: the next questions are expected so far apart, if it is finite.

        Raises InputError, and ComputationError if the motion up to the horizon cannot be trusted.
        """
        run, sample = self._sample(time, step)
        return tuple(run.marker(marker)[sample].tolist())

    def energy(self, time: float, step: float) -> float:
        """Kinetic, elastic and gravitational energy [J] at a time [s]; raises what `point` raises."""
        run, sample = self._sample(time, step)
        if self._energies is None:
            self._energies = energies(self._scene, run.times)
        return float(self._energies[sample])

    def reach(self, time: float, step: float) -> None:
        """Make sure that there is a motion up to a time [s]; raises what `point` raises."""
        self._sample(time, step)

    def _sample(self, time: float, step: float) -> tuple[Trajectory, int]:
        """The run that has a time, and which of its samples that is."""
        if self._run is not None:
            sample = int(np.searchsorted(self._run.times, time - SAME * step))
            if sample < len(self._run.times) and self._run.times[sample] <= time + SAME * step:
                return self._run, sample
        self._run, self._energies = self._computed(time, step), None
        return self._run, 0

    def _computed(self, time: float, step: float) -> Trajectory:
        """The samples from a time on."""
        if time > self._horizon * (1 + SAME):
            self._horizon *= math.ceil(time / self._horizon)
        count = math.floor(min(max(self._horizon - time, 0.0) / step + SAME, MOST))
        if self._fresh:
            # What has just changed may change again with the next step.
            count, self._fresh = 0, False
        run = get_engine("gauss").simulate(self._scene, np.append(time, time + step * np.arange(1, count + 1)))
        if not run.ok:
            raise ComputationError(f"{self._scene.name}: the motion up to {run.times[-1]:g} s: {run.explanation}")
        return run
