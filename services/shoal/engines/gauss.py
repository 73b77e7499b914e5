"""The native engine: Gauss's principle, compiled, many lanes at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from shoal.engines.capabilities import CAPABILITIES
from shoal.engines.contract import Capabilities, check_lanes, sampling_times
from shoal.scene import Scene
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
        """What it can simulate."""
        return CAPABILITIES[self.name]

    def simulate(self, scene: Scene, times: Sequence[float] | Array | None = None) -> Trajectory:
        """Run one scene, under `auto` by the first integrator that can; see `Engine`."""
        from shoal.engines import swarm_motion
        from shoal.mechanics.persist import persist

        wanted = sampling_times(scene, times)
        if swarm_motion.asked_for(scene):
            return swarm_motion.simulate(scene, wanted)
        return persist(scene, wanted, self.threads)

    def simulate_many(
        self, scene: Scene, values: Mapping[str, Array], times: Sequence[float] | Array | None = None
    ) -> Trajectory:
        """Run one scene per lane, all in compiled tiles; see `Engine`."""
        from shoal.engines import swarm_motion
        from shoal.mechanics.simulate import simulate

        swarm_motion.refuse_lanes(scene, check_lanes(scene, values))
        return simulate(scene, sampling_times(scene, times), values, threads=self.threads)
