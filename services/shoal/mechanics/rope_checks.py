"""Checks of the ropes of a motion: whether one leaves a pulley, a span vanishes, or one of a kept length pushes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from shoal.findings import Finding
from shoal.mechanics import findings as kinds
from shoal.mechanics.affine import Affine
from shoal.mechanics.numerics.tile import Array
from shoal.mechanics.rope_path import ROUND, tangents, wraps
from shoal.mechanics.states import States
from shoal.scene.ropes import Rope
from shoal.scene.signals import refuse_sampled
from shoal.trajectory import Trajectory

SAMPLES = 201
"""Instants of a motion, evenly spread, at which ropes are looked at besides those that are asked for."""
SPARSE = 10
"""Of many lanes tensions are looked at at each such instant only: they cost a tenth of a millisecond each."""
PUSHES = 1e-6
"""A force below this part of the largest is none."""


def run_watched(run: Callable[[Array], Trajectory], times: Array, scene: Any, whole: bool) -> Trajectory:
    """Return a motion at `times` [s], with what is found out about its ropes at more of them.

    run: returns the motion at given times, with its states; whole: whether the result keeps these. Raises InputError.
    """
    ropes = {name: joint for name, joint in scene.joints.items() if isinstance(joint, Rope)}
    for name in (name for name, rope in ropes.items() if rope.keeps == "exactly"):
        why = "is watched by its tension, which is known of laws in continuous time only; let it keep at-most"
        refuse_sampled(scene, f"joints.{name}.keeps: exactly {why}")
    every = np.union1d(times, np.linspace(0.0, float(times[-1]), SAMPLES))
    found = run(every)
    chosen = np.searchsorted(every, times)
    states = found.states
    findings = [list(one) for one in found.lane_findings] or [[] for _ in range(found.lanes)]
    for lane, one in _found(states, every, ropes):
        findings[lane].append(one)
    model = dict(found.model)
    if signals := model.get("signals"):
        model["signals"] = {name: np.asarray(values)[chosen].tolist() for name, values in signals.items()}
    return replace(
        found,
        times=times,
        points=found.points[chosen],
        angles=found.angles[chosen],
        velocities=None if found.velocities is None else found.velocities[chosen],
        rates=None if found.rates is None else found.rates[chosen],
        lane_findings=findings if any(findings) else found.lane_findings,
        end=None if any(findings) else found.end,
        model=model,
        states=states._replace(**{k: getattr(states, k)[chosen] for k in ("q", "v", "contacts")}) if whole else None,
    )


def _found(states: States, times: Array, ropes: dict[str, Rope]) -> Iterator[tuple[int, Finding]]:
    """Yield lanes, and what is found out about a rope or a distance in them."""
    yield from _vanishing(states, times)
    for name, rope in ropes.items():
        if states.model.dimensions == 2 and any(np.any(guide.radius) for guide in rope.over):
            yield from _left(states, times, name, rope)
        if rope.keeps == "exactly":
            yield from _pushing(states, times, name)


def _vanishing(states: States, times: Array) -> Iterator[tuple[int, Finding]]:
    """Yield lanes in which a straight span has vanished, as its length goes on below zero."""
    for name, unknown in states.model.spans:
        for lane in range(states.q.shape[-1]):
            gone = states.q[:, unknown, lane] <= 0.0
            if np.any(gone):
                time = float(times[int(np.argmax(gone))])
                said = (
                    f"{name}: the turn reaches half a turn"
                    if name.startswith("loads.")
                    else f"a span of {name} vanishes"
                )
                yield lane, kinds.SPAN_VANISHES.found(f"{said} before t = {time:.6g} s", time=time)


def _left(states: States, times: Array, name: str, rope: Rope) -> Iterator[tuple[int, Finding]]:
    """Yield lanes in which a rope has left a pulley."""
    places = (rope.first, *rope.over, rope.second)
    vectors = states.model.rope_places[name]
    for lane in range(states.q.shape[-1]):
        centres = np.stack([_value(vector, states.q[..., lane], lane) for vector in vectors], axis=1)
        alive = np.all(np.isfinite(centres), axis=(1, 2))
        radii = [_of_lane(place.signed_radius, lane) for place in places]
        along, _ = tangents(centres[alive], radii)
        if not len(along):
            continue
        wrapped = wraps(along, radii, [guide.turns for guide in rope.over])
        lost = ~(wrapped >= -ROUND) & (np.asarray(radii[1:-1]) != 0.0)
        if np.any(lost):
            sample, guide = (int(part) for part in np.argwhere(lost)[0])
            time = float(times[alive][sample])
            yield (
                lane,
                kinds.ROPE_LEAVES.found(
                    f"rope {name} leaves over.{guide} ({rope.over[guide].body}) at t = {time:.6g} s", time=time
                ),
            )


def _pushing(states: States, times: Array, name: str) -> Iterator[tuple[int, Finding]]:
    """Yield lanes in which a rope that keeps its length exactly pushes."""
    from shoal.mechanics.analysis.evaluate import Evaluator

    model = states.model
    rows = model.tensions[name]
    for lane in range(states.q.shape[-1]):
        evaluator = Evaluator(model, lane)
        tension = np.full((len(times), len(rows)), np.nan)
        for k, time in list(enumerate(times.tolist()))[:: 1 if states.q.shape[-1] == 1 else SPARSE]:
            q, v = states.q[k, :, lane].copy(), states.v[k, :, lane].copy()
            if not np.all(np.isfinite(q)):
                break
            evaluator.remember(q)
            here = evaluator.at(q, v, time)
            left = here.force - evaluator.mass @ evaluator.acceleration(q, v, time)
            tension[k] = np.linalg.lstsq(here.jacobian.toarray().T, left)[0][rows]
        pushes = tension < -PUSHES * np.nanmax(np.abs(tension), initial=0.0)
        if np.any(pushes):
            sample = int(np.argwhere(pushes)[0][0])
            time, force = float(times[sample]), float(np.nanmin(tension[sample]))
            yield (
                lane,
                kinds.SLACK.found(
                    f"rope {name} would have to push with {-force:.4g} N at t = {time:.6g} s", time=time, force=force
                ),
            )


def _value(vector: Affine, q: Array, lane: int) -> Array:
    unknowns, coefficients, constant = vector.by_lane
    return np.asarray(q[:, unknowns] @ coefficients[lane % len(coefficients)] + constant[lane % len(constant)])


def _of_lane(number: Any, lane: int) -> float:
    return float(np.ravel(number)[lane % np.size(number)])
