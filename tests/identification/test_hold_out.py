"""What was held out of a fit is predicted, and the error is one that the estimate states."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from shoal.cli import main
from shoal.errors import InputError
from shoal.identification import Estimate, Problem, Verdict, identify, load_problem
from shoal.identification.recording.measurement import Recording
from shoal.identification.recording.source import Channel, FileSource
from shoal.identification.uncertainty import prediction
from shoal.identification.uncertainty.covariance import Noise
from shoal.identification.uncertainty.linearisation import Linearisation
from shoal.identification.uncertainty.prediction_error import stated

DATA = Path(__file__).parents[3] / "shared" / "data"
CHANNELS = (Channel(marker="B", quantity="x", column="x"), Channel(marker="B", quantity="y", column="y"))


def problem(seed: int = 0, friction: float = 0.0, hold_out: Any = (), noise: float | None = None) -> Problem:
    """A double pendulum without friction, recorded from one that may have some."""
    truth = {"initial.OA.angle": 0.4, "bodies.AB.length": 1.3, "joints.A.friction": friction}
    data: dict[str, Any] = {
        "name": "held",
        "scene": "rigid-double-pendulum",
        "parameters": {
            "angle": {"path": "initial.OA.angle", "lower": -3.3, "upper": 3.3, "start": 0.39},
            "length": {"path": "bodies.AB.length", "lower": 0.5, "upper": 3.0, "start": 1.31},
        },
        "channels": [channel.model_dump() for channel in CHANNELS],
        "source": {
            **{"kind": "engine", "engine": "gauss", "values": truth, "stop": 1.0, "count": 50, "noise": 1e-3},
            **{"seed": seed, "hold_out": list(hold_out)},
        },
    }
    return Problem.parse(data | ({"noise": noise} if noise else {}), "held")


def fitted(*arguments: Any, **changes: Any) -> Estimate:
    return identify(problem(*arguments, **changes), method="least-squares")


def test_samples_are_fitted_or_held() -> None:
    times = np.linspace(1.0, 2.0, 11)
    recording = Recording(times, CHANNELS, np.column_stack([times, -times]), "here", np.full(2, np.nan))
    found = recording.holding([(6.65, 7.05), (6.0, 6.1)], begin=5.0)
    np.testing.assert_allclose(found.times, [1.2, 1.3, 1.4, 1.5, 1.6])
    assert [one.window for one in found.held] == [(6.0, 6.1), (6.65, 7.05)]
    np.testing.assert_allclose(found.held[1].times, [1.7, 1.8, 1.9, 2.0])
    np.testing.assert_allclose(found.held[1].values[:, 1], [-1.7, -1.8, -1.9, -2.0])
    assert found.origin == "here, 6 of them held out"


def test_a_window_of_empty_cells_is_refused_as_such() -> None:
    times = np.arange(1, 11) / 10.0
    values = np.column_stack([np.where((times > 0.35) & (times < 0.65), np.nan, times)] * 2)
    recording = Recording(times, CHANNELS, values, "here", np.full(2, np.nan))
    with pytest.raises(InputError, match=r"no sample from 0.4 s to 0.6 s; all cells of its 3 rows are empty"):
        recording.holding([(0.4, 0.6)])


@pytest.mark.parametrize(
    ("windows", "words"),
    [
        ([3.0, 4.0], "hold_out: no sample from 3 s to 4 s; the recording covers 0.1 s to 1 s"),
        ([0.15, 1.0], "hold_out: 1 samples are left to fit"),
        ([0.5, 0.2], "the later last"),
        ([[0.1, 0.5], [0.4, 0.6]], "windows overlap"),
        ([0.1], "hold_out"),
    ],
)
def test_windows_that_cannot_be_held_out_are_refused_in_one_line(windows: Any, words: str) -> None:
    with pytest.raises(InputError, match=words) as refusal:
        identify(
            Problem.parse(
                {
                    **problem().model_dump(),
                    "source": {**problem().model_dump()["source"], "count": 10, "hold_out": windows},
                },
                "held",
            )
        )
    assert "\n" not in str(refusal.value)


@pytest.mark.slow
def test_what_is_held_out_does_not_change_the_fit(tmp_path: Path) -> None:
    """As if these samples had never been measured; windows are by the table's clock."""
    whole = fitted().measurement.first
    rows = np.column_stack([whole.times + 3.0, whole.values])
    inside = (whole.times > 0.595) & (whole.times < 0.805)
    for name, table in (("all", rows), ("gap", rows[~inside])):
        text = "\n".join(["t,x,y", *(",".join(map(repr, row)) for row in table.tolist())])
        (tmp_path / f"{name}.csv").write_text(text)
    source = FileSource(start=3.0)
    recorded = problem().model_copy(update={"source": source})
    held = identify(recorded, data=str(tmp_path / "all.csv"), hold_out=[(3.6, 3.8)], method="least-squares")
    (tmp_path / "run.yaml").write_text("path: all.csv\nhold_out: [3.6, 3.8]\n")
    stated = identify(recorded, data=str(tmp_path / "run.yaml"), method="least-squares")
    gap = identify(recorded, data=str(tmp_path / "gap.csv"), method="least-squares")
    for name, value in gap.parameters.items():
        assert held.parameters[name] == stated.parameters[name] == value
    (one,) = held.prediction
    assert one.window == (3.6, 3.8)
    np.testing.assert_array_equal(one.measured, whole.values[inside])
    expected = np.sqrt(np.mean((one.predicted - one.measured) ** 2, axis=0))
    assert [channel.rms for channel in one.channels] == pytest.approx(expected)
    assert not gap.prediction


@pytest.mark.parametrize("rho", [0.0, 0.9])
def test_the_stated_limit_is_what_95_of_100_errors_stay_below(rho: float) -> None:
    """Against draws of parameters and of noise."""
    rng = np.random.default_rng(1)
    slopes = np.column_stack([np.linspace(1, 3, 80), np.sin(np.arange(80) / 9)])
    root = np.array([[0.02, 0.0], [0.01, 0.03]])
    noise = Noise(0.03**2, rho, 1e9)
    at = Linearisation(np.empty((2, 0)), np.zeros((2, 5)), np.ones(2), (root @ root.T)[None], (noise,))
    told = stated(slopes, at, 0, 1.0, 0.95)
    white = rng.standard_normal((20_000, 80))
    errors = white.copy()
    for k in range(1, 80):
        errors[:, k] = rho * errors[:, k - 1] + np.sqrt(1 - rho**2) * white[:, k]
    errors = 0.03 * errors + rng.standard_normal((20_000, 2)) @ root.T @ slopes.T
    rms = np.sqrt(np.mean(errors**2, axis=1))
    assert told.expected == pytest.approx(np.sqrt(np.mean(rms**2)), rel=0.02)
    assert np.mean(rms < told.limit) == pytest.approx(0.95, abs=0.015)
    surely = stated(slopes, at, 0, 1.0, 1.0 - prediction._REFUTES)
    assert np.mean(rms > surely.limit) < 1e-3
    np.testing.assert_array_equal(surely.half, told.half)
    np.testing.assert_allclose(np.mean(np.abs(errors) < told.half, axis=0), 0.95, atol=0.01)


@pytest.mark.slow
def test_the_estimate_and_the_command_tell_the_prediction(tmp_path: Path) -> None:
    (path := tmp_path / "held.yaml").write_text(json.dumps(problem().model_dump(mode="json", exclude_none=True)))
    arguments = ["identify", str(path), "--method", "least-squares", "--hold-out", "0.7:1"]
    (one,) = json.loads(CliRunner().invoke(main, [*arguments, "--json"]).stdout)["prediction"]
    assert (one["recording"], one["window"], one["samples"], one["inside"]) == ("recording", [0.7, 1.0], 16, True)
    assert {"marker", "quantity", "unit", "rms", "expected", "limit", "inside"} <= set(one["channels"][0])
    text = CliRunner().invoke(main, [*arguments, "--out", str(tmp_path / "page.html")]).output
    assert "held out from 0.7 s to 1 s: predicted as well as the estimate states" in " ".join(text.split())
    assert "predicted, not fitted" in text
    assert "What was held out of the fit" in (tmp_path / "page.html").read_text()


@pytest.mark.parametrize("given", ["0.7", "1:0.7", "a:b", "other=0.1:0.2", "5:6"])
def test_a_bad_window_on_the_command_line_has_status_two(tmp_path: Path, given: str) -> None:
    (path := tmp_path / "held.yaml").write_text(json.dumps(problem().model_dump(mode="json", exclude_none=True)))
    result = CliRunner().invoke(main, ["identify", str(path), "--hold-out", given])
    assert result.exit_code == 2
    assert len(result.stderr.strip().splitlines()) == 1


def test_a_motion_that_the_model_does_not_predict_refutes_it(tmp_path: Path) -> None:
    """A machine that is pushed after the fit: what was fitted is right, and yet no answer to rely on."""
    whole = fitted().measurement.first
    pushed = whole.values + np.where(whole.times > 0.8, 0.3 * (whole.times - 0.8), 0.0)[:, None]
    text = "\n".join(["t,x,y", *(",".join(map(repr, row)) for row in np.column_stack([whole.times, pushed]).tolist())])
    (tmp_path / "run.csv").write_text(text)
    recorded = problem().model_copy(update={"source": FileSource(start=0.0, hold_out=[(0.81, 1.0)])})
    found = identify(recorded, data=str(tmp_path / "run.csv"), method="least-squares")
    assert found.prediction[0].inside is False
    assert (found.verdict, found.status) == (Verdict.REJECTED, "failed")
    assert found.codes[0] == "held-out-data-refute"
    assert "mispredicted" in found.codes
    assert "a prediction is worse than the estimate states" in found.advice[-1]


@pytest.mark.slow
@pytest.mark.parametrize("noise", [None, 1e-3])
def test_right_models_predict_19_of_20_windows(noise: float | None) -> None:
    """At the start, within and at the end; of 120 windows at 95 %, 106 or fewer inside have a chance below 1 %."""
    windows = [[0.02, 0.1], [0.4, 0.5], [0.8, 1.0]]
    found = [fitted(seed, hold_out=windows, noise=noise) for seed in range(40)]
    inside = [one.inside for estimate in found for one in estimate.prediction]
    assert len(inside) == 120
    assert inside.count(True) > 106
    assert all(estimate.verdict.trusted for estimate in found)


@pytest.mark.slow
@pytest.mark.skipif(not DATA.is_dir(), reason="the recordings are not here")
@pytest.mark.parametrize(
    ("name", "file", "window"),
    [
        ("kaheman-single", "multiarm_kaheman/single_1kHz.csv.gz", (1.5, 2.0)),
        ("kaheman-double", "multiarm_kaheman/double_1kHz.csv.gz", (0.8, 1.0)),
        *(("ibm-double-pendulum", f"ibm_double_pendulum/{k}.csv.gz", (0.8, 1.0)) for k in range(5)),
    ],
)
def test_real_machines_are_predicted(name: str, file: str, window: tuple[float, float]) -> None:
    found = identify(load_problem(name), data=str(DATA / file), hold_out=[window])
    assert found.prediction[0].inside


@pytest.mark.slow
@pytest.mark.skipif(not DATA.is_dir(), reason="the recordings are not here")
@pytest.mark.parametrize("end", [2.0, 3.0, 4.0, 5.0])
def test_a_pendulum_of_adams_is_predicted(tmp_path: Path, end: float) -> None:
    """Its table is rounded to six digits: where a coordinate is small, so is its noise."""
    scene = {
        "name": "pendulum",
        "gravity": [0.0, -9.80665],
        "bodies": {"OA": {"kind": "rigid-body", "mass": 1.0, "inertia": 0.3, "centre_of_mass": [2.0, 0.0]}},
        "joints": {
            "O": {
                **{"kind": "revolute", "first": {"body": "ground", "point": [0.0, 0.0]}},
                "second": {"body": "OA", "point": [0.0, 0.0]},
            }
        },
        "markers": {"C": {"body": "OA", "point": [2.0, 0.0]}},
        "initial": {"OA": {"angle": 0.0}},
        "solver": {"duration": 5.0, "step": 1e-3, "samples": 500},
    }
    problem = {
        "name": "adams",
        "scene": str(tmp_path / "pendulum.yaml"),
        "parameters": {
            "angle": {"path": "initial.OA.angle", "lower": -1.0, "upper": 1.0, "start": 0.1},
            "inertia": {"path": "bodies.OA.inertia", "lower": 0.01, "upper": 2.0, "start": 0.3},
        },
        "channels": [
            {"marker": "C", "quantity": "x", "column": "X_Pos"},
            {"marker": "C", "quantity": "y", "column": "Z_Pos"},
        ],
        "source": {"kind": "file", "time": "Time", "start": 0.0, "duration": end, "hold_out": [end - 0.995, end]},
    }
    (tmp_path / "pendulum.yaml").write_text(json.dumps(scene))
    file = DATA / "adams_joints" / "Revolute_Case01_ADAMS_Pos.txt.gz"
    found = identify(Problem.parse(problem, "adams"), data=str(file))
    assert found.parameters["inertia"].value == pytest.approx(0.1, abs=1e-5)
    assert found.prediction[0].inside
