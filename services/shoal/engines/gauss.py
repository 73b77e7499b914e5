"""The native engine: Gauss's principle, compiled, many lanes at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import get_args

import numpy as np

from shoal.engines.capabilities import FEATURES
from shoal.engines.contract import Capabilities
from shoal.engines.one_by_one import one_by_one
from shoal.scene import JOINT_KINDS, LOAD_KINDS, Scene
from shoal.scene.bodies import Element
from shoal.trajectory import Array, Trajectory


@dataclass(frozen=True)
class GaussEngine:
    """Shoal's own solver. threads: how many share the tiles of lanes (default: one per core)."""

    threads: int | None = None

    @property
    def name(self) -> str:
        """Name by which the engine is chosen."""
        return "gauss"

    @property
    def capabilities(self) -> Capabilities:
        """All that a scene may state: scenes are made for this engine, and the mechanics refuse what they lack."""
        return Capabilities(
            elements=frozenset(get_args(Element)),
            joints=frozenset(JOINT_KINDS),
            loads=frozenset(LOAD_KINDS),
            features=frozenset(FEATURES),
            lanes=True,
        )

    def simulate(
        self, scene: Scene, times: Sequence[float] | Array | None = None, *, whole: bool = False
    ) -> Trajectory:
        """Run one scene, under `auto` by the first integrator that can; whole: with its states; see `Engine`."""
        from shoal.engines.prepared import prepared

        return prepared(scene, self.threads)(times=times, whole=whole)

    def simulate_many(
        self,
        scene: Scene,
        values: Mapping[str, Array],
        times: Sequence[float] | Array | None = None,
        *,
        whole: bool = False,
    ) -> Trajectory:
        """Run one scene per lane, all in compiled tiles; whole: with their states; see `Engine`.

        Lanes that differ inside functions of time, or in entries of matrices, are run one by one.
        """
        from shoal.engines.prepared import prepared

        lanes = {path: np.ravel(np.asarray(numbers, dtype=float)) for path, numbers in values.items()}
        if scene.alone(lanes) is not None:
            return one_by_one(self, scene, lanes, times, whole=whole)
        return prepared(scene, self.threads)(lanes, times, whole=whole)
