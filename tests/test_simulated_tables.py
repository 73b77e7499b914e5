"""Tables that `shoal simulate` writes begin with the motion: as drives and as recordings they agree with it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import yaml
from click.testing import CliRunner
from scipy.special import ellipj, ellipk
from shoal.cli import main
from shoal.table import load_table

GRAVITY, LENGTH, MASS = 9.81, 0.6, 1.3
GROUND = {"body": "ground", "point": [0.0, 0.0]}


def pendulum(angle: float, inertia: float, samples: int) -> dict[str, object]:
    """A rigid pendulum with a moment of inertia about its pivot, released from rest."""
    body = {"kind": "rigid-body", "mass": MASS, "inertia": inertia - MASS * LENGTH**2}
    return {
        "name": "pendulum",
        "gravity": [0.0, -GRAVITY],
        "bodies": {"A": {**body, "centre_of_mass": [LENGTH, 0.0], "named_points": {"end": [1.0, 0.0]}}},
        "joints": {"O": {"first": GROUND, "second": {"body": "A"}}},
        "markers": {"T": {"body": "A", "point": "end"}},
        "initial": {"A": {"angle": angle}},
        "solver": {"duration": 1.0, "samples": samples},
    }


def closed_form(times: np.ndarray, angle: float, inertia: float) -> np.ndarray:
    """Return the angle [rad] from the x axis of a pendulum released from rest, by Jacobi's elliptic functions."""
    modulus = np.sin((angle + np.pi / 2) / 2)
    phase = ellipk(modulus**2) - np.sqrt(MASS * GRAVITY * LENGTH / inertia) * times
    return 2.0 * np.arcsin(modulus * ellipj(phase, modulus**2)[0]) - np.pi / 2


def run(*arguments: object) -> dict[str, object]:
    done = CliRunner().invoke(main, [*map(str, arguments), "--json"])
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)


def simulated(folder: Path, seed: int, samples: int, suffix: str = "csv") -> tuple[Path, float, float]:
    """Write a scene drawn at random and the table of its motion, with its angle and its moment of inertia."""
    rng = np.random.default_rng(seed)
    angle, inertia = float(rng.uniform(-1.2, 1.2)), float(MASS * LENGTH**2 * rng.uniform(1.1, 2.0))
    (folder / "pendulum.yaml").write_text(yaml.safe_dump(pendulum(angle, inertia, samples)))
    run("simulate", folder / "pendulum.yaml", "--out", folder / f"run.{suffix}")
    return folder / f"run.{suffix}", angle, inertia


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_a_table_begins_with_the_motion_and_drives_without_a_hold(seed: int, suffix: str, tmp_path: Path) -> None:
    table, angle, inertia = simulated(tmp_path, seed, 40, suffix)
    frame = load_table(table).frame
    times = frame["t"].to_numpy()
    assert times == pytest.approx(np.linspace(0.0, 1.0, 41), abs=1e-12)
    assert frame["T.angle"].to_numpy() == pytest.approx(closed_form(times, angle, inertia), abs=1e-8)
    scene = pendulum(angle, inertia, 40)
    motor = {"kind": "driven-angle", "first": GROUND, "second": {"body": "A"}}
    scene["joints"] |= {"motor": {**motor, "angle": {"path": table.name, "column": "T.angle"}}}  # type: ignore[operator]
    (tmp_path / "driven.yaml").write_text(yaml.safe_dump(scene))
    answer = run("simulate", tmp_path / "driven.yaml")
    assert "held_drives" not in answer["model"]  # type: ignore[operator]
    driven = answer["markers"]["T"]["angle"]  # type: ignore[index]
    assert driven == pytest.approx(closed_form(times, angle, inertia), abs=1e-8)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("samples", [8, 40])
@pytest.mark.by_day(2)
def test_a_table_as_a_recording_gives_its_machine_back(seed: int, samples: int, tmp_path: Path) -> None:
    """Of 8 samples the first after the start is so late that a recording without t = 0 would begin there."""
    table, _, inertia = simulated(tmp_path, seed, samples)
    about_centre = inertia - MASS * LENGTH**2
    sought = {"path": "bodies.A.inertia", "lower": 0.2 * about_centre, "upper": 5 * about_centre}
    channels = [{"marker": "T", "quantity": axis, "column": f"T.{axis}"} for axis in "xy"]
    source = {"kind": "file", "path": table.name}
    problem = {"name": "own", "scene": "pendulum.yaml", "parameters": {"I": sought}}
    (tmp_path / "own.yaml").write_text(yaml.safe_dump({**problem, "channels": channels, "source": source}))
    answer = run("identify", tmp_path / "own.yaml")
    assert answer["verdict"] == "identified"
    assert answer["parameters"]["I"]["value"] == pytest.approx(about_centre, rel=1e-5)  # type: ignore[index]


def test_stated_times_stay_as_stated(tmp_path: Path) -> None:
    (tmp_path / "pendulum.yaml").write_text(yaml.safe_dump(pendulum(0.2, 1.0, 10)))
    assert run("simulate", tmp_path / "pendulum.yaml", "--at", "0.25,0.5")["markers"]["T"]["t"] == [0.25, 0.5]  # type: ignore[index]
