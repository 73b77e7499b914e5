"""What wide bounds, few samples a turn and a stated start make of an answer: data of closed forms and of scipy."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from scipy.integrate import solve_ivp
from shoal.identification import Estimate, Problem, identify
from shoal.identification.recording.measurement import Measurement
from shoal.trajectory import Array

GROUND = {"body": "ground", "point": [0.0, 0.0]}
MASS, INERTIA, CENTRE = 2.0, 0.05, 0.3


def found(folder: Path, body: dict[str, Any], parameters: dict[str, Any], channels: str, times: Array, values: Array,
          gravity: float = -9.81, start: dict[str, float] | None = None) -> Estimate:  # fmt: skip
    """A body on a pin, whose point `tip` is measured with a noise of 1e-3 (m or rad) that is stated."""
    scene = {
        "name": "pinned", "gravity": [0.0, gravity], "bodies": {"b": {"kind": "rigid-body"} | body},
        "joints": {"O": {"first": GROUND, "second": {"body": "b", "point": [0.0, 0.0]}}},
        "markers": {"tip": {"body": "b", "point": [0.6, 0.0]}}, "initial": {"b": start or {"angle": -0.3}},
    }  # fmt: skip
    (folder / "scene.yaml").write_text(yaml.safe_dump(scene))
    measured = [{"marker": "tip", "quantity": one, "column": one, "noise": 1e-3} for one in channels.split()]
    problem = Problem.parse(
        {
            "name": "pinned",
            "scene": str(folder / "scene.yaml"),
            "parameters": parameters,
            "channels": measured,
            "source": {"kind": "file"},
        },
        "pinned",
    )
    noisy = values + 1e-3 * np.random.default_rng(1).standard_normal(values.shape)
    return identify(problem, measurement=Measurement.single(times, tuple(problem.channels), noisy, "scipy", noise=1e-3))


def swung(times: Array, centre: float = CENTRE, mass: float = MASS, angle: float = -0.3, rate: float = 0.0) -> Array:
    """The angle of a compound pendulum."""
    pull = mass * 9.81 * centre / (INERTIA + mass * centre**2)
    solved = solve_ivp(lambda _, y: [y[1], -pull * np.cos(y[0])], (0, times[-1]), [angle, rate], "DOP853", times,
                       rtol=1e-11, atol=1e-12)  # fmt: skip
    return np.asarray(solved.y[0])


def spun(times: Array, rate: float) -> Array:
    """The tip of a rotor that nothing brakes."""
    angle = 0.4 + rate * times
    return 0.6 * np.stack([np.cos(angle), np.sin(angle)], axis=1)


BODY = {"mass": MASS, "inertia": INERTIA, "centre_of_mass": [0.2, 0.0]}
TIMES = np.linspace(0.0, 3.0, 121)[1:]


@pytest.mark.parametrize("bound", [1.0, 100.0, 500.0])
@pytest.mark.by_day(1)
def test_two_centres_of_mass_swing_alike_in_any_bounds(bound: float, tmp_path: Path) -> None:
    """Huygens: a pendulum swings alike about the conjugate pivot, at I/(m c)."""
    sought = {
        "c": {"path": "bodies.b.centre_of_mass.0", "lower": -bound, "upper": bound, "start": 0.2},
        "angle": {"path": "initial.b.angle", "lower": -1.5, "upper": 1.0},
    }
    answer = found(tmp_path, BODY, sought, "angle", TIMES, swung(TIMES)[:, None] - 0.0)
    assert answer.verdict.value == "ambiguous", answer.message
    centres = [answer.parameters["c"].value, *(values["c"] for values in answer.minima)]
    for wanted in (CENTRE, INERTIA / (MASS * CENTRE)):
        assert min(abs(one - wanted) for one in centres) < 2e-3


@pytest.mark.parametrize("bound", [10.0, 5000.0])
def test_a_height_tells_no_side_of_a_pendulum(bound: float, tmp_path: Path) -> None:
    sought = {"rate": {"path": "initial.b.rate", "lower": -bound, "upper": bound, "start": -1.0}}
    body, start = BODY | {"centre_of_mass": [CENTRE, 0.0]}, {"angle": -np.pi / 2}
    height = 0.6 * np.sin(swung(TIMES, angle=-np.pi / 2, rate=3.0))[:, None]
    answer = found(tmp_path, body, sought, "y", TIMES, height, start=start)
    assert answer.verdict.value == "ambiguous", answer.message
    assert abs(answer.parameters["rate"].value) == pytest.approx(3.0, abs=0.02)


@pytest.mark.parametrize("stated", [{}, {"start": 20.0}])
def test_a_rotor_of_two_radians_a_sample_is_found(stated: dict[str, float], tmp_path: Path) -> None:
    """Through so few samples a parabola says that it hardly turns."""
    times = np.arange(1, 31) / 10.0
    sought = {
        "rate": {"path": "initial.b.rate", "lower": -30.0, "upper": 30.0} | stated,
        "angle": {"path": "initial.b.angle", "lower": -3.0, "upper": 3.0},
    }
    answer = found(
        tmp_path, BODY | {"centre_of_mass": [0.0, 0.0]}, sought, "x y", times, spun(times, 20.0), gravity=0.0
    )
    assert answer.verdict.value == "identified", answer.message
    assert answer.parameters["rate"].value == pytest.approx(20.0, abs=2e-3)


def test_whole_turns_between_samples_are_told(tmp_path: Path) -> None:
    times = np.arange(1, 31) / 10.0
    sought = {
        "rate": {"path": "initial.b.rate", "lower": -100.0, "upper": 100.0},
        "angle": {"path": "initial.b.angle", "lower": -3.0, "upper": 3.0},
    }
    answer = found(
        tmp_path, BODY | {"centre_of_mass": [0.0, 0.0]}, sought, "x y", times, spun(times, 70.0), gravity=0.0
    )
    assert answer.verdict.value == "ambiguous"
    assert "the same at every sample" in answer.message
    assert "sample more often" in answer.advice[0]
    rates = [answer.parameters["rate"].value, *(values["rate"] for values in answer.minima)]
    for turns in (-1, 0):
        assert min(abs(rate - 70.0 - 20 * np.pi * turns) for rate in rates) < 1e-2


def test_the_mass_of_the_only_body_is_a_suspect(tmp_path: Path) -> None:
    """Its inertia is stated beside it, so that a heavier body swings faster."""
    sought = {"angle": {"path": "initial.b.angle", "lower": -1.5, "upper": 1.0}}
    body = BODY | {"centre_of_mass": [CENTRE, 0.0]}
    answer = found(tmp_path, body, sought, "angle", TIMES, swung(TIMES, mass=2.3)[:, None])
    assert not answer.verdict.trusted
    assert re.search(r"(?<!centre of )mass of b", answer.message), answer.message
