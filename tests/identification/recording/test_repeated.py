"""A sample that is fitted twice would halve its variance: such recordings are refused, windows side by side are not."""

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from shoal.errors import InputError
from shoal.identification import Problem, measure

CHANNELS = [{"marker": "A", "quantity": axis, "column": axis} for axis in "xy"]
PARAMETERS = {"first": {"path": "initial.OA.angle", "lower": -3.0, "upper": 3.0, "own": True}}


def table(path: Path, seed: int = 0) -> None:
    """A whirling point with noise, 200 samples in 2 s."""
    t = np.arange(0.0, 2.0, 0.01)
    noise = 1e-3 * np.random.default_rng(seed).standard_normal((2, len(t)))
    rows = np.column_stack([t, np.cos(t) + noise[0], np.sin(t) + noise[1]])
    np.savetxt(path, rows, delimiter=",", header="t,x,y", comments="")


def problem(folder: Path, **recordings: dict[str, Any]) -> Problem:
    """Of these recordings, by a file, as a user has it."""
    table(folder / "run.csv")
    table(folder / "other.csv", seed=1)
    shutil.copy(folder / "run.csv", folder / "copy.csv")
    named = {name: {"kind": "file", "path": "run.csv", **stated} for name, stated in recordings.items()}
    for stated in named.values():
        stated["path"] = str(folder / stated["path"])
    data = {"name": "two", "scene": "single-pendulum", "channels": CHANNELS, "parameters": PARAMETERS}
    return Problem.parse({**data, "recordings": named}, "two")


def read(asked: Problem, data: dict[str, str] | None = None) -> None:
    measure(asked, asked.load_scene(), data)


@pytest.mark.parametrize(
    ("one", "other", "said"),
    [
        ({}, {}, "same 200 samples of column 'x' of run.csv"),
        ({"duration": 1.0}, {"start": 0.5, "duration": 1.0}, "0.5 s to 1 s"),
        ({}, {"every": 3}, "same 67 samples"),
        ({}, {"channels": [{"marker": "A", "quantity": "x", "column": "x", "unit": "mm"}]}, "column 'x'"),
        ({}, {"path": "copy.csv"}, r"same 200 samples \(run.csv, copy.csv\)"),
        ({"duration": 1.0}, {"path": "copy.csv", "start": 0.5}, "a copy would count twice"),
    ],
)
def test_samples_that_are_fitted_twice_are_refused(
    tmp_path: Path, one: dict[str, Any], other: dict[str, Any], said: str
) -> None:
    with pytest.raises(InputError, match=f"^recordings: a and b .*{said}") as refusal:
        read(problem(tmp_path, a=one, b=other))
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ({"duration": 1.0}, {"start": 1.0}),
        ({"hold_out": [1.0, 2.0]}, {"start": 1.005}),
        ({"channels": CHANNELS[:1]}, {"channels": CHANNELS[1:]}),
        ({}, {"path": "other.csv"}),
    ],
)
def test_windows_that_touch_other_columns_and_other_runs_are_read(
    tmp_path: Path, one: dict[str, Any], other: dict[str, Any]
) -> None:
    read(problem(tmp_path, a=one, b=other))


def test_data_that_are_given_by_name_are_looked_at_too(tmp_path: Path) -> None:
    asked = problem(tmp_path, a={}, b={"path": "other.csv"})
    with pytest.raises(InputError, match="recordings: a and b"):
        read(asked, {"b": str(tmp_path / "copy.csv")})
