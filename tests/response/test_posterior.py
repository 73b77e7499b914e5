"""What was identified is carried, with its spread, to the motion of the same machine elsewhere."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from shoal.cli import main
from shoal.engines import get_engine
from shoal.errors import InputError
from shoal.identification import Estimate, Problem, identify
from shoal.identification.conclude import Options
from shoal.notebook import uncertain
from shoal.pictures import files
from shoal.response.inputs import Inputs
from shoal.response.read import parameters
from shoal.scene import load_scene
from shoal.trajectory import Array

SCENE = "rigid-double-pendulum"
LENGTH, FIRST, SECOND = "bodies.AB.length", "initial.OA.angle", "initial.AB.angle"
WHEN = [0.5, 1.5]


def problem() -> Problem:
    """The second angle is tied to the first by a parameter without a path; the clock is the recording's."""
    return Problem.parse(
        {
            "name": "first-run",
            "scene": SCENE,
            "parameters": {
                "first": {"path": FIRST, "lower": -3.3, "upper": 3.3},
                "spread": {"lower": -1.0, "upper": 1.0},
                "length": {"path": LENGTH, "lower": 0.5, "upper": 3.0, "start": 1.6},
                "clock": {"path": "measurement.clock", "lower": 0.5, "upper": 2.0, "start": 1.0},
            },
            "ties": {SECOND: "first + spread"},
            "channels": [{"marker": m, "quantity": q} for m in "AB" for q in "xy"],
            "source": {
                "kind": "engine",
                "engine": "gauss",
                "values": {FIRST: 0.4, SECOND: 0.7, LENGTH: 1.3},
                "stop": 1.0,
                "count": 40,
                "noise": 3e-3,
            },
        },
        "problem",
    )


@pytest.fixture(scope="module")
def estimate() -> Estimate:
    return identify(problem(), method="least-squares")


@pytest.fixture(scope="module")
def file(estimate: Estimate, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("estimate") / "estimate.json"
    files.estimate(estimate, problem(), path)
    return path


def places(first: Array, spread: Array, length: Array) -> Array:
    """x, y of B at both instants, (lanes, instants, 2)."""
    values = {FIRST: first, SECOND: first + spread, LENGTH: length}
    motion = get_engine("gauss").simulate_many(load_scene(SCENE), values, np.array(WHEN))
    return np.moveaxis(motion.points[:, motion.markers.index("B")], 2, 0)


def test_the_spread_is_that_of_linear_propagation(estimate: Estimate, file: Path) -> None:
    """J S J', with differences of the motion and the covariance of the estimate, less the clock's row and column."""
    assert estimate.covariance is not None
    middle = np.array([estimate.parameters[name].value for name in ("first", "spread", "length")])
    covariance = estimate.covariance[:3, :3]
    step = 1e-4
    sides = [places(*(middle[:, None] + sign * step * np.eye(3))) for sign in (1, -1)]
    slopes = np.moveaxis((sides[0] - sides[1]) / (2 * step), 0, -1)
    expected = np.sqrt(np.einsum("tqi,ij,tqj->tq", slopes, covariance, slopes))
    found = uncertain(SCENE, [str(file)], WHEN, verify=False)
    assert found.ok
    assert found.statistics is not None
    std = np.stack([found.column("B", axis, found.statistics.std) for axis in "xy"], axis=1)
    assert std == pytest.approx(expected, rel=0.02)
    mean = np.stack([found.column("B", axis, found.statistics.mean) for axis in "xy"], axis=1)
    assert np.all(np.abs(mean - places(*middle[:, None])[0]) < 0.1 * expected)
    told = found.to_json()
    assert list(told["parameters"]) == [FIRST, "spread", LENGTH]
    assert told["left_out"] == {"clock": "of the measurement"}


@pytest.mark.slow
def test_the_spread_of_draws_is_that_of_their_motions(tmp_path: Path) -> None:
    """Mean and deviation of the machine run at 4000 of the draws themselves, their correlation as it is."""
    pytest.importorskip("emcee")
    pytest.importorskip("xarray")
    estimate = identify(problem(), method="least-squares", options=Options(sample=400))
    files.estimate(estimate, problem(), tmp_path / "draws.nc")
    assert estimate.posterior is not None
    some = estimate.posterior.flat[:: max(1, len(estimate.posterior.flat) // 4000), :3]
    exact = places(*some.T)
    found = uncertain(SCENE, [str(tmp_path / "draws.nc")], WHEN, verify=False)
    assert found.statistics is not None
    std = np.stack([found.column("B", axis, found.statistics.std) for axis in "xy"], axis=1)
    mean = np.stack([found.column("B", axis, found.statistics.mean) for axis in "xy"], axis=1)
    assert std == pytest.approx(exact.std(axis=0), rel=0.06)
    assert np.all(np.abs(mean - exact.mean(axis=0)) < 0.06 * std)


def test_the_command_takes_it_beside_others(file: Path) -> None:
    """An interval of gravity beside it: bounds of the statistics; the values of a run keep the tie."""
    words = [
        "uncertain",
        SCENE,
        "--vary",
        str(file),
        "--vary",
        "gravity.1=-9.9:-9.7",
        "--at",
        "0.5",
    ]
    run = CliRunner().invoke(main, [*words, "--no-verify"])
    assert run.exit_code == 0, run.output
    assert "left out of estimate.json: clock (of the measurement)" in run.output
    inputs = Inputs(parameters([str(file)], load_scene(SCENE)))
    values = inputs.values(np.array([[1.0, -2.0, 0.5]]))
    named = inputs.named(np.array([[1.0, -2.0, 0.5]]))[0]
    assert values[SECOND] == pytest.approx(named[0] + named[1])
    assert inputs.at(named)[SECOND] == pytest.approx(float(values[SECOND][0]))


def change(data: dict[str, Any], what: str) -> dict[str, Any]:
    if what == "failed":
        data |= {"status": "failed", "verdict": "failed"}
    if what == "old":
        del data["joint"]
    if what == "unknown":
        data["joint"]["parameters"]["length"]["known"] = False
    if what == "broken":
        data["joint"]["covariance"] = [[1.0]]
    return data


@pytest.mark.parametrize(
    ("what", "scene", "names"),
    [
        ("failed", SCENE, "cannot be trusted"),
        ("old", SCENE, "identify once more"),
        ("unknown", SCENE, "length is not known from what was measured"),
        ("broken", SCENE, "does not hold finite values"),
        ("", "single-pendulum", "bodies.AB.length: does not fit scene single-pendulum"),
    ],
)
def test_what_does_not_fit_is_refused_in_one_line(
    what: str, scene: str, names: str, file: Path, tmp_path: Path
) -> None:
    data = json.loads((file).read_text())
    (tmp_path / "changed.json").write_text(json.dumps(change(data, what)))
    run = CliRunner().invoke(main, ["uncertain", scene, "--vary", str(tmp_path / "changed.json")])
    assert run.exit_code == 2
    assert names in run.stderr
    assert len(run.stderr.strip().splitlines()) == 1


def test_files_that_hold_nothing_of_it(tmp_path: Path) -> None:
    for name, text, words in (
        ("a.json", "{}", "is no estimate"),
        ("b.json", "no", "is no JSON"),
        ("c.nc", "no", "draws"),
    ):
        (tmp_path / name).write_text(text)
        with pytest.raises(InputError, match=words):
            uncertain(SCENE, [str(tmp_path / name)])
    with pytest.raises(InputError, match="cannot be read"):
        uncertain(SCENE, [str(tmp_path / "nowhere.json")])
