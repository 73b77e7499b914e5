"""An engine that is watched, and that fails where a test wants it to."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.engines.contract import Capabilities, Engine
from shoal.identification.forward import ForwardModel
from shoal.mechanics.findings import NOT_FINITE
from shoal.scene import Scene
from shoal.trajectory import Array, Trajectory

Fails = Callable[[Mapping[str, Array]], Array]


@dataclass
class Watched:
    """Another engine, whose lanes fail where `fails` says so of their values; ends: how long each lane ran [s]."""

    engine: Engine
    fails: Fails = lambda values: np.zeros(1, dtype=bool)
    ends: list[float] = field(default_factory=list)
    failures: int = 0

    @property
    def name(self) -> str:
        return self.engine.name

    @property
    def capabilities(self) -> Capabilities:
        return self.engine.capabilities

    def simulate(self, scene: Scene, times: Sequence[float] | Array | None = None) -> Trajectory:
        raise NotImplementedError("lanes only")

    def simulate_many(
        self, scene: Scene, values: Mapping[str, Array], times: Sequence[float] | Array | None = None
    ) -> Trajectory:
        found = self.engine.simulate_many(scene, values, times)
        assert times is not None
        self.ends += [float(times[-1])] * len(found.status)
        failed = np.broadcast_to(self.fails(values), len(found.status))
        self.failures += int(np.sum(failed))
        before = found.lane_findings or [[] for _ in found.status]
        pairs = zip(before, failed, strict=True)
        return replace(found, lane_findings=[[NOT_FINITE.found("made to")] if bad else one for one, bad in pairs])


@pytest.fixture
def watched() -> Callable[..., Watched]:
    """Put a watched engine into a model, and return it."""

    def put(model: ForwardModel, **settings: Fails) -> Watched:
        model.engine = Watched(get_engine("gauss"), **settings)
        return model.engine

    return put
