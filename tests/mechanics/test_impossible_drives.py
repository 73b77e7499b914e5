"""Drives that joints cannot follow: the run ends there, names them, and is never called right."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from shoal.engines.gauss import GaussEngine
from shoal.errors import InputError
from shoal.scene import Scene
from shoal.trajectory import Status

GROUND = {"body": "ground", "point": [0.0, 0.0]}


def rod(length: float) -> dict[str, Any]:
    body = {"kind": "rigid-body", "mass": 1.0, "inertia": 0.1, "centre_of_mass": [0.5 * length, 0.0]}
    return body | {"named_points": {"e": [length, 0.0]}}


def end(name: str) -> dict[str, Any]:
    return {"body": name, "point": "e"}


def ended(run: Any) -> float:
    """Return the instant of a finding [s]."""
    return run.findings[0].numbers["time"]


def four_bar(rng: np.random.Generator) -> tuple[dict[str, Any], float, float, float]:
    """A linkage whose crank is driven at a constant rate from a start that closes; the crank angle at its dead centre.

    a + b is less than the ground's length plus c, so that the crank cannot go round: it stops where coupler and rocker
    are stretched, |tip - D| = b + c.
    """
    a, b, c = rng.uniform(0.6, 0.9), rng.uniform(0.3, 0.5), rng.uniform(0.3, 0.5)
    begin = rng.uniform(0.1, 0.3)
    most = float(np.arccos((a * a + 1.0 - (b + c) ** 2) / (2.0 * a)))
    tip = a * np.array([np.cos(begin), np.sin(begin)])
    away = np.array([1.0, 0.0]) - tip
    gap = float(np.hypot(*away))
    turn = np.arccos((b * b + gap * gap - c * c) / (2.0 * b * gap))
    along = float(np.arctan2(away[1], away[0]) + turn)
    elbow = tip + b * np.array([np.cos(along), np.sin(along)])
    back = float(np.arctan2(elbow[1], elbow[0] - 1.0))
    rate = rng.uniform(0.5, 3.0)
    joints = {
        "A": {"first": GROUND, "second": {"body": "a"}},
        "B": {"first": end("a"), "second": {"body": "b"}},
        "C": {"first": end("b"), "second": end("c")},
        "D": {"first": {"body": "ground", "point": [1.0, 0.0]}, "second": {"body": "c"}},
        "m": {"kind": "driven-angle", "first": GROUND, "second": {"body": "a"}, "angle": f"{begin!r} + {rate!r}*t"},
    }
    scene = {
        "name": "four-bar",
        "gravity": [0.0, -9.81],
        "bodies": {"a": rod(a), "b": rod(b), "c": rod(c)},
        "joints": joints,
        "markers": {"B": end("b")},
        "initial": {"a": {"angle": begin}, "b": {"angle": along}, "c": {"angle": back}},
    }
    return scene, begin, rate, most


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("integrator", ["dop853", "radau5"])
def test_a_crank_ends_at_its_dead_centre(seed: int, integrator: str) -> None:
    scene, begin, rate, most = four_bar(np.random.default_rng(seed))
    dead = (most - begin) / rate
    beyond = {"duration": 2.0 * dead, "samples": 4, "integrator": integrator}
    run = GaussEngine().simulate(Scene.parse({**scene, "solver": beyond}))
    assert not run.ok
    assert "joints.m" in run.message
    assert ended(run) == pytest.approx(dead, abs=1e-5 * dead)
    feasible = beyond | {"duration": 0.9 * dead}
    run = GaussEngine().simulate(Scene.parse({**scene, "solver": feasible}))
    assert run.ok, run.message


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("integrator", ["rk4", "leapfrog", "semi-implicit-euler"])
def test_fixed_steps_are_not_right_beyond_reach(seed: int, integrator: str) -> None:
    scene, begin, rate, most = four_bar(np.random.default_rng(seed))
    dead = (most - begin) / rate
    solver = {"duration": 1.5 * dead, "samples": 4, "integrator": integrator, "step": 1e-3 * dead}
    run = GaussEngine().simulate(Scene.parse({**scene, "solver": solver}))
    assert not run.ok
    assert "joints.m" in run.message
    assert ended(run) == pytest.approx(dead, abs=0.03 * dead)


@pytest.mark.parametrize("seed", range(4))
def test_lanes_end_each_at_its_own_dead_centre(seed: int) -> None:
    scene, begin, rate, most = four_bar(np.random.default_rng(seed))
    dead = (most - begin) / rate
    run = GaussEngine().simulate_many(
        Scene.parse({**scene, "solver": {"duration": 1.3 * dead, "samples": 4}}),
        {"bodies.b.mass": np.linspace(0.5, 2.0, 9)},
    )
    assert not any(status is Status.OK for status in run.status)
    for (finding,) in run.lane_findings:
        assert finding.numbers["time"] == pytest.approx(dead, abs=1e-4 * dead)


def contradiction(rng: np.random.Generator) -> tuple[dict[str, Any], float]:
    """Return two welded bodies whose angle or distance is driven as well, and the rise time [s]."""
    most, rise = rng.uniform(0.1, 0.7), rng.uniform(0.1, 0.5)
    one, other = GROUND, {"body": "a"}
    weld = {"kind": "weld", "first": end("a"), "second": {"body": "b"}}
    if rng.integers(2):
        drive = {"kind": "driven-angle", "first": other, "second": {"body": "b"}, "angle": f"{most!r}*ramp(t/{rise!r})"}
    else:
        drive = {"kind": "distance", "first": other, "second": end("b"), "length": f"2 + {most!r}*ramp(t/{rise!r})"}
    parts = [("O", {"first": one, "second": other}), ("W", weld), ("D", drive)]
    order = rng.permutation(3)
    return (
        {
            "name": "contradiction",
            "bodies": {"a": rod(1.0), "b": rod(1.0)},
            "joints": dict(parts[k] for k in order),
            "markers": {"e": end("a")},
            "solver": {"duration": 2.0, "samples": 4},
        },
        rise,
    )


@pytest.mark.parametrize("seed", range(8))
def test_a_drive_against_a_weld_ends_at_once(seed: int) -> None:
    scene, rise = contradiction(np.random.default_rng(seed))
    run = GaussEngine().simulate(Scene.parse(scene))
    assert not run.ok
    assert run.status[0] is Status.DRIFTED
    assert "where joints.D moves" in run.message
    # The ramp begins as 10 (t/rise)^3 of its height: a millionth of the size is open after a hundredth of `rise`.
    assert ended(run) < 0.2 * rise
    assert run.steps < 100


def test_a_distance_of_nothing_names_its_field() -> None:
    scene = {
        "name": "zero",
        "bodies": {"a": {"kind": "point-mass", "mass": 1.0}},
        "joints": {"d": {"kind": "distance", "first": GROUND, "second": {"body": "a"}}},
        "markers": {"a": {"body": "a"}},
        "initial": {"a": {"position": [0.0, 0.0], "velocity": [0.0, 0.0]}},
    }
    with pytest.raises(InputError, match=r"joints\.d\.length: .* 0 m"):
        GaussEngine().simulate(Scene.parse(scene))
