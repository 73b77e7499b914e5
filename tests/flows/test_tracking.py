from __future__ import annotations

import csv
import json
import math
from dataclasses import replace
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

import pytest
from shoal.engines.compare import Comparison
from shoal.engines.sweep import Sweep
from shoal.errors import InputError
from shoal.identification import Measurement
from shoal.identification.recording.reading import read
from shoal.identification.recording.source import Channel, FileSource
from shoal.mechanics.findings import OUT_OF_REACH
from shoal.pictures.signals import signals
from shoal.trajectory import Status, Trajectory
from shoal_flows import pictures
from shoal_flows.jobs import Cell, Fit
from shoal_flows.report.stored import stored
from shoal_flows.tracking import addresses, store
from shoal_flows.tracking.data import of_measurement, whole
from shoal_flows.tracking.engines import log_comparison, log_forward, log_sweep
from shoal_flows.tracking.identification import log_fit, log_outcome, open_study, rounded
from shoal_flows.tracking.store import connect


@pytest.fixture(scope="module")
def client() -> Any:
    return connect()


def names(client: Any, run_id: str) -> set[str]:
    return {artifact.path for artifact in client.list_artifacts(run_id)}


def children(client: Any, run_id: str) -> list[Any]:
    run = client.get_run(run_id)
    return list(client.search_runs([run.info.experiment_id], f"tags.`mlflow.parentRunId` = '{run_id}'"))


@pytest.mark.slow
def test_study_is_logged_with_a_child_per_fit(client: Any, fits: list[Fit], tmp_path: Path) -> None:
    albums = [pictures.album(fit) for fit in fits]
    some = next(iter(albums[0].pictures.values()))
    with open_study("a study", [fit.cell for fit in fits], fits[0].estimate.measurement) as study:
        for fit, album in zip(fits, albums, strict=True):
            log_fit(fit, album, study.run_id)
        log_outcome(study, fits, {"other": "went wrong"}, {"some.png": some})
    parent = client.get_run(study.run_id)
    assert parent.info.status == "FINISHED"
    assert parent.data.metrics["study/trusted"] == 2
    assert parent.data.metrics["study/failed"] == 1
    assert parent.data.tags["version.numpy"]
    assert parent.data.tags["platform"]
    assert names(client, study.run_id) == {"some.png", "summary.md"}

    estimate = fits[0].estimate
    (child,) = (run for run in children(client, study.run_id) if run.data.params["seed"] == "0")
    assert child.data.params["method"] == "least-squares"
    assert child.data.params["mesh"] == "OA: 4, AB: 8"
    assert child.data.params["scene.fingerprint"] == estimate.scene.fingerprint
    assert child.data.metrics["final/fitness"] == estimate.fitness
    assert child.data.metrics["final/evaluations"] == 18
    error = estimate.parameters["theta1"].value - estimate.truth["theta1"]
    assert child.data.metrics["error/theta1"] == pytest.approx(error)
    assert child.data.metrics["interval/theta1/lower"] < estimate.truth["theta1"]
    drawn = set(albums[0].pictures)
    assert {"overlay.png", "residuals.png", "landscape.png", "correlations.png", "motion.gif"} <= drawn
    assert sum(map(len, albums[0].pictures.values())) + len(albums[0].page) < 2e6
    assert child.data.metrics["rms/recording/B.x"] == signals(estimate)[0].rms
    assert names(client, child.info.run_id) == {"trajectory.csv", "estimate.json", "report.html", *drawn}
    again = stored(study.run_id)
    assert set(again) == {fit.cell.name for fit in fits}
    assert again[fits[0].cell.name].estimate.parameters == estimate.parameters
    assert list(stored(child.info.run_id)) == [fits[0].cell.name]
    best = client.get_metric_history(child.info.run_id, "fitness/best")
    logarithms = client.get_metric_history(child.info.run_id, "fitness/best log10")
    assert [10**m.value for m in logarithms] == pytest.approx([m.value for m in best])
    assert [metric.value for metric in best] == [row[1] for row in estimate.iterations]
    tip = client.get_metric_history(child.info.run_id, "tip/x")
    assert len(tip) == 300
    assert tip[-1].step == 500
    file = client.download_artifacts(child.info.run_id, "trajectory.csv", str(tmp_path))
    with Path(file).open() as lines:
        rows = list(csv.DictReader(lines))
    assert float(rows[-1]["B.x"]) == fits[0].motion.marker("B")[-1, 0]


def test_a_run_that_holds_no_identification_is_one_line(client: Any, sweep: Sweep) -> None:
    with pytest.raises(InputError, match="neither a file nor the id of a run"):
        stored("nothing")
    with pytest.raises(InputError, match="holds no identification"):
        stored(log_sweep(sweep))


def test_failed_block_leaves_a_failed_run(client: Any, fits: list[Fit]) -> None:
    with (
        pytest.raises(RuntimeError),
        open_study("broken", [Cell("paper-case-1", "afsa")], fits[0].estimate.measurement) as study,
    ):
        raise RuntimeError
    assert client.get_run(study.run_id).info.status == "FAILED"


def test_comparison_and_sweep_are_logged(client: Any, comparison: Comparison, sweep: Sweep) -> None:
    run_id = log_comparison(comparison, b"\x89PNG")
    metrics = client.get_run(run_id).data.metrics
    assert metrics["difference/gauss-casadi/B/largest"] == pytest.approx(2.1e-5, rel=0.1)
    assert {run.data.params["engine"] for run in children(client, run_id)} == {"gauss", "exudyn", "casadi"}
    swept = log_sweep(sweep)
    assert names(client, swept) == {"scene.yaml", "sweep.csv", "displacement-A.png", "displacement-B.png"}
    assert client.get_run(swept).data.metrics["final/failed_points"] == 0


def rejected(motion: Trajectory) -> Trajectory:
    return replace(motion, lane_findings=[[OUT_OF_REACH.found("a marker is 31 m away")]])


def test_what_is_rejected_says_so_and_tells_no_places(client: Any, comparison: Comparison, sweep: Sweep) -> None:
    """Of a motion, of the engines of a comparison and of a sweep alike: the verdict as a tag, the reason in words."""
    wrong = {name: rejected(motion) for name, motion in comparison.trajectories.items()}
    of_motion = log_forward(comparison.scene, wrong["gauss"], {})
    compared = log_comparison(replace(comparison, trajectories={**comparison.trajectories, "exudyn": wrong["exudyn"]}))
    of_engines = {run.data.params["engine"]: run.info.run_id for run in children(client, compared)}
    swept = log_sweep(replace(sweep, status=(Status.OUT_OF_REACH, *sweep.status[1:])))
    verdicts = {of_motion: "out-of-reach", of_engines["exudyn"]: "out-of-reach", compared: "failed", swept: "failed"}
    for run_id, verdict in verdicts.items():
        tags = client.get_run(run_id).data.tags
        assert tags["verdict"] == verdict
        assert tags["mlflow.note.content"].startswith("**Not to be trusted:** ")
        assert ("31 m away" if run_id != swept else "1 of 5 points: out-of-reach") in tags["mlflow.note.content"]
    for run_id in (of_motion, of_engines["exudyn"]):
        assert not [name for name in client.get_run(run_id).data.metrics if name.endswith(("/x", "/y"))]
        assert "trajectory-rejected.csv" in names(client, run_id)
    sound = client.get_run(of_engines["gauss"]).data
    assert (sound.tags["verdict"], "final/B/x" in sound.metrics) == ("ok", True)


def test_every_marker_has_its_place_and_the_tip_its_name(client: Any, comparison: Comparison) -> None:
    """`tip/x` and `final/x` are those of the marker that is called so, wherever it stands, else of the last."""
    motion = comparison.trajectories["gauss"]
    called = replace(motion, markers=("tip", *motion.markers[1:]))
    for one, shown in ((motion, motion.markers[-1]), (called, "tip")):
        run_id = log_forward(comparison.scene, one, {})
        run = client.get_run(run_id).data
        for name in one.markers:
            assert [run.metrics[f"final/{name}/{axis}"] for axis in "xy"] == one.marker(name)[-1].tolist()
        assert run.params["tip"] == shown
        assert run.metrics["final/x"] == run.metrics[f"final/{shown}/x"] == one.marker(shown)[-1, 0]
        assert client.get_metric_history(run_id, "tip/x")[-1].value == one.marker(shown)[-1, 0]


def test_what_is_refused_before_it_is_computed_is_a_failed_run(client: Any) -> None:
    with (
        pytest.raises(InputError, match="too long"),
        store.or_failed("Forward", "a machine · gauss", {"kind": "forward"}),
    ):
        raise InputError("solver.step: 1 s is too long")
    experiment = client.get_experiment_by_name("Forward").experiment_id
    (latest,) = client.search_runs([experiment], "attributes.run_name = 'a machine · gauss'")
    assert (latest.info.status, latest.data.tags["verdict"]) == ("FAILED", "refused")
    assert latest.data.tags["mlflow.note.content"] == "**No answer:** solver.step: 1 s is too long"


def test_experiments_explain_themselves(client: Any, fits: list[Fit]) -> None:
    with open_study("any", [fits[0].cell], fits[0].estimate.measurement) as study:
        log_fit(fits[0], pictures.Album({}, "", {}), study.run_id)
    experiment = client.get_experiment_by_name("Identification")
    assert experiment is not None
    assert "a child per method" in experiment.tags["mlflow.note.content"]
    assert experiment.artifact_location.endswith("/artifacts/identification")
    # As MLflow's pages read a saved view: its state is a text in the text.
    view = json.loads(experiment.tags["mlflow.sharedViewState.best-today"])
    assert view["name"] == "Fits of the last 24 hours, best first"
    state = json.loads(view["state"])
    assert state["orderByKey"] == "metrics.`final/fitness`"
    found = client.search_runs([experiment.experiment_id], state["searchFilter"], order_by=[state["orderByKey"]])
    logged = {f"metrics.`{name}`" for run in found for name in run.data.metrics}
    logged |= {f"params.`{name}`" for run in found for name in run.data.params}
    logged |= {f"tags.`{name}`" for run in found for name in run.data.tags}
    assert set(state["selectedColumns"]) <= logged
    assert [section["name"] for section in state["compareRunSections"]] == ["fitness", "tip"]
    assert {chart["metricSectionId"] for chart in state["compareRunCharts"]} == {"shoal-fitness", "shoal-tip"}


@pytest.mark.parametrize(
    ("value", "half", "text"),
    [
        (0.786012, 0.002983, "0.7860 ± 0.0030"),
        (7.0123e10, 1.2e9, "7.01e+10 ± 1.2e+09"),
        (58.95, 0.3, "58.95 ± 0.30"),
        (1234.6, 50.0, "1235 ± 50"),
        (2.1e-9, 1e-10, "2.10e-09 ± 1.0e-10"),
        (0.123456, math.inf, "0.123 (open)"),
    ],
)
def test_figures_of_a_column_have_two_digits_of_their_interval(value: float, half: float, text: str) -> None:
    assert rounded(value, value - half, value + half) == text


def test_an_older_experiment_gets_the_views(client: Any) -> None:
    experiment = client.get_experiment_by_name("Identification")
    client.set_experiment_tag(experiment.experiment_id, "mlflow.sharedViewState.best", "old")
    store.experiment(client, "Identification")
    assert json.loads(client.get_experiment(experiment.experiment_id).tags["mlflow.sharedViewState.best"])


def test_a_fit_lasts_as_long_as_its_optimisation(client: Any) -> None:
    with store.open_run("Forward", "slow", took=60.0) as run:
        pass
    info = client.get_run(run.run_id).info
    assert 60_000 <= info.end_time - info.start_time < 90_000


@pytest.mark.usefixtures("client")
def test_pages_are_told_to_open_on_runs_and_metrics() -> None:
    """Before the program of the page begins, which reads it; `mlflow server --app-name shoal` finds it."""
    from shoal_flows.tracking.dashboard import pages

    browser = pages.test_client()
    with browser.get("/") as answer:
        page = answer.text
    assert page.index("mlflow.workflowType_v1") < page.index("static-files/static/js/main")
    assert "mlflow.workflowType_v1" not in browser.get("/version").text
    assert entry_points(group="mlflow.app")["shoal"].value == "shoal_flows.tracking.dashboard:app"


def test_parts_of_a_file_are_the_same_recording(tmp_path: Path) -> None:
    """Whatever is fitted of it: a study of another window of the same file is no new evidence of a drift."""
    text = "t,x,y\n" + "".join(f"{k},{k**2},{-k}\n" for k in range(9))
    for name, content in (("run.csv", text), ("other.csv", text.replace("16", "17"))):
        (tmp_path / name).write_text(content)
    x, y = (Channel.model_validate({"marker": "B", "quantity": axis, "column": axis}) for axis in "xy")
    asked = [
        ({"path": "run.csv"}, (x, y)),
        ({"path": "run.csv", "duration": 5.0}, (x, y)),
        ({"path": "run.csv", "hold_out": [[2, 3]]}, (x, y)),
        ({"path": "run.csv"}, (x,)),
        ({"path": "other.csv"}, (x, y)),
    ]
    told = []
    for fields, channels in asked:
        source = FileSource.model_validate({**fields, "path": str(tmp_path / fields["path"])})
        told += of_measurement(Measurement({"recording": read(source, channels)}))
    assert len({one.digest for one in told}) == len(asked)
    *parts, other = [whole(one.digest, one.source) for one in told]
    assert len(set(parts)) == 1
    assert other not in parts


def test_a_recording_is_a_data_set_by_which_runs_group(client: Any, fits: list[Fit]) -> None:
    measurement = fits[0].estimate.measurement
    halved = measurement.changed(lambda recording: recording.every(2))
    found = []
    for data in (measurement, measurement, halved):
        with open_study("data", [fits[0].cell], data) as study:
            pass
        (one,) = client.get_run(study.run_id).inputs.dataset_inputs
        found.append(one.dataset)
    first, again, other = found
    assert first.name == "exudyn"
    assert first.digest == again.digest != other.digest
    # Fitted without a part of its samples it is another data set of the same recording.
    (part,) = of_measurement(measurement.changed(lambda recording: recording.holding([(0.1, 0.2)])))
    assert part.digest != first.digest
    assert whole(part.digest, part.source) == whole(first.digest, first.source) == first.digest
    columns = [column["name"] for column in json.loads(first.schema)["mlflow_colspec"]]
    assert columns == ["t", "B.x", "B.y"]
    assert json.loads(first.profile)["num_rows"] == len(measurement.first.times)
    experiment = client.get_experiment_by_name("Identification").experiment_id
    runs = client.search_runs([experiment], f"dataset.digest = '{other.digest}'")
    assert [run.info.run_id for run in runs] == [study.run_id]


def test_the_pages_of_a_run_and_of_all_studies_are_named(
    client: Any, fits: list[Fit], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("SHOAL_MLFLOW_URL", raising=False)
    with open_study("latest", [fits[0].cell], fits[0].estimate.measurement) as study:
        pass
    experiment = client.get_run(study.run_id).info.experiment_id
    page = f"http://here/#/experiments/{experiment}/runs/{study.run_id}"
    table = f"http://here/#/experiments/{experiment}/runs?viewStateShareKey=studies"
    assert addresses.run_address(study.run_id) is None
    assert addresses.run_address(study.run_id, "http://here/") == page
    assert addresses.table_address(study.run_id, "http://here") == table
    assert addresses.latest_study("http://here") == (page, table)
    assert "mlflow.sharedViewState.studies" in client.get_experiment(experiment).tags
