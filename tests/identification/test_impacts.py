"""Restitution from the times of impacts, as a microphone hears them; data by the closed form of a bouncing ball."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from shoal.errors import InputError
from shoal.identification.estimate import Estimate
from shoal.identification.recording.impacts import impact_times
from shoal.notebook import identify

pytestmark = pytest.mark.compiles("kernels of contacts, which few machines need")
G = 9.81
NOISE = 1e-4
BALL = {
    "name": "ball", "gravity": [0.0, -G], "bodies": {"b": {"kind": "point-mass", "mass": 1.0}},
    "contacts": {"floor": {"first": {"body": "b"}, "second": {"body": "ground", "line": 0.0}, "restitution": 0.7}},
    "initial": {"b": {"position": [0.0, 1.0]}}, "markers": {"tip": {"body": "b"}}, "solver": {"duration": 5.0},
}  # fmt: skip
E = {"path": "contacts.floor.restitution", "lower": 0.4, "upper": 0.95}
HEIGHT = {"path": "initial.b.position.1", "lower": 0.5, "upper": 2.0, "start": 0.8}
DELAY = {"path": "measurement.delay", "lower": -1.0, "upper": 1.0, "start": 0.0}


def heard(folder: Path, e: float, h: float, seed: int, parameters: dict[str, Any], late: float = 0.0) -> Estimate:
    """Fit to nine impacts of a ball that falls from a height, heard by a clock that begins late."""
    rng = np.random.default_rng(seed)
    first = np.sqrt(2.0 * h / G)
    times = first * np.cumsum([1.0, *(2.0 * e**k for k in range(1, 9))]) - late + NOISE * rng.standard_normal(9)
    (folder / "impacts.csv").write_text("\n".join(["t", *map(repr, times.tolist())]))
    (folder / "ball.yaml").write_text(yaml.safe_dump(BALL))
    channel = {"contact": "floor", "quantity": "impact", "column": "t"}
    stated = {"name": "heard", "scene": str(folder / "ball.yaml"), "parameters": parameters, "channels": [channel],
              "source": {"kind": "file", "path": str(folder / "impacts.csv")}, "noise": NOISE}  # fmt: skip
    (folder / "heard.yaml").write_text(yaml.safe_dump(stated))
    return identify(str(folder / "heard.yaml"))


def test_restitution_and_height_follow_from_flight_times_from_a_wrong_start(tmp_path: Path) -> None:
    found = heard(tmp_path, 0.8, 1.0, 3, {"e": {**E, "start": 0.5}, "h": HEIGHT})
    assert found.verdict.trusted, found.verdict
    for name, truth, size in (("e", 0.8, 3e-5), ("h", 1.0, 2e-4)):
        value = found.parameters[name]
        assert abs(value.value - truth) < 4.0 * value.std
        assert value.std < size


@pytest.mark.slow
def test_a_microphone_that_starts_at_an_unknown_time_tells_as_much_with_its_delay(tmp_path: Path) -> None:
    found = heard(tmp_path, 0.8, 1.0, 5, {"e": {**E, "start": 0.7}, "delay": DELAY}, late=0.2)
    assert found.verdict.trusted, found.verdict
    for name, truth in (("e", 0.8), ("delay", 0.2)):
        assert abs(found.parameters[name].value - truth) < 4.0 * found.parameters[name].std


@pytest.mark.slow
def test_intervals_hold_the_truth_in_nineteen_of_twenty(tmp_path: Path) -> None:
    """Of 40 intervals of 95 % two miss on average; more than six would be rarer than one in two hundred."""
    missed = 0
    for seed in range(20):
        e, h = 0.6 + 0.015 * seed, 0.7 + 0.05 * seed
        found = heard(tmp_path, e, h, seed, {"e": {**E, "start": 0.7}, "h": HEIGHT})
        assert found.verdict.trusted, (seed, found.verdict)
        for name, truth in (("e", e), ("h", h)):
            value = found.parameters[name]
            assert value.lower is not None
            assert value.upper is not None
            missed += not value.lower <= truth <= value.upper
    assert missed <= 6


def test_impacts_that_the_model_lacks_are_at_its_rest_or_at_its_end() -> None:
    letters = [(0.1, "floor impact"), (0.15, "wall impact"), (0.2, "floor impact"), (0.25, "floor rests")]
    assert impact_times(letters, "floor", 4, 9.0).tolist() == [0.1, 0.2, 0.25, 0.25]
    assert impact_times(letters, "wall", 2, 9.0).tolist() == [0.15, 9.0]


def test_other_channels_beside_impacts_are_refused_by_name(tmp_path: Path) -> None:
    (tmp_path / "ball.yaml").write_text(yaml.safe_dump(BALL))
    (tmp_path / "both.csv").write_text("t,y\n0.4,0\n1.2,0\n1.8,0\n")
    channels = [{"contact": "floor", "quantity": "impact", "column": "t"},
                {"marker": "tip", "quantity": "y", "column": "y"}]  # fmt: skip
    stated = {"name": "both", "scene": str(tmp_path / "ball.yaml"), "parameters": {"e": E}, "channels": channels,
              "source": {"kind": "file", "path": str(tmp_path / "both.csv")}, "noise": NOISE}  # fmt: skip
    (tmp_path / "both.yaml").write_text(yaml.safe_dump(stated))
    with pytest.raises(InputError, match="times of impacts are a recording of one channel"):
        identify(str(tmp_path / "both.yaml"))
