"""What was identified is a model of MLflow that computes Shoal's numbers; one in doubt is no champion."""

from __future__ import annotations

import json
import re
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from shoal.cli import main
from shoal.errors import InputError
from shoal.identification import identify, load_problem
from shoal.identification.findings import MISFIT, SEVERAL_MINIMA
from shoal.scene import load_scene
from shoal.scene.load import scene_names
from shoal_flows import jobs, workers
from shoal_flows.jobs import Cell, Fit
from shoal_flows.tracking import outbox, store
from shoal_flows.tracking.identification import open_study
from shoal_flows.tracking.model import files, validation
from shoal_flows.tracking.model.register import confirmed, register
from shoal_validation.nightly import history
from shoal_validation.nightly.result import Night, Result
from shoal_validation.nightly.result import Verdict as Line
from shoal_validation.nightly.run import machine

TWO_RUNS = """
name: two runs
scene: single-pendulum
parameters:
  angle: {path: initial.OA.angle, lower: -1.5, upper: 1.5, own: true}
  inertia: {path: bodies.OA.inertia, lower: 0.01, upper: 1.0}
channels:
  - {marker: A, quantity: x}
  - {marker: A, quantity: angle, noise: 0.01}
noise: 0.02
recordings:
  slow: {kind: engine, engine: casadi, stop: 0.8, count: 40, clock: 1.25,
         values: {initial.OA.angle: 0.3, bodies.OA.inertia: 0.1}}
  fast: {kind: engine, engine: casadi, stop: 0.5, count: 40, known: {initial.OA.rate: -2.0}, scale: 0.5,
         values: {bodies.OA.inertia: 0.1}}
"""


@pytest.fixture(autouse=True)
def here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Computations in this process: to start others takes longer than all tests."""
    monkeypatch.setattr(workers, "run", lambda function, *arguments: function(*arguments))


@pytest.fixture(autouse=True)
def no_nights(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """As on a machine on which no night has run."""
    folder = tmp_path / "nights"
    folder.mkdir()
    monkeypatch.setattr(history, "folder", lambda: folder)
    return folder


@pytest.fixture(scope="module")
def two_runs(tmp_path_factory: pytest.TempPathFactory) -> Fit:
    """Two recordings with angles and a scale of their own."""
    file = tmp_path_factory.mktemp("problem") / "two.yaml"
    file.write_text(TWO_RUNS)
    return jobs.fit(Cell(str(file), "least-squares"), jobs.measured(str(file)))


def registered(fit: Fit, name: str) -> Any:
    """The version of the model of a study of one fit, under a problem's name of its own."""
    fit = named(fit, name)
    with open_study("a study", [fit.cell], fit.estimate.measurement) as study:
        register(study, [fit])
    (version,) = store.connect().search_model_versions(f"run_id = '{outbox.address(study.run_id)}'")
    return store.connect().get_model_version(version.name, version.version)


def named(fit: Fit, name: str) -> Fit:
    return replace(fit, estimate=replace(fit.estimate, problem=name))


def written(documents: dict[str, str], folder: Path) -> Path:
    for path, text in documents.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text)
    return folder


@pytest.mark.slow
def test_champion_computes_what_shoal_simulates(fits: list[Fit], tmp_path: Path) -> None:
    from mlflow import pyfunc

    version = registered(fits[0], "bit for bit")
    assert version.aliases == ["champion"]
    assert version.tags["verdict"] == "identified"
    assert float(version.tags["parameter.theta1"]) == fits[0].estimate.parameters["theta1"].value
    model = pyfunc.load_model("models:/bit for bit@champion")
    found = model.predict(pd.DataFrame({"t [s]": [0.5, 0.1, 0.37, 0.1]}))
    scene = written(files.documents(fits[0]), tmp_path) / "scenes" / "recording.yaml"
    done = CliRunner().invoke(main, ["simulate", str(scene), "--at", "0.1,0.37,0.5", "--json"])
    assert done.exit_code == 0, done.stderr
    for marker, motion in json.loads(done.stdout)["markers"].items():
        for part, unit in (("x", "m"), ("y", "m"), ("angle", "rad")):
            at = dict(zip(motion["t"], motion[part], strict=True))
            assert found[f"{marker}.{part} [{unit}]"].tolist() == [at[0.5], at[0.1], at[0.37], at[0.1]]
    assert [column.name for column in model.metadata.signature.inputs] == ["t [s]"]
    assert [column.name for column in model.metadata.signature.outputs] == list(found)
    assert model.input_example["t [s]"].iloc[-1] == 0.5


def test_page_of_the_documentation_loads_the_champion(fits: list[Fit], capsys: pytest.CaptureFixture[str]) -> None:
    assert registered(fits[0], "paper-case-1").aliases == ["champion"]
    page = (Path(__file__).parents[2] / "docs" / "dashboard.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"^```python[^\n]*\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    exec(compile(code, "dashboard.md", "exec"), {})
    assert "B.x [m]" in capsys.readouterr().out


def test_model_of_several_recordings_computes_each(two_runs: Fit, tmp_path: Path) -> None:
    from mlflow import pyfunc

    folder = tmp_path / "model"
    for path, content in files.packed(two_runs).items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_bytes(content)
    model, times = pyfunc.load_model(str(folder)), pd.DataFrame({"t [s]": two_runs.motions["fast"].times})
    assert np.array_equal(
        model.predict(times, params={"recording": "fast"})["A.x [m]"], two_runs.motions["fast"].marker("A")[:, 0]
    )
    assert not np.allclose(model.predict(times)["A.x [m]"], two_runs.motions["fast"].marker("A")[:, 0])
    with pytest.raises(InputError, match="recording: no 'none'; there are fast, slow"):
        model.predict(times, params={"recording": "none"})


def test_files_of_a_model_repeat_the_identification(fits: list[Fit], two_runs: Fit, tmp_path: Path) -> None:
    for number, fit in enumerate((fits[0], two_runs)):
        folder = written(files.documents(fit), tmp_path / str(number))
        again = identify(load_problem(str(folder / "problem.yaml")), method="least-squares")
        assert again.verdict == fit.estimate.verdict
        for name, value in fit.estimate.parameters.items():
            assert again.parameters[name].value == pytest.approx(value.value, rel=1e-6)
            assert again.parameters[name].std == pytest.approx(value.std, rel=1e-4)


@pytest.mark.parametrize("name", scene_names())
def test_scene_comes_back_from_its_text_as_it_was(name: str, tmp_path: Path) -> None:
    scene = load_scene(name)
    (tmp_path / "scene.yaml").write_text(files.as_yaml(scene.model_dump(mode="json")))
    assert load_scene(str(tmp_path / "scene.yaml")).fingerprint == scene.fingerprint


def test_second_engine_confirms_only_within_the_noise(fits: list[Fit], two_runs: Fit) -> None:
    assert confirmed(fits[0]).ok
    assert confirmed(two_runs).ok
    # Our solver wrong by a millimetre where the fit leaves a hundredth of that.
    (recording,) = fits[0].estimate.measurement.recordings.values()
    exact = replace(
        fits[0].estimate.measurement, recordings={"recording": replace(recording, values=_shifted(fits[0]))}
    )
    off = replace(
        fits[0], estimate=replace(fits[0].estimate, measurement=exact, predicted={"recording": _shifted(fits[0])})
    )
    found = confirmed(off)
    assert not found.ok
    assert found.away == pytest.approx(1e-3, rel=0.01)
    assert "exudyn does not confirm the motion: B.x differs by 1.0e-03 m" in str(found)
    # The same motion, but a noise is stated that is smaller than what lies between the engines.
    quiet = replace(recording, noise=np.full(2, 1e-9))
    stated = replace(fits[0].estimate.measurement, recordings={"recording": quiet})
    assert not confirmed(replace(fits[0], estimate=replace(fits[0].estimate, measurement=stated))).ok


def _shifted(fit: Fit) -> Any:
    return fit.estimate.predicted["recording"] + np.array([1e-3, 0.0])


@pytest.mark.slow
def test_champion_stays_where_validation_fails_and_the_tag_says_why(fits: list[Fit], no_nights: Path) -> None:
    assert registered(fits[0], "guarded").aliases == ["champion"]
    rejected = replace(fits[0], estimate=replace(fits[0].estimate, findings=[MISFIT.found("the best fit is off")]))
    second = registered(rejected, "guarded")
    assert second.aliases == []
    assert second.tags["champion"] == "stayed; the identification ended with: model rejected"
    line = Result("four-bar", "gauss", "auto", "within 1 mm", "5 mm", 5e-3, 1e-3, "m", 0.1, "ok", Line.FAILED, "")
    night = Night("2026-01-02T02:00:00", machine(), {}, quick=False, only=None, wall_s=1.0, lines=(line,))
    history.save(night, no_nights)
    third = registered(fits[0], "guarded")
    assert third.aliases == []
    assert "night of 2026-01-02T02:00:00" in third.tags["champion"]
    assert "four-bar, gauss, auto: failed; expected within 1 mm; found 5 mm" in third.tags["champion"]
    # One problem alone is no night.
    history.save(replace(night, started="2026-01-03T02:00:00", only="four-bar", lines=()), no_nights)
    assert validation.doubts(fits[0].estimate, confirmed(fits[0]))
    slower = replace(line, verdict=Line.SLOWER)
    history.save(replace(night, started="2026-01-04T02:00:00", lines=(slower,)), no_nights)
    assert registered(fits[0], "guarded").aliases == ["champion"]
    assert int(store.connect().get_registered_model("guarded").aliases["champion"]) == 4


def test_best_that_is_trusted_is_taken(fits: list[Fit]) -> None:
    good, better = fits
    better = replace(
        better,
        estimate=replace(
            better.estimate, fitness=0.0, findings=[SEVERAL_MINIMA.found("2 parameter sets fit equally well")]
        ),
    )
    with open_study("a study", [good.cell], good.estimate.measurement) as study:
        register(study, [better, good])
    assert study.registration
    assert study.registration.tags["fit"] == good.cell.name
    assert study.registration.doubts == []


def test_registration_costs_little(fits: list[Fit]) -> None:
    begin = time.process_time()
    files.packed(fits[0])
    confirmed(fits[0])
    assert time.process_time() - begin < 10.0


def test_model_waits_with_its_study_and_an_earlier_one_takes_nothing_away(
    fits: list[Fit], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SHOAL_HOME", str(tmp_path))
    with monkeypatch.context() as silent:
        silent.setenv("MLFLOW_HTTP_REQUEST_MAX_RETRIES", "0")
        silent.setenv("MLFLOW_TRACKING_URI", "http://127.0.0.1:9")  # Nobody answers there.
        with open_study("early", [fits[0].cell], fits[0].estimate.measurement) as early:
            register(early, [named(fits[0], "waiting")])
    assert len(outbox.pending()) == 1
    with monkeypatch.context() as elsewhere:
        elsewhere.setattr(store, "upload", lambda: 0)  # A study of another machine, which has no outbox.
        assert registered(fits[1], "waiting").aliases == ["champion"]
    assert store.upload() == 1
    client = store.connect()
    (version,) = client.search_model_versions(f"run_id = '{outbox.address(early.run_id)}'")
    assert version.tags["champion"] == "stayed; version 1 is of a later study"
    assert int(client.get_registered_model("waiting").aliases["champion"]) == 1
