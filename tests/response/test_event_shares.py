"""Uncertain machines whose runs meet a stop or miss it: bounds and statistics by their sequences of events."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy import stats
from shoal.mechanics.event_record import word
from shoal.mechanics.simulate import simulate
from shoal.notebook import uncertain
from shoal.scene import Scene

pytestmark = pytest.mark.compiles("kernels of contacts, which few machines need")
G = 9.81
TIMES = [0.5, 1.0, 1.5]
MEETS = float(np.sqrt(3.0 * G))
"""Rate at the bottom with which a rod of 1 m just reaches its stop at the horizontal, by its energy [rad/s]."""


def rod() -> Scene:
    bar = {"kind": "rod", "length": 1.0, "density": 5000.0, "height": 0.02, "width": 0.02, "element": "rigid"}
    pin = {"first": {"body": "ground", "point": [0, 0]}, "second": {"body": "rod"},
           "stops": {"max": 0.0, "restitution": 0.5}}  # fmt: skip
    return Scene.parse({"name": "maybe", "bodies": {"rod": bar}, "joints": {"O": pin},
                        "initial": {"rod": {"angle": -np.pi / 2, "rate": 5.4}},
                        "markers": {"tip": {"body": "rod", "point": "end"}}})  # fmt: skip


def ball() -> Scene:
    floor = {"first": {"body": "b"}, "second": {"body": "ground", "line": 0.0}, "restitution": 0.8}
    return Scene.parse({"name": "ball", "bodies": {"b": {"kind": "point-mass", "mass": 1.0}},
                        "contacts": {"floor": floor}, "initial": {"b": {"position": [0.0, 1.0]}},
                        "markers": {"b": {"body": "b"}}, "solver": {"duration": 3.0}})  # fmt: skip


@pytest.mark.parametrize(
    "second", [{}, pytest.param({"joints.O.stops.restitution": (0.4, 0.6)}, marks=pytest.mark.slow)]
)
def test_bounds_hold_over_runs_that_meet_a_stop_and_runs_that_miss_it(second: dict[str, Any]) -> None:
    """Against the extremes of plain runs all over the box: attained bounds reach them, outer ones enclose them."""
    vary = {"initial.rod.rate": (5.2, 5.6)} | second
    found = uncertain(rod(), vary, at=TIMES)
    assert found.ok, found.message
    assert found.bounds is not None
    assert found.bounds.gap < 0.05
    drawn = np.random.default_rng(0).uniform(size=(len(vary), 2000))
    drawn[0, :2] = 0.0, 1.0
    values = {path: low + (high - low) * u for (path, (low, high)), u in zip(vary.items(), drawn, strict=True)}
    motion = simulate(rod(), np.array(TIMES), values)
    runs = np.stack([*motion.points[:, 0].transpose(1, 0, 2), motion.angles[:, 0]], axis=1).reshape(9, -1)
    width = np.ptp(runs, axis=1)
    assert np.all(found.bounds.lower_outer <= runs.min(axis=1) + 1e-12)
    assert np.all(found.bounds.upper_outer >= runs.max(axis=1) - 1e-12)
    assert np.all(found.bounds.lower <= runs.min(axis=1) + 2e-3 * width)
    assert np.all(found.bounds.upper >= runs.max(axis=1) - 2e-3 * width)
    assert found.words is not None
    shares = {one.events: one.share for one in found.words.words}
    assert shares["O impact"] == pytest.approx((5.6 - MEETS) / 0.4, abs=0.02)
    assert "2 sequences of events until 1.5 s" in found.explanation


@pytest.mark.slow
def test_statistics_are_those_of_plain_runs_and_the_share_that_meets_the_stop_is_told() -> None:
    found = uncertain(rod(), ["initial.rod.rate~normal(5.42,0.1)"], at=TIMES)
    assert found.ok, found.message
    assert found.statistics is not None
    rates = 5.42 + 0.1 * np.random.default_rng(1).standard_normal(20_000)
    motion = simulate(rod(), np.array(TIMES), {"initial.rod.rate": rates})
    runs = np.stack([*motion.points[:, 0].transpose(1, 0, 2), motion.angles[:, 0]], axis=1).reshape(9, -1)
    off = 4.0 * runs.std(axis=1) / np.sqrt(20_000)
    assert np.all(np.abs(found.statistics.mean - runs.mean(axis=1)) < off + found.statistics.error)
    assert np.all(np.abs(found.statistics.std - runs.std(axis=1)) < 2.0 * off + found.statistics.std_error)
    assert found.words is not None
    meets = next(one.share for one in found.words.words if one.events == "O impact")
    assert meets == pytest.approx(float(stats.norm.sf(MEETS, 5.42, 0.1)), abs=2e-3)


def test_a_ball_has_bounds_until_its_sequences_of_impacts_are_too_many() -> None:
    """At 1 s it has struck once, in all runs; by 3 s two to many times, until it rests."""
    found = uncertain(ball(), {"contacts.floor.restitution": (0.7, 0.9)}, at=[1.0, 2.0, 3.0])
    assert found.horizon == 2.0
    assert "the sequences of events are too many" in found.message
    assert found.bounds is not None
    first = np.sqrt(2.0 / G)

    def height(e: float, t: float) -> float:
        at, speed = first, e * G * first
        while t > at + 2.0 * speed / G:
            at, speed = at + 2.0 * speed / G, e * speed
        return float(speed * (t - at) - 0.5 * G * (t - at) ** 2)

    for row, t in ((1, 1.0), (4, 2.0)):
        exact = [height(e, t) for e in np.linspace(0.7, 0.9, 20_001)]
        assert found.bounds.lower[row] == pytest.approx(min(exact), abs=1e-4)
        assert found.bounds.upper[row] == pytest.approx(max(exact), abs=1e-4)
        assert found.bounds.lower_outer[row] <= min(exact) + 1e-10
        assert found.bounds.upper_outer[row] >= max(exact) - 1e-10


def test_words_count_repetitions_and_take_accumulated_impacts_for_the_rest_that_they_end_in() -> None:
    letters = [(0.1, "a impact"), (0.2, "a impact"), (0.25, "a rests"), (0.3, "b impact"), (0.4, "b impact")]
    assert word(letters, 0.05) == ""
    assert word(letters, 0.2) == "2 x a impact"
    assert word(letters, 1.0) == "a rests, 2 x b impact"
