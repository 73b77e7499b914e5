"""A recording in other units than was taken for granted is refused with the unit that it seems to have."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.errors import InputError
from shoal.identification import Problem, identify
from shoal.identification.measure import measure
from shoal.identification.recording.plausible import swing
from shoal.scene import Scene, load_scene

SCENE = load_scene("rigid-double-pendulum").with_values({"initial.OA.angle": 0.8, "initial.AB.angle": 0.3})
TIMES = np.linspace(0.0, 1.5, 61)
QUANTITIES = {"angle": [("A", "angle", "a"), ("B", "angle", "b")], "position": [("B", "x", "x"), ("B", "y", "y")]}


def problem(path: Path, kind: str, source: dict[str, Any] | None = None, **channel: Any) -> Problem:
    parameters = {name: {"path": f"initial.{name}.angle", "lower": -3.2, "upper": 3.2} for name in ("OA", "AB")}
    channels = [{"marker": m, "quantity": q, "column": c, **channel} for m, q, c in QUANTITIES[kind]]
    stated = {"name": "one", "scene": SCENE.name, "parameters": parameters, "channels": channels}
    return Problem.parse({**stated, "source": {"kind": "file", "path": str(path), **(source or {})}}, "one")


def recorded(folder: Path, kind: str, time: float = 1.0, size: float = 1.0, still: bool = False) -> Path:
    """A swing with times and values in other units."""
    seen = get_engine("gauss").simulate(SCENE, TIMES)
    a, b = (seen.markers.index(name) for name in "AB")
    columns = seen.points[:, b, :, 0].T if kind == "position" else (seen.angles[:, a, 0], seen.angles[:, b, 0])
    table = np.column_stack([time * TIMES, *(size * np.asarray(column) for column in columns)])
    table[:, 2] = table[0, 2] if still else table[:, 2]
    names = ",".join(["t", *(name for _, _, name in QUANTITIES[kind])])
    np.savetxt(folder / "run.csv", table, delimiter=",", header=names, comments="")
    return folder / "run.csv"


@pytest.mark.parametrize(
    ("kind", "time", "size", "told"),
    [
        ("angle", 1.0, 180 / np.pi, "degrees\\? unit: deg"),
        ("angle", 1e3, 1.0, "milliseconds\\? time_scale: 1.0e-3"),
        ("position", 1e3, 1.0, "milliseconds\\? time_scale: 1.0e-3"),
        ("position", 1.0, 1e3, "mm\\? unit: mm"),
        ("position", 1.0, 1e2, "cm\\? unit: cm"),
    ],
)
def test_a_unit_that_cannot_be_is_refused_and_one_that_is_stated_believed(
    tmp_path: Path, kind: str, time: float, size: float, told: str
) -> None:
    path = recorded(tmp_path, kind, time, size)
    with pytest.raises(InputError, match=told):
        measure(problem(path, kind), SCENE)
    measure(problem(path, kind, {"time_scale": 1.0}, unit="rad" if kind == "angle" else "m"), SCENE)


@pytest.mark.parametrize("kind", ["angle", "position"])
def test_what_may_be_is_let_through(tmp_path: Path, kind: str) -> None:
    measure(problem(recorded(tmp_path, kind), kind), SCENE)
    measure(problem(recorded(tmp_path, kind, 1.4, 1.6), kind), SCENE)


def test_single_outliers_are_no_sign_of_degrees(tmp_path: Path) -> None:
    path = recorded(tmp_path, "angle")
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    table[4::9, 2] += 20.0
    np.savetxt(path, table, delimiter=",", header="t,a,b", comments="")
    measure(problem(path, "angle"), SCENE)


@pytest.mark.parametrize("kind", ["angle", "position"])
def test_a_channel_that_stands_still_is_named_before_any_search(tmp_path: Path, kind: str) -> None:
    with pytest.raises(InputError, match=r"column '[by]' is constant .* moves in the model"):
        identify(problem(recorded(tmp_path, kind, still=True), kind))


def hinged(axis: list[float]) -> Scene:
    """A rod of 0.6 m in space on a hinge alone, under gravity along -z."""
    return Scene.model_validate({
        "name": "hinged", "dimensions": 3, "gravity": [0, 0, -9.81],
        "bodies": {"r": {"kind": "rod", "length": 0.6, "height": 0.01, "width": 0.01, "density": 2700.0}},
        "joints": {"h": {"kind": "revolute", "axis": axis, "first": {"body": "ground", "point": [0, 0, 0]},
                         "second": {"body": "r"}}},
        "markers": {"e": {"body": "r", "point": "end"}},
    })  # fmt: skip


def test_a_hinge_in_space_swings_by_gravity_across_its_axis() -> None:
    """As in the plane; about an upright axis gravity turns nothing, and no time is too long."""
    scales = swing(hinged([0.0, 1.0, 0.0]))
    assert scales is not None
    assert scales.size == pytest.approx(0.6)
    assert scales.slow == scales.fast == pytest.approx(2 * np.pi * np.sqrt(0.6 / 9.81))
    tilted = swing(hinged([0.0, 0.6, 0.8]))
    assert tilted is not None
    assert tilted.slow == pytest.approx(scales.slow / np.sqrt(0.6))
    assert swing(hinged([0.0, 0.0, 2.0])) is None
