"""Every small scene goes on where a run of it ended: two runs in a row are one, whatever it is made of."""

from __future__ import annotations

import json
import re
from typing import Any

import pytest
from shoal.engines import get_engine
from shoal.scene import Scene

HALF = 0.02
IMPLICIT = 1e-6
"""What generalized-alpha forgets between two runs: the acceleration that it carries from step to step."""


def later(data: Any) -> Any:
    """The same fields with functions of time as they are after `HALF`."""
    if isinstance(data, dict) and "table" in data:
        return data | {"table": [[time - HALF, value] for time, value in data["table"]]}
    if isinstance(data, dict):
        return {key: one if key in ("name", "point", "elastic") else later(one) for key, one in data.items()}
    if isinstance(data, list):
        return [later(one) for one in data]
    return re.sub(r"\bt\b", f"(t + {HALF})", data) if isinstance(data, str) else data


@pytest.mark.slow
def test_two_runs_in_a_row_are_one(scenes: list[Scene]) -> None:
    engine, compared = get_engine("gauss"), 0
    followed = [one for one in scenes if one.name not in ("stopped", "roped", "sticking", "bouncing")]
    for scene in (one.with_values({"solver.integrator": "auto"}) for one in followed):
        whole = engine.simulate(scene, [HALF, 2 * HALF])
        first = engine.simulate(scene, [0.0, HALF])
        assert first.ok, f"{scene.name}: {first.message}"
        data = scene.model_dump(mode="json")
        moving = {part: later(data[part]) for part in ("joints", "loads", "ground_points")}
        end = json.loads(json.dumps(first.to_json()))["end"]
        again = engine.simulate(Scene.parse(data | moving | {"initial_from": end}), [0.0, HALF])
        assert again.ok, f"{scene.name}: {again.message}"
        close = IMPLICIT if whole.model["integrator"] == "generalized-alpha" else 1e-9
        assert again.points == pytest.approx(whole.points, abs=close), scene.name
        assert again.angles == pytest.approx(whole.angles, abs=10 * close), scene.name
        compared += 1
    assert compared > 50
