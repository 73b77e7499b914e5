"""Lanes of engines that run one scene at a time."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from shoal.engines.capabilities import require
from shoal.engines.contract import Engine, check_lanes, sampling_times
from shoal.errors import InputError
from shoal.mechanics import findings as kinds
from shoal.scene import Scene
from shoal.trajectory import Array, Trajectory


class OneByOne:
    """Engine that has no lanes of its own."""

    def simulate_many(
        self: Engine, scene: Scene, values: Mapping[str, Array], times: Sequence[float] | Array | None = None
    ) -> Trajectory:
        """Run one scene per lane, one after the other; a lane that failed is not a number and has its status."""
        return one_by_one(self, scene, values, times)


def one_by_one(
    engine: Engine,
    scene: Scene,
    values: Mapping[str, Array],
    times: Sequence[float] | Array | None = None,
    **options: bool,
) -> Trajectory:
    """Simulate the lanes one after the other; a lane that failed is NaN and has its status.

    options: of the engine's `simulate`; states come with the model of the first lane that has them
    """
    started = time.perf_counter()
    require(engine, scene)
    lanes = check_lanes(scene, values)
    wanted = sampling_times(scene, times)
    runs = []
    for lane in range(lanes):
        numbers = {path: float(np.ravel(column)[lane]) for path, column in values.items()}
        try:
            runs.append(engine.simulate(scene.with_values(numbers), wanted, **options))
        except InputError as error:
            runs.append(_refused(engine, scene, wanted, str(error)))
    return _side_by_side(runs, time.perf_counter() - started)


def _refused(engine: Engine, scene: Scene, wanted: Array, message: str) -> Trajectory:
    shape = (len(wanted), len(scene.markers))
    return Trajectory(
        engine=engine.name,
        times=wanted,
        markers=tuple(scene.markers),
        points=np.full((*shape, scene.dimensions, 1), np.nan),
        angles=np.full((*shape, 1), np.nan),
        energy_drift=np.full(1, np.nan),
        constraint_drift=np.full(1, np.nan),
        steps=0,
        wall_s=0.0,
        lane_findings=[[kinds.REFUSED.found(message)]],
    )


def _side_by_side(runs: Sequence[Trajectory], wall_s: float) -> Trajectory:
    """Runs of one lane each as the lanes of one trajectory; only what may be believed keeps its numbers."""

    def together(parts: Sequence[Array]) -> Array:
        return np.concatenate([x if run.ok else np.nan * x for x, run in zip(parts, runs, strict=True)], axis=-1)

    def known(parts: Sequence[Array | None]) -> Array | None:
        # A lane that was refused tells nothing, not even whether its engine knows velocities.
        one = next((part for part in parts if part is not None), None)
        return None if one is None else together([np.nan * one if part is None else part for part in parts])

    states = [run.states for run in runs]
    first = next((one for one in states if one is not None), None)
    if first is not None:
        fields = ("q", "v", "contacts", "signals")
        first = first._replace(**{field: known([getattr(one, field, None) for one in states]) for field in fields})
    return replace(
        runs[0],
        points=together([run.points for run in runs]),
        angles=together([run.angles for run in runs]),
        velocities=known([run.velocities for run in runs]),
        rates=known([run.rates for run in runs]),
        energy_drift=np.concatenate([run.energy_drift for run in runs]),
        constraint_drift=np.concatenate([run.constraint_drift for run in runs]),
        steps=max(run.steps for run in runs),
        wall_s=wall_s,
        lane_findings=[run.findings for run in runs],
        model=next((run.model for run in runs if run.model), {}),
        states=first,
        words=[next(iter(run.words), ()) for run in runs] if any(run.words for run in runs) else (),
        changes=[run.changed() for run in runs],
    )
