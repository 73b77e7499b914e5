"""Faults of pivots, joints and rods: a small one is named, with its size, and what has the same effect is said."""

import re
from dataclasses import replace

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.identification import Measurement, Problem
from shoal.identification.diagnostics.suspects import Suspect, suspects
from shoal.identification.diagnostics.suspects.candidate import FaultHypothesis, Together, groups_of, size_of
from shoal.identification.diagnostics.suspects.of_recordings import of_measurement
from shoal.identification.diagnostics.suspects.of_samples import stretches
from shoal.identification.diagnostics.suspects.other_mechanisms import shaken
from shoal.identification.forward import ForwardModel
from shoal.identification.methods.least_squares import descend, differentiate, least_squares
from shoal.identification.recording.observation import observe
from shoal.scene import Scene
from shoal_validation.suspects.study import trial

NOISE = 5e-4
DATA = {
    "name": "pendulum",
    "bodies": {"OA": {"kind": "rod", "length": 1.0, "height": 0.02, "width": 0.04, "density": 1000.0}},
    "joints": {"O": {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "OA"}}},
    "markers": {"A": {"body": "OA", "point": "end"}, "M": {"body": "OA", "point": [0.5, 0.0]}},
    "initial": {"OA": {"angle": -0.9}},
    "solver": {"duration": 2.0, "step": 1e-3, "samples": 100},
}
TIMES = np.arange(1, 61) / 30.0


def model_of(changed: dict[str, object]) -> ForwardModel:
    """The pendulum's model, fitted to noisy positions of one that is different."""
    scene = Scene.parse(DATA, "pendulum")
    channels = [{"marker": m, "quantity": q} for m in ("A", "M") for q in ("x", "y")]
    data = {
        "name": "pendulum",
        "scene": "single-pendulum",
        "parameters": {"theta": {"path": "initial.OA.angle", "lower": -np.pi, "upper": np.pi}},
        "channels": channels,
        "source": {"kind": "engine", "stop": 2.0, "count": 10, "noise": NOISE},
    }
    problem = Problem.parse(data, "pendulum")
    other = get_engine("gauss").simulate(Scene.parse(DATA | changed, "other"), TIMES)
    values = observe(other, tuple(problem.channels))[0]
    values = values + NOISE * np.random.default_rng(3).standard_normal(values.shape)
    measurement = Measurement.single(TIMES, tuple(problem.channels), values, "gauss", None, NOISE)
    return ForwardModel(problem, scene, get_engine("gauss"), measurement)


def found(changed: dict[str, object]) -> dict[str, Suspect]:
    """Suspects by name, the best first."""
    model = model_of(changed)
    outcome = least_squares(model, np.random.default_rng(0), lambda *_: None)
    seen = differentiate(model, outcome.point)
    return {suspect.name: suspect for suspect in suspects(model, outcome.point, *seen, NOISE).suspects}


def test_a_pivot_on_a_heavy_block_moves_as_a_pivot_that_is_driven() -> None:
    """The block's numbers give any amplitude, phase and frequency; the machine does not stir it."""
    model = model_of({})
    candidate = next(c for c in shaken(model) if c.name == "motion of the pivot O along x")
    amplitude, rate, phase = 0.03, 5.0, 0.7
    wave = f"{amplitude}*sin({rate}*t + {phase})"
    driven = DATA | {
        "ground_points": {"G": {"x": wave}},
        "joints": {"O": {"first": {"body": "ground", "point": "G"}, "second": {"body": "OA"}}},
    }
    expected = get_engine("gauss").simulate(Scene.parse(driven, "driven"), TIMES).points
    mass = candidate.scene.bodies["shaken-block"].mass
    values = np.array([amplitude * np.sin(phase), amplitude * rate * np.cos(phase), mass * rate**2])
    fields = dict(zip((p.path for p in candidate.parameters), values.tolist(), strict=True))
    on_a_block = get_engine("gauss").simulate(candidate.scene.with_values(fields), TIMES).points
    assert np.max(np.abs(on_a_block - expected)) < 1e-5
    assert candidate.described(values)[0] == pytest.approx(amplitude)


@pytest.mark.slow
def test_a_moving_pivot() -> None:
    wave = "0.02*sin(5*t + 1)"
    named = found(
        {
            "ground_points": {"G": {"y": wave}},
            "joints": {"O": {"first": {"body": "ground", "point": "G"}, "second": {"body": "OA"}}},
        }
    )
    first = next(iter(named.values()))
    assert first.name == "motion of the pivot O along y"
    assert first.value == pytest.approx(0.02, rel=5e-2)
    assert "at 0.79" in first.change or "at 0.8" in first.change


def test_a_joint_off_its_place_on_a_body() -> None:
    """3 cm from the end of the rod."""
    second = {"body": "OA", "point": [0.03, 0.0]}
    named = found({"joints": {"O": {"first": DATA["joints"]["O"]["first"], "second": second}}})
    first = next(iter(named.values()))
    assert first.name == "place of O on OA"
    assert first.value == pytest.approx(0.03, abs=2e-3)


@pytest.mark.parametrize(("place", "words"), [([0.5, 0.01], "instead of (0.5, 0) m"), ("end", "about that of end,")])
def test_a_marker_off_its_place_on_a_body(place: str | list[float], words: str) -> None:
    """1 cm beside the line of the rod, and at its end instead of in its middle."""
    named = found({"markers": {"A": DATA["markers"]["A"], "M": {"body": "OA", "point": place}}})
    first = next(iter(named.values()))
    assert first.name == "place of the marker M on OA"
    assert first.value == pytest.approx(0.5 if place == "end" else 0.01, abs=1e-3)
    assert words in first.change


@pytest.mark.slow
def test_a_marker_that_was_lost_for_a_while_is_told_with_its_time() -> None:
    """M stands still from 1 s to 1.3 s, where it moves by many times the noise; a wrong gravity is no such stretch."""
    model = model_of({})
    run = model.measurement.first
    held, marker = (run.times > 0.99) & (run.times < 1.31), [c.marker == "M" for c in run.channels]
    values = run.values.copy()
    values[np.ix_(held, marker)] = values[held][0, marker]
    lost = model.aside(measurement=model.measurement.changed(lambda run: replace(run, values=values)))
    outcome = least_squares(lost, np.random.default_rng(0), lambda *_: None)
    seen = suspects(lost, outcome.point, *differentiate(lost, outcome.point), NOISE)
    first = seen.suspects[0]
    assert first.kind == "stretch"
    assert first.significant
    begin, end = (float(time) for time in re.findall(r"[\d.]+(?= s)", first.name))
    assert first.name.startswith("samples of M from ")
    assert begin == pytest.approx(1.0, abs=0.11)
    assert end == pytest.approx(1.3, abs=1e-3)
    assert first.value == pytest.approx(NOISE, rel=0.2)
    other = model_of({"gravity": [0.0, -9.0]})
    assert not [*stretches(other, np.array([-0.9]))]


@pytest.mark.slow
def test_a_rod_that_bends() -> None:
    """Of a double pendulum recorded by Exudyn; a pendulum alone hardly bends."""
    found = trial(4)
    assert found.cause == "bending of AB"
    assert found.place == "alone"


def test_clock_and_gravity_are_told_as_alike() -> None:
    """A free swing shows their product only."""
    named = found({"gravity": [0.0, -9.5]})
    assert "clock" in named["gravity"].alike
    assert "gravity" in named["clock"].alike


def test_fits_side_by_side_are_those_of_one_after_the_other() -> None:
    model = model_of({"gravity": [0.0, -9.5]})
    candidates = [c for c in of_measurement(model) if c.name in ("clock", "delay", "gravity")]
    (group,) = groups_of(candidates)
    starts = [np.append(model.parameters.start * 0 - 0.9, c.vector(np.array(c.stated))) for c in group]
    together = Together(model, group).fit(range(3), starts)
    for candidate, start, end in zip(group, starts, together, strict=True):
        alone = descend(candidate.freed(model), start, lambda *_: None)
        assert end.fitness == pytest.approx(alone.fitness, rel=1e-6)


def test_runs_of_different_clocks_are_those_of_each() -> None:
    """They are simulated at once, at the instants of all."""
    model = model_of({})
    clock: FaultHypothesis = next(c for c in of_measurement(model) if c.name == "clock")
    free = clock.freed(model)
    points = np.array([[-0.9, np.log(value)] for value in (1.0, 1.04, 0.97, 1.9, 1.0)])
    one_by_one = np.concatenate([free.uncounted(point[None]) for point in points])
    assert np.max(np.abs(free.uncounted(points) - one_by_one)) < 1e-8


def test_a_point_that_slides_reaches_as_far_as_it_starts() -> None:
    """Nothing of it has a length, by which a recording in millimetres was compared with it: a division by zero."""
    ground, point = {"body": "ground", "point": [0.0, 0.0]}, {"body": "m"}
    scene = Scene.parse(
        {
            "name": "oscillator",
            "gravity": [0.0, 0.0],
            "bodies": {"m": {"kind": "point-mass", "mass": 2.0}},
            "joints": {"way": {"kind": "slider", "first": ground, "second": point}},
            "loads": {"k": {"kind": "spring", "first": ground, "second": point, "stiffness": 80.0, "length": 0.0}},
            "initial": {"m": {"position": [0.1, 0.0]}},
            "markers": {"m": {"body": "m"}},
        },
        "oscillator",
    )
    assert size_of(scene).reach == pytest.approx(0.1)
