"""Angles and rates between two bodies, as an encoder in their joint shows them."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.errors import InputError
from shoal.identification import Problem, identify, measure
from shoal.identification.recording.observation import Camera, observe
from shoal.identification.recording.source import Channel
from shoal.scene import load_scene

BETWEEN = Channel(marker="B", quantity="angle", to="A", column="elbow")
SLOWER = Channel(marker="B", quantity="rate", to="A", column="speed")
ARM = Channel(marker="A", quantity="angle", column="arm")


def problem(truth: dict[str, float], channels: list[dict[str, Any]], engine: str = "exudyn", **source: Any) -> Problem:
    return Problem.parse(
        {
            "name": "encoders",
            "scene": "rigid-double-pendulum",
            "parameters": {
                "first": {"path": "initial.OA.angle", "lower": -3.3, "upper": 3.3},
                "second": {"path": "initial.AB.angle", "lower": -3.3, "upper": 3.3},
                "length": {"path": "bodies.AB.length", "lower": 0.5, "upper": 3.0, "start": 1.8},
            },
            "channels": channels,
            "source": source
            or {"kind": "engine", "engine": engine, "values": truth, "stop": 1.0, "count": 50, "noise": 1e-3},
        },
        "encoders",
    )


def test_it_is_the_difference_of_the_angles_whatever_the_camera_is() -> None:
    scene = load_scene("rigid-double-pendulum")
    motion = get_engine("gauss").simulate(scene, np.linspace(0.1, 1.0, 10))
    seen = observe(motion, (BETWEEN, SLOWER), Camera(scale=2.0, x=1.0, tilt=0.3))[0]
    np.testing.assert_array_equal(seen[:, 0], motion.angle("B") - motion.angle("A"))
    assert motion.rates is not None
    np.testing.assert_array_equal(seen[:, 1], (motion.rates[:, 1] - motion.rates[:, 0])[:, 0])


def test_encoders_of_another_engine_identify_the_machine() -> None:
    truth = {"initial.OA.angle": 0.5, "initial.AB.angle": -0.4, "bodies.AB.length": 1.3}
    channels = [channel.model_dump(exclude_defaults=True) for channel in (ARM, BETWEEN)]
    found = identify(problem(truth, channels))
    assert found.verdict.trusted
    for name, value in found.parameters.items():
        assert value.lower - value.std < found.truth[name] < value.upper + value.std


def test_whole_turns_between_the_bodies_do_not_count(tmp_path: Path) -> None:
    """The second body starts almost a turn from the first, of which an encoder shows nothing."""
    truth = {"initial.OA.angle": 3.0, "initial.AB.angle": -3.0, "bodies.AB.length": 1.3}
    channels = [channel.model_dump(exclude_defaults=True) for channel in (ARM, BETWEEN)]
    computed = problem(truth, channels, engine="gauss")
    shown = measure(computed, computed.load_scene()).first
    assert abs(shown.values[0, 1]) < 1.0
    table = np.column_stack([shown.times, shown.values[:, 0], np.degrees(shown.values[:, 1])])
    (path := tmp_path / "run.csv").write_text(
        "\n".join(["t,arm,elbow", "s,rad,deg", *(",".join(map(repr, row)) for row in table.tolist())])
    )
    found = identify(problem(truth, channels, kind="file", path=str(path), start=0.0))
    assert found.verdict.trusted
    assert found.rms < 2e-3
    assert found.parameters["length"].value == pytest.approx(1.3, abs=0.01)


@pytest.mark.parametrize(
    ("channel", "words"),
    [
        ({"marker": "B", "quantity": "x", "to": "A"}, "an angle or a rate is measured between two markers, found x"),
        ({"marker": "B", "quantity": "angle", "to": "B"}, "another marker than B is needed"),
        ({"marker": "B", "quantity": "angle", "to": "C"}, "no marker 'C'; there are A, B"),
    ],
)
def test_what_lies_between_no_two_bodies_is_refused_in_one_line(channel: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=re.escape(words)) as refusal:
        problem({}, [channel]).load_scene()
    assert "\n" not in str(refusal.value)
