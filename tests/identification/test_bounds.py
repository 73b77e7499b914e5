"""Bounds that a scene cannot have: named, with the nearest that it can have."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from shoal.engines import get_engine
from shoal.errors import InputError
from shoal.identification import Measurement, Problem
from shoal.identification.forward import ForwardModel


def _problem(folder: Path, lower: float, upper: float) -> Problem:
    """The second principal moment of a body in space whose others are 3 and 5 kg m^2: it is from 2 to 8."""
    scene: dict[str, Any] = {
        "name": "top", "dimensions": 3, "gravity": [0.0, 0.0, 0.0], "joints": {}, "markers": {"m": {"body": "b"}},
        "bodies": {"b": {"kind": "rigid-body", "mass": 1.0, "inertia": [3.0, 4.0, 5.0]}},
        "initial": {"b": {"position": [0.0, 0.0, 0.0]}},
    }  # fmt: skip
    (folder / "top.yaml").write_text(yaml.safe_dump(scene))
    return Problem.parse({
        "name": "spin", "scene": str(folder / "top.yaml"),
        "channels": [{"marker": "m", "quantity": "x", "column": "x"}],
        "parameters": {"I2": {"path": "bodies.b.inertia.1", "lower": lower, "upper": upper}},
        "source": {"kind": "file"},
    }, "spin")  # fmt: skip


@pytest.mark.parametrize(
    ("lower", "upper", "side", "nearest"), [(0.4, 6.0, "lower: 0.4", "2"), (3.0, 40.0, "upper: 40", "8")]
)
def test_the_bound_of_a_principal_moment_obeys_the_triangle(
    lower: float, upper: float, side: str, nearest: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError) as refusal:
        _problem(tmp_path, lower, upper).load_scene()
    text = str(refusal.value)
    assert text.startswith(f"spin: parameters.I2.{side} cannot be: ")
    assert text.endswith(f"; with the rest of top as it is {nearest} can be")
    assert "\n" not in text
    _problem(tmp_path, max(lower, 2.0), min(upper, 8.0)).load_scene()


def test_a_bound_that_a_tie_makes_right_is_one(tmp_path: Path) -> None:
    """Principal moments a, a, 5 obey the triangle from a = 2.5 on; beside the 4 of the scene a is from 1 to 9."""
    alone = _problem(tmp_path, 3.0, 6.0).model_dump(exclude_unset=True)
    moment = {"path": "bodies.b.inertia.0", "lower": 2.6, "upper": 90.0}
    fields = alone | {"parameters": {"a": moment}, "ties": {"bodies.b.inertia.1": "a"}}
    problem = Problem.parse(fields, "spin")
    scene = problem.load_scene()
    channels = problem.channels_of(problem.sources["recording"])
    measurement = Measurement.single(np.array([0.0, 0.1]), channels, np.zeros((2, 1)), "nothing", noise=1.0)
    model = ForwardModel(problem, scene, get_engine("gauss"), measurement)
    assert np.isfinite(model.uncounted(np.array([[2.6], [30.0], [90.0]]))).all()
    low = {"a": moment | {"lower": 0.5}}
    with pytest.raises(InputError, match=r"parameters\.a\.lower: 0\.5 cannot be: .* 2\.5 can be"):
        Problem.parse(fields | {"parameters": low}, "spin").load_scene()


def _model(problem: Problem) -> ForwardModel:
    channels = problem.channels_of(problem.sources["recording"])
    measurement = Measurement.single(np.array([0.0, 0.1]), channels, np.zeros((2, 1)), "nothing", noise=1.0)
    return ForwardModel(problem, problem.load_scene(), get_engine("gauss"), measurement)


def test_all_three_principal_moments_are_sought(tmp_path: Path) -> None:
    """Each obeys the triangle beside those of its point: what a scan holds beside the scene's own need not."""
    one = _problem(tmp_path, 2.0, 8.0).model_dump(exclude_unset=True)
    bounds = [(1.0, 9.0), (2.0, 8.0), (1.0, 7.0)]
    sought = {
        f"I{k}": {"path": f"bodies.b.inertia.{k}", "lower": low, "upper": high} for k, (low, high) in enumerate(bounds)
    }
    model = _model(Problem.parse(one | {"parameters": sought}, "spin"))
    told = np.isfinite(model.uncounted(np.array([[1.2, 2.0, 1.5], [1.2, 2.1, 1.5]])))
    assert told.all()
    told = np.isfinite(model.uncounted(np.array([[1.2, 2.0, 1.5], [1.2, 8.0, 1.5], [3.0, 4.0, 5.0]]))).all(axis=1)
    assert told.tolist() == [True, False, True]


def test_a_factor_on_a_known_moment_is_beside_what_is_sought(tmp_path: Path) -> None:
    """No body has 3, 4 and 10 kg m^2; one has 3, 8 and 10."""
    model = _model(_problem(tmp_path, 2.0, 8.0))
    seen = model.observe(np.array([[4.0], [8.0]]), factors={"bodies.b.inertia.2": 2.0})
    assert np.isfinite(seen).all(axis=(1, 2)).tolist() == [False, True]
