"""Rigid bars on balls at rest: that they may turn about their own axes keeps nothing from resting."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from shoal import statics
from shoal.mechanics.analysis.findings import EquilibriumStatus
from shoal.scene import Scene

GRAVITY = 9.81
FEET = np.array([[1.0, 0.0, 0.0], [-0.5, 0.8, 0.0], [-0.4, -0.9, 0.0]])
TOP = np.array([0.1, 0.05, 1.2])
LOAD = np.array([5.0, -7.0, 2.0])


def _ball(first: str, point: Any, second: str, at: Any = "start") -> dict[str, Any]:
    return {"kind": "spherical", "first": {"body": first, "point": point}, "second": {"body": second, "point": at}}


def _rotation(along: np.ndarray) -> list[float]:
    """That turns the x axis into a direction."""
    along = along / np.linalg.norm(along)
    axis = np.cross([1.0, 0.0, 0.0], along)
    return (axis / np.linalg.norm(axis) * np.arctan2(np.linalg.norm(axis), along[0])).tolist()


@pytest.mark.parametrize("kind", ["rod", "rigid-body"])
def test_a_tripod_stands_and_its_bars_bear_what_three_balances_say(kind: str) -> None:
    """At the top: the sum of N e over the bars is what is applied there, half the weight of each bar included."""
    ways = TOP - FEET
    lengths = np.linalg.norm(ways, axis=1)
    weights = GRAVITY * 0.5 * lengths
    bars: dict[str, Any] = {
        f"r{k}": {"kind": "rod", "length": length, "height": 0.02, "width": 0.025, "density": 1000.0}
        if kind == "rod"
        else {"kind": "rigid-body", "mass": 0.5 * length, "inertia": 0.1, "centre_of_mass": (0.5 * way).tolist(),
              "named_points": {"end": way.tolist()}}
        for k, (length, way) in enumerate(zip(lengths.tolist(), ways, strict=True))
    }  # fmt: skip
    joints = {f"g{k}": _ball("ground", FEET[k].tolist(), f"r{k}") for k in range(3)}
    joints |= {f"t{k}": _ball(f"r{k}", "end", "m") for k in range(3)}
    starts = {f"r{k}": {"rotation": _rotation(ways[k]) if kind == "rod" else [0.0, 0.0, 0.0]} for k in range(3)}
    scene = Scene.parse({
        "name": "tripod", "dimensions": 3, "gravity": [0.0, 0.0, -GRAVITY],
        "bodies": {"m": {"kind": "point-mass", "mass": 3.0}, **bars}, "joints": joints,
        "markers": {"m": {"body": "m"}}, "initial": {"m": {"position": TOP.tolist()}, **starts},
        "loads": {"f": {"kind": "force", "at": {"body": "m"}, "force": LOAD.tolist()}},
    })  # fmt: skip
    found = statics(scene)
    assert found.status is EquilibriumStatus.OK
    assert found.codes == ["free-to-spin"]
    along, down = (ways / lengths[:, None]).T, np.array([0.0, 0.0, -1.0])
    axial = np.linalg.solve(along, -LOAD - (3.0 * GRAVITY + weights.sum() / 2) * down)
    assert found.reactions is not None
    for k in range(3):
        wanted = axial[k] * along[:, k] + weights[k] / 2 * down
        assert found.reactions.joints[f"t{k}"].force == pytest.approx(wanted, abs=1e-9)
        assert found.reactions.joints[f"g{k}"].force == pytest.approx(wanted - weights[k] * down, abs=1e-9)


def test_a_chain_of_bars_hangs_straight_down_however_it_was_turned() -> None:
    bar = {"kind": "rod", "length": 0.5, "height": 0.02, "width": 0.01, "density": 1000.0}
    joints = {f"b{k}": _ball(f"r{k - 1}", "end", f"r{k}") for k in (1, 2)}
    starts = ([0.5, 1.0, 2.0], [-2.0, 0.3, 1.0], [1.0, -1.2, 0.4])
    scene = Scene.parse({
        "name": "chain", "dimensions": 3, "gravity": [0.0, 0.0, -GRAVITY],
        "bodies": {f"r{k}": bar for k in range(3)}, "joints": {"b0": _ball("ground", [0.0, 0.0, 0.0], "r0"), **joints},
        "markers": {"tip": {"body": "r2", "point": "end"}},
        "initial": {f"r{k}": {"rotation": rotation} for k, rotation in enumerate(starts)},
    })  # fmt: skip
    found = statics(scene)
    assert found.status is EquilibriumStatus.OK
    assert "free-to-spin" in found.codes
    assert found.marker("tip") == pytest.approx([0.0, 0.0, -1.5], abs=1e-9)


def test_a_body_whose_spin_moves_a_marker_is_not_held() -> None:
    """A marker beside the axis of a bar on two balls goes round with it."""
    bar = {"kind": "rod", "length": 0.5, "height": 0.02, "width": 0.01, "density": 1000.0}
    scene = Scene.parse({
        "name": "bar", "dimensions": 3, "gravity": [0.0, 0.0, -GRAVITY], "bodies": {"r": bar},
        "joints": {"a": _ball("ground", [0.0, 0.0, 0.0], "r"), "b": _ball("ground", [0.5, 0.0, 0.0], "r", "end")},
        "markers": {"m": {"body": "r", "point": [0.2, 0.01, 0.0]}}, "initial": {"r": {"rotation": [0.0, 0.0, 0.0]}},
    })  # fmt: skip
    found = statics(scene)
    assert found.status is EquilibriumStatus.UNHELD
    assert "nothing-holds" in found.codes
