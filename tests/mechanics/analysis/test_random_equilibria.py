"""Equilibria and modes of chains drawn at random, judged by the time integrators.

A chain put where `statics` says stays there, for `statics` as well as in time, its torsion springs wound as the angles
say; moved a little along a mode it swings back and forth with that mode's frequency.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from shoal.mechanics.analysis.modes import modes
from shoal.mechanics.analysis.statics import statics
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene

FEW, MANY = 8, 200
LITTLE = 1e-5


def chain(seed: int) -> dict[str, Any]:
    """One to three rigid rods with springs that hang from the ground, or are clamped to it by a torsion spring."""
    rng = np.random.default_rng(seed)
    names = ["a", "b", "c"][: int(rng.integers(1, 4))]
    ends: list[dict[str, Any]] = [{"body": "ground", "point": [0.0, 0.0]}]
    ends += [{"body": name, "point": "end"} for name in names]
    loads: dict[str, Any] = {}
    for name, end in zip(names, ends, strict=False):
        if rng.random() < 0.7:
            loads[f"wound-{name}"] = {
                "kind": "torsion-spring", "first": end, "second": {"body": name},
                "stiffness": float(10 ** rng.uniform(-0.5, 1.5)), "angle": float(rng.uniform(-6, 6)),
            }  # fmt: skip
    if rng.random() < 0.3:
        loads["pull"] = {
            "kind": "spring", "first": {"body": "ground", "point": [0.3, 1.0]}, "second": ends[-1],
            "stiffness": float(rng.uniform(5, 300)), "length": float(rng.uniform(0, 1)),
        }  # fmt: skip
    rod = {"kind": "rod", "height": 0.01, "width": 0.02, "density": 2700.0}
    return {
        "name": f"chain-{seed}",
        "bodies": {name: rod | {"length": float(rng.uniform(0.4, 1.2))} for name in names},
        "joints": {
            f"to-{name}": {"first": end, "second": {"body": name}} for name, end in zip(names, ends, strict=False)
        },
        "loads": loads,
        "markers": {name: {"body": name, "point": "end"} for name in names},
        "initial": {name: {"angle": float(rng.uniform(-3, 3))} for name in names},
        "solver": {"integrator": "dop853"},
    }


def check(seed: int) -> None:
    data = chain(seed)
    found = statics(Scene.parse(data))
    assert found.ok, found.message
    rest = {name: found.angle(name) for name in found.markers}
    there = data | {"initial": {name: {"angle": angle} for name, angle in rest.items()}}
    again = statics(Scene.parse(there))
    assert again.ok, again.message
    np.testing.assert_allclose(again.points, found.points, atol=1e-7)
    still = simulate(Scene.parse(there), np.array([1.0]))
    assert still.ok, still.message
    np.testing.assert_allclose(still.points[0, ..., 0], found.points, atol=1e-7)
    np.testing.assert_allclose(still.angles[0, :, 0], list(rest.values()), atol=1e-7)
    for mode in modes(Scene.parse(there), about="start").to_json()["modes"]:
        assert mode["kind"] == "oscillating"
        turns = np.array([mode["shape"][name]["dangle"] for name in found.markers])
        turns *= LITTLE / np.max(np.abs(turns))
        moved = {name: {"angle": rest[name] + turn} for name, turn in zip(found.markers, turns, strict=True)}
        times = 2 * np.pi / mode["angular_frequency"] * np.array([0.13, 0.5, 0.81])
        swings = simulate(Scene.parse(data | {"initial": moved}), times)
        wanted = np.array(list(rest.values())) + turns * np.cos(mode["angular_frequency"] * times)[:, None]
        np.testing.assert_allclose(swings.angles[..., 0], wanted, atol=5e-3 * LITTLE)


@pytest.mark.parametrize("seed", range(FEW))
@pytest.mark.by_day(2)
def test_a_chain_rests_and_swings_as_statics_and_modes_say(seed: int) -> None:
    check(seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(FEW, MANY))
def test_many_chains_rest_and_swing_as_statics_and_modes_say(seed: int) -> None:
    check(seed)
