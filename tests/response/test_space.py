"""Uncertain machines in space: bounds, statistics and limits of x, y and z, against the equations of a pendulum."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from shoal.cli import main
from shoal.errors import InputError
from shoal.notebook import uncertain
from shoal.scene import load_scene
from shoal_validation.problems.in_space import swing
from shoal_validation.problems.one_angle import G

PENDULUM = load_scene("spherical-pendulum")
TIMES = [0.5, 1.0]
LOW, HIGH = -9.9, -9.7


def places(gravity: float) -> Any:
    """The mass point at TIMES under another gravity: the same swing in a time that runs otherwise, (times, 3)."""
    pace = np.sqrt(-gravity / G)
    polar, _, azimuth = swing((np.pi / 3, 0.0, 2.0 / pace), pace * np.array(TIMES))
    level = np.sin(polar)
    return np.stack([level * np.cos(azimuth), level * np.sin(azimuth), -np.cos(polar)], axis=1)


@pytest.mark.slow
def test_bounds_of_all_coordinates_are_those_of_the_equations() -> None:
    found = uncertain(PENDULUM, {"gravity.2": (LOW, HIGH)}, TIMES)
    assert found.ok, found.message
    assert found.quantities == ("x", "y", "z")
    assert found.bounds is not None
    known = np.array([places(gravity) for gravity in np.linspace(LOW, HIGH, 201)])
    for k, axis in enumerate("xyz"):
        lower, upper = (found.column("A", axis, of) for of in (found.bounds.lower, found.bounds.upper))
        assert lower == pytest.approx(known.min(axis=0)[:, k], abs=1e-7)
        assert upper == pytest.approx(known.max(axis=0)[:, k], abs=1e-7)


@pytest.mark.slow
def test_statistics_and_the_probability_of_a_limit_on_z() -> None:
    bound = float(places(-9.85)[1, 2])
    found = uncertain(PENDULUM, {"gravity.2": "uniform(-9.9, -9.7)"}, TIMES, limit=[f"A.z > {bound:.12f}"])
    assert found.statistics is not None
    known = np.array([places(gravity)[:, 2] for gravity in np.linspace(LOW, HIGH, 2001)])
    assert found.column("A", "z", found.statistics.mean) == pytest.approx(known.mean(axis=0), abs=1e-6)
    (judged,) = found.limits
    assert judged.exceedance is not None
    low, high = (float(of[-1]) for of in judged.exceedance.estimate.interval)
    assert low <= np.mean(np.any(known > bound, axis=1)) <= high


@pytest.mark.parametrize("limit", ["A.angle > 1", "A.rate > 1"])
def test_an_angle_in_the_plane_is_no_limit_in_space(limit: str) -> None:
    with pytest.raises(InputError, match="there are x, y, z, vx, vy, vz, speed"):
        uncertain(PENDULUM, {"gravity.2": (LOW, HIGH)}, TIMES, limit=[limit])


def test_z_is_no_limit_in_the_plane() -> None:
    with pytest.raises(InputError, match="no quantity 'z'"):
        uncertain("single-pendulum", {"bodies.OA.mass": (0.9, 1.1)}, TIMES, limit=["A.z > 1"])


@pytest.mark.parametrize("suffix", [".html", ".png", ".csv"])
@pytest.mark.by_day(1)
def test_pictures_and_tables_show_three_coordinates(tmp_path: Path, suffix: str) -> None:
    file = tmp_path / f"found{suffix}"
    arguments = ["uncertain", "spherical-pendulum", "--vary", f"gravity.2={LOW}:{HIGH}", "--at", "0.5,1", "--json"]
    run = CliRunner().invoke(main, [*arguments, "--out", str(file)], standalone_mode=False)
    assert set(json.loads(run.stdout)["bounds"]["A"]) == {"x", "y", "z"}
    assert file.stat().st_size > 0
    if suffix == ".csv":
        assert "A.z.lower" in file.read_text().splitlines()[0]
