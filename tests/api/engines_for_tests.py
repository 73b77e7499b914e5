"""An engine that crashes, hangs or answers at once, by the name of the scene; workers import it by this name."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from shoal.compile import clock
from shoal.engines import ENGINES
from shoal.engines.contract import Capabilities, sampling_times
from shoal.scene import Scene
from shoal.trajectory import Array, Trajectory

NAME = "obedient"


class Obedient:
    """Does what the scene's name says: `hang`, `short`, `compile`, `stuck`, `crash`, `nan`, `huge`, else it rests.

    It writes its process id into the file that the description names, if any.
    """

    name = NAME
    capabilities = Capabilities(frozenset({"rigid"}), frozenset(), frozenset(), frozenset(), lanes=True)

    def simulate(self, scene: Scene, times: Sequence[float] | Array | None = None) -> Trajectory:
        return self.simulate_many(scene, {}, times)

    def simulate_many(
        self, scene: Scene, values: Mapping[str, Array], times: Sequence[float] | Array | None = None
    ) -> Trajectory:
        if scene.description.startswith("/"):
            Path(scene.description).write_text(str(os.getpid()))
        if scene.name == "hang":
            time.sleep(3600)
        if scene.name == "short":
            time.sleep(1.0)
        if scene.name == "compile":
            with clock.stopped():
                time.sleep(4.5)
        if scene.name == "stuck":
            with clock.stopped():
                time.sleep(3600)
        if scene.name == "crash":
            os.kill(os.getpid(), signal.SIGKILL)
        if scene.name == "huge":
            np.ones(3 * 10**8)
        instants = sampling_times(scene, times)
        lanes = max([len(column) for column in values.values()], default=1)
        shape = (len(instants), len(scene.markers), lanes)
        number = np.nan if scene.name == "nan" else 0.0
        return Trajectory(
            engine=NAME,
            times=instants,
            markers=tuple(scene.markers),
            points=np.full((shape[0], shape[1], 2, lanes), number),
            angles=np.zeros(shape),
            energy_drift=np.zeros(lanes),
            constraint_drift=np.zeros(lanes),
            steps=1,
            wall_s=0.0,
        )


def obedient() -> Obedient:
    ENGINES[NAME] = Obedient
    return Obedient()
