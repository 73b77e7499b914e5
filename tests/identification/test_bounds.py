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
