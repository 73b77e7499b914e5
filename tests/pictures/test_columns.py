"""Motions and sweeps as Parquet and NetCDF: read by others, with units and what was computed."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from shoal.cli import main
from shoal.commands import options
from shoal.scene import Scene, load_scene
from shoal.table import load_table

ASKED = ["simulate", "single-pendulum", "--set", "solver.duration=0.5", "--set", "solver.samples=5"]


def written(file: Path, *more: str, asked: list[str] = ASKED) -> dict[str, Any]:
    done = CliRunner().invoke(main, [*asked, *more, "--out", str(file), "--json"])
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)


def test_a_motion_as_parquet(tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    answer = written(tmp_path / "motion.parquet")
    table = parquet.read_table(tmp_path / "motion.parquet")
    units = {field.name: field.metadata[b"unit"].decode() for field in table.schema}
    assert units == {"t": "s", "A.x": "m", "A.y": "m", "A.angle": "rad"} | {
        name: unit for name, unit in units.items() if name in ("A.vx", "A.vy", "A.rate")
    }
    for name in ("x", "y", "angle"):
        assert table[f"A.{name}"].to_pylist() == answer["markers"]["A"][name]
    told = {key.decode(): value.decode() for key, value in table.schema.metadata.items()}
    expected = load_scene("single-pendulum").with_values({"solver.duration": 0.5, "solver.samples": 5})
    assert told["shoal.fingerprint"] == expected.fingerprint
    assert Scene.parse(json.loads(told["shoal.scene_as_json"])) == expected
    assert (told["shoal.scene"], told["shoal.status"], told["shoal.engine"]) == ("single-pendulum", "ok", "gauss")
    assert float(told["shoal.time_error_m"]) == answer["model"]["verification"]["time_error"]
    recording = load_table(tmp_path / "motion.parquet").frame
    assert recording["A.angle"].tolist() == answer["markers"]["A"]["angle"]


def test_a_motion_as_netcdf(tmp_path: Path) -> None:
    xarray = pytest.importorskip("xarray")
    answer = written(tmp_path / "motion.nc")
    with xarray.open_dataset(tmp_path / "motion.nc") as data:
        assert dict(data.sizes) == {"time": 6, "marker": 1}
        assert np.array_equal(data["x"].sel(marker="A"), answer["markers"]["A"]["x"])
        assert {name: data[name].units for name in ("time", "x", "angle")} == {"time": "s", "x": "m", "angle": "rad"}
        assert data.attrs["scene"] == "single-pendulum"
        assert data.attrs["energy_drift"] == answer["energy_drift"]
        assert data.attrs["time_error_m"] == answer["model"]["verification"]["time_error"]
        assert "mesh_error_m" not in data.attrs


def test_a_motion_in_space(tmp_path: Path) -> None:
    xarray = pytest.importorskip("xarray")
    answer = written(tmp_path / "m.nc", asked=["simulate", "spherical-pendulum", "--no-verify"])
    with xarray.open_dataset(tmp_path / "m.nc") as data:
        assert np.array_equal(data["z"].sel(marker="A"), answer["markers"]["A"]["z"])


@pytest.mark.parametrize("ending", ["parquet", "nc"])
def test_a_sweep(ending: str, tmp_path: Path) -> None:
    parquet, xarray = pytest.importorskip("pyarrow.parquet"), pytest.importorskip("xarray")
    vary = ["sweep", "single-pendulum", "--vary", "initial.OA.angle=0:1:3", "--vary", "initial.OA.rate=0:1:2"]
    rows = written(tmp_path / f"s.{ending}", asked=[*vary, "--at", "0.3"])["rows"]
    if ending == "parquet":
        table = parquet.read_table(tmp_path / "s.parquet")
        assert table.to_pylist() == rows
        assert table.schema.field("A.dx").metadata == {b"unit": b"m"}
        assert table.schema.metadata[b"shoal.time_s"] == b"0.3"
        return
    with xarray.open_dataset(tmp_path / "s.nc") as data:
        assert data["initial.OA.angle"].values.tolist() == [row["initial.OA.angle"] for row in rows]
        assert data["dy"].sel(marker="A").values.tolist() == [row["A.dy"] for row in rows]
        assert set(data["status"].values.tolist()) == {"ok"}


def test_what_cannot_be_written_is_refused_before_it_is_computed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(options, "find_spec", lambda name: None)
    for ending, package in options.NEEDED.items():
        done = CliRunner().invoke(main, [*ASKED, "--out", f"m{ending}"])
        assert done.exit_code == 2
        expected = f"shoal: out: m{ending} needs the package {package}; install it, or write another form\n"
        assert done.stderr == expected
