"""Multiple shooting: segments that meet, on data that a textbook integrator computed."""

from typing import Any

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.errors import InputError
from shoal.identification import Problem, load_problem, measure
from shoal.identification.forward import ForwardModel
from shoal.identification.methods.multiple_shooting import cut, multiple_shooting
from shoal_validation.inverse_precision.chaos import CHAOTIC, SOLVER, record, two_markers


def forward(problem: Problem, horizon: float) -> ForwardModel:
    data = record(problem, CHAOTIC, horizon)
    return ForwardModel(problem, problem.load_scene(SOLVER), get_engine("gauss"), data)


def test_segments_cover_every_sample_once_and_meet() -> None:
    model = forward(two_markers(), 2.0)
    segments = cut(model)
    times = model.measurement.first.times
    assert len(segments.begins) == 4
    rebuilt = segments.begins[segments.number] + segments.short.measurement.first.times[segments.place]
    assert rebuilt == pytest.approx(times)
    ends = segments.begins[:-1] + segments.short.measurement.first.times[segments.ends]
    assert ends == pytest.approx(segments.begins[1:])


def test_measured_states_are_near_the_simulated_ones() -> None:
    model = forward(two_markers(), 2.0)
    segments = cut(model)
    states = segments.measured()
    assert states is not None
    true = segments.simulated(np.array(CHAOTIC))
    assert np.max(np.abs(np.sin((states - true)[:, ::2] / 2))) < 0.01
    assert np.max(np.abs((states - true)[:, 1::2])) < 1.0


def test_the_answer_is_the_motion() -> None:
    model = forward(two_markers(), 3.0)
    outcome = multiple_shooting(model, np.random.default_rng(0), lambda *_: None)
    assert outcome.point == pytest.approx(np.array(CHAOTIC), abs=1e-3)
    assert outcome.fitness == pytest.approx(4e-6, rel=0.2)
    assert model.work < 60


@pytest.mark.slow
def test_ten_chaotic_seconds() -> None:
    model = forward(two_markers(), 10.0)
    outcome = multiple_shooting(model, np.random.default_rng(0), lambda *_: None)
    assert outcome.point == pytest.approx(np.array(CHAOTIC), abs=1e-3)
    assert model.work < 60


REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "clock": ({"path": "measurement.clock", "lower": 0.5, "upper": 2.0}, "clock and delay as known"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_it_cannot_do_is_refused_in_one_line(name: str) -> None:
    parameter, words = REFUSED[name]
    data = two_markers().model_dump(mode="json")
    data["parameters"]["more"] = parameter
    with pytest.raises(InputError, match=words):
        cut(forward(Problem.parse(data, name), 1.0))


def test_flexible_bodies_are_refused() -> None:
    problem = load_problem("paper-case-1-same-mesh")
    scene = problem.load_scene()
    model = ForwardModel(problem, scene, get_engine("gauss"), measure(problem, scene))
    with pytest.raises(InputError, match="rigid bodies only; use progressive"):
        cut(model)
