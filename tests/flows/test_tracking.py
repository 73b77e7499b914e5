from __future__ import annotations

import csv
import json
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

import pytest
from shoal.engines.compare import Comparison
from shoal.engines.sweep import Sweep
from shoal.errors import InputError
from shoal.pictures.signals import signals
from shoal_flows import pictures
from shoal_flows.jobs import Cell, Fit
from shoal_flows.report.stored import stored
from shoal_flows.tracking import addresses, store
from shoal_flows.tracking.engines import log_comparison, log_sweep
from shoal_flows.tracking.identification import log_fit, log_outcome, open_study
from shoal_flows.tracking.store import connect


@pytest.fixture(scope="module")
def client() -> Any:
    return connect()


def names(client: Any, run_id: str) -> set[str]:
    return {artifact.path for artifact in client.list_artifacts(run_id)}


def children(client: Any, run_id: str) -> list[Any]:
    run = client.get_run(run_id)
    return list(client.search_runs([run.info.experiment_id], f"tags.`mlflow.parentRunId` = '{run_id}'"))


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


def test_experiments_explain_themselves(client: Any, fits: list[Fit]) -> None:
    with open_study("any", [fits[0].cell], fits[0].estimate.measurement):
        pass
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
    logged |= {f"params.`{name}`" for run in found for name in run.data.params} | {"tags.`verdict`"}
    assert set(state["selectedColumns"]) <= logged


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
