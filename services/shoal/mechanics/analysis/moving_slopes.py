"""Linearisation about a state that moves or is not in balance, by finite differences in minimal coordinates.

Of places p of the machine that describe all its directions, and their rates and the states of the user r, r' = f(p, r,
t) follows from the constraints and Gauss's principle at any state. A and C are differences of fourth order of f and of
the outputs by p and r, with half the step to tell their error.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from shoal.errors import ComputationError
from shoal.mechanics.analysis.evaluate import Evaluator
from shoal.mechanics.numerics.tile import Array

STEP = 2e-3
"""Step of differences, over the size of a place, or of its rate: truncation and round-off are alike, some 1e-12."""
ALONG = 1e-4
"""Time [s], over that in which a place moves by its size, of differences along the motion."""
CLOSE = 1e-14
MOST = 30


class Probed(NamedTuple):
    """Numbers of the probes of a model that are places, their rates and then states of the user, and outputs."""

    places: list[int]
    rates: list[int]
    outputs: list[int]


class Slopes(NamedTuple):
    """Derivatives of r' and of the outputs by p and r, (rates, places + rates) and (outputs, places + rates).

    error: of differences, over the largest derivative of each.
    """

    a: Array
    c: Array
    error: float


def slopes(
    evaluator: Evaluator, q: Array, v: Array, t: float, probed: Probed, size: float, sizes: Sequence[float] = (),
    narrow: float = np.inf,
) -> Slopes:  # fmt: skip
    """Return derivatives at a state q, v at time t [s].

    size: of the machine, for places that are lengths [m]; sizes: of the states of the user; narrow: rates within which
    a force changes [m/s or rad/s].

    Raises ComputationError where the places do not lead to a state of the machine.
    """
    n, m, begun = len(probed.places), len(probed.rates), _values(evaluator, q, v, t)
    base = np.concatenate([begun[probed.places], begun[probed.rates]])
    fast = min(max(float(np.max(np.abs(base[n : 2 * n]), initial=0.0)), 1.0), narrow)
    own = np.maximum(np.abs(base[2 * n :]), sizes)
    steps = STEP * np.concatenate([np.full(n, min(size, 1.0)), np.full(n, fast), own])

    def at(state: Array) -> Array:
        return _right_side(evaluator, *_reached(evaluator, q, v, state, t, probed), t, probed)

    def by(share: float) -> Array:
        columns = []
        for k, h in enumerate(share * steps):
            unit = np.eye(n + m)[k]
            near, far = (at(base + way * h * unit) - at(base - way * h * unit) for way in (1.0, 2.0))
            columns.append((8.0 * near - far) / (12.0 * h))
        return np.stack(columns, axis=1)

    whole, half = by(1.0), by(0.5)
    scale = max(float(np.max(np.abs(half))), 1e-300)
    return Slopes(half[:m], half[m:], float(np.max(np.abs(half - whole))) / scale)


def _values(evaluator: Evaluator, q: Array, v: Array, t: float) -> Array:
    return evaluator.probe(q, v, t).value


def _reached(evaluator: Evaluator, q: Array, v: Array, state: Array, t: float, probed: Probed) -> tuple[Array, Array]:
    """Return coordinates and rates with given places and rates (`state`), near those of another state."""
    n = len(probed.places)
    for _ in range(MOST):
        seen, probe = evaluator.at(q, t=t), evaluator.probe(q, t=t)
        rows = np.vstack([seen.jacobian.toarray(), probe.by_place[probed.places]])
        gap = np.append(seen.gap, probe.value[probed.places] - state[:n])
        move = np.linalg.lstsq(rows, -gap, rcond=1e-12)[0]
        q = q + move
        if float(np.max(np.abs(move), initial=0.0)) <= CLOSE * max(1.0, float(np.max(np.abs(q)))):
            break
    else:
        raise ComputationError(
            f"{evaluator.model.scene.name}: no state of the machine beside the one to linearize about"
        )
    seen, probe = evaluator.at(q, t=t), evaluator.probe(q, t=t)
    slope = probe.by_rate[probed.rates]
    rows, left = (
        np.vstack([seen.jacobian.toarray(), slope]),
        np.append(-seen.rate - seen.jacobian @ v, state[n:] - slope @ v),
    )
    return q, v + np.linalg.lstsq(rows, left, rcond=1e-12)[0]


def _right_side(evaluator: Evaluator, q: Array, v: Array, t: float, probed: Probed) -> Array:
    """Return r' and the outputs at a state."""
    probe, a = evaluator.probe(q, v, t), evaluator.acceleration(q, v, t)
    speed = float(np.max(np.abs(v), initial=0.0))
    bend = np.zeros(len(probed.rates))
    if speed:
        h = ALONG * max(1.0, float(np.max(np.abs(q)))) / speed
        ahead, behind = (_values(evaluator, q + sign * h * v, v, t)[probed.rates] for sign in (1.0, -1.0))
        bend = (ahead - behind) / (2.0 * h)
    return np.concatenate([probe.by_rate[probed.rates] @ a + bend, probe.value[probed.outputs]])
