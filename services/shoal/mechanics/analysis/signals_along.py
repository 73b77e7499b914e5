"""Signals and states along a motion, as a controller would log them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from shoal.mechanics.analysis.evaluate import Evaluator
from shoal.mechanics.analysis.felt import lane_start, way_between
from shoal.mechanics.assembly.build import build
from shoal.mechanics.machine import Machine
from shoal.mechanics.model import Model
from shoal.mechanics.numerics.tile import Array
from shoal.mechanics.states import States
from shoal.scene import Scene, SignalFunction
from shoal.scene.signals import refuse_sampled, written_out


def signals_along(
    states: States, times: Array, scene: Scene, values: Mapping[str, Array], names: tuple[str, ...]
) -> Array:
    """Return signals and states by their names, (names, samples, lanes); nan in lanes without a motion.

    times [s]: of the samples, the first is the start. values: of fields in which lanes have models of their own.
    """
    found = np.full((len(names), len(times), states.q.shape[2]), np.nan)
    finite = np.all(np.isfinite(states.q) & np.isfinite(states.v), axis=(0, 1))
    recorded = states.model.recorded
    if all(name in recorded for name in names):
        found[:] = np.moveaxis(states.signals[:, [recorded.index(name) for name in names]], 1, 0)
        if np.all(np.isfinite(found[..., finite])):
            return found
    refuse_sampled(scene, f"of {', '.join(names)} nothing is recorded; let a load follow it, or take a state")
    probes = tuple(written_out(scene, SignalFunction(expression=name)) for name in names)
    model = (
        None if values else _on(states.model, build(states.model.stated, states.model.lanes, times[-1], None, probes))
    )
    for lane in np.flatnonzero(finite).tolist():
        if model is None:
            one = scene.with_values({path: float(numbers[lane]) for path, numbers in values.items()})
            evaluator = Evaluator(
                lane_start(states, Machine.of(one).probed(probes, float(times[-1])), lane), one_sided=True
            )
        else:
            evaluator = Evaluator(model, lane, one_sided=True)
        q, v = states.q[..., lane], states.v[..., lane]
        way, sample = way_between(evaluator, times, q, v, 0 if model is None else lane)
        for pose, number in zip(way, sample.tolist(), strict=True):
            evaluator.remember(pose)
            if number >= 0:
                found[:, number, lane] = evaluator.values(q[number], v[number], float(times[number]))
    return found


def _on(begun: Model, model: Model) -> Model:
    """Return a model with probes that starts where another one of the same scene does."""
    turned = np.broadcast_to(model.signal_angles, (len(model.signal_angles), begun.lanes)).copy()
    turned[: len(begun.signal_angles)] = begun.signal_angles
    return replace(
        model, q0=begun.q0, v0=begun.v0, start_angles=begun.start_angles, signal_angles=turned, shared_tiles={}
    )
