"""Bounds of a pendulum that may or may not reach its stop, judged by dense sampling."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import shoal
from shoal.engines import get_engine
from shoal.scene import Scene

DOWN = -np.pi / 2
TIMES = [0.5, 1.0, 1.5, 3.0]
SCENE = Scene.parse({
    "name": "rod", "gravity": [0.0, -9.81],
    "bodies": {"B": {"kind": "rigid-body", "mass": 1.0, "inertia": 1 / 12, "centre_of_mass": [0.5, 0.0],
                     "named_points": {"end": [1.0, 0.0]}}},
    "joints": {"O": {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "B"},
                     "stops": {"min": DOWN - 0.9, "restitution": 0.6}}},
    "markers": {"P": {"body": "B", "point": "end"}}, "initial": {"B": {"angle": DOWN + 1.0, "rate": 0.0}},
    "solver": {"duration": 3.0},
})  # fmt: skip
ANGLE, STOP = "initial.B.angle", "joints.O.stops.min"
STUDIES: dict[str, dict[str, tuple[float, float]]] = {
    "some reach it": {ANGLE: (DOWN + 0.85, DOWN + 0.95)},
    "one in fifty reaches it": {ANGLE: (DOWN + 0.851, DOWN + 0.901)},
    "all reach it": {ANGLE: (DOWN + 1.0, DOWN + 1.1)},
    "the stop itself is not known": {STOP: (DOWN - 1.2, DOWN - 0.9)},
    "a corner of the box reaches it": {ANGLE: (DOWN + 0.85, DOWN + 0.95), STOP: (DOWN - 1.03, DOWN - 0.94)},
}


@pytest.mark.slow
@pytest.mark.parametrize("name", STUDIES)
def test_outer_bounds_hold_whether_or_not_a_stop_is_reached(name: str) -> None:
    vary = STUDIES[name]
    found = shoal.uncertain(SCENE, vary, at=TIMES)
    assert found.bounds is not None
    lanes, rng = 4000, np.random.default_rng(0)
    values = {path: rng.uniform(*ends, lanes) for path, ends in vary.items()}
    if len(vary) == 1:
        values = {path: np.linspace(*ends, lanes) for path, ends in vary.items()}
    dense: Any = get_engine("gauss").simulate_many(SCENE, values, np.array(TIMES))
    assert dense.ok
    for k, axis in enumerate("xy"):
        low, high = (found.column("P", axis, getattr(found.bounds, side)) for side in ("lower_outer", "upper_outer"))
        assert np.all(dense.points[:, 0, k].min(axis=1) >= low - 1e-9)
        assert np.all(dense.points[:, 0, k].max(axis=1) <= high + 1e-9)
    if name in ("all reach it", "the stop itself is not known"):
        assert found.ok, found.message
