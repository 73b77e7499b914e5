"""`make up` and `make up-postgres`: real deployments, whatever dies meanwhile, and nothing left behind."""

from __future__ import annotations

import shutil
import tempfile
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from urllib.request import urlopen

import pytest
from background import (
    OFTEN,
    automate,
    comes_by_itself,
    comes_late,
    fails_aloud,
    goes_after_90_days,
    nights,
    slots_taken,
    until,
)
from deployed import (
    SERVICES,
    artifacts_of,
    begin,
    call,
    ended,
    kill,
    metrics,
    mlflow_run,
    parts,
    run_deployment,
    running,
)
from shoal import doctor
from shoal.identification import Measurement
from shoal_flows import jobs
from shoal_flows.jobs import Cell, Fit
from shoal_flows.left import WHY
from shoal_flows.tracking import outbox, store

WITHOUT = [word for name in SERVICES for word in ("--without", name)]
METHODS = ("least-squares", "iafsa")
STUDY = {"problem": "paper-case-1", "methods": METHODS, "seeds": [0]}
installed = pytest.mark.skipif(
    not (shutil.which("initdb") or list(Path("/usr/lib/postgresql").glob("*/bin/initdb"))),
    reason="PostgreSQL is not installed",
)


@pytest.fixture(scope="module")
def undisturbed(measurement: Measurement) -> dict[str, Fit]:
    """The study as it is computed here, by method."""
    return {method: jobs.fit(Cell("paper-case-1", method), measurement) for method in METHODS}


def check(at: Mapping[str, str]) -> None:
    """A deployment runs, shows its table, its end and its run in MLflow, and what MLflow has of it."""
    run = run_deployment(at["PREFECT"], "forward/simulate", {"scene": "single-pendulum"})
    assert run["state_type"] == "COMPLETED"
    shown = artifacts_of(at["PREFECT"], run)
    assert shown["progress"] == 100.0
    assert "| marker | x [m] | y [m] |" in shown["result"]
    tracked = mlflow_run(at, run)
    assert tracked["info"]["status"] == "FINISHED"
    assert {"key": "scene", "value": "single-pendulum"} in tracked["data"]["params"]
    files = call(f"{at['MLFLOW']}/api/2.0/mlflow/artifacts/list?run_id={tracked['info']['run_id']}")["files"]
    assert "trajectory.csv" in {file["path"] for file in files}


def begun(home: Path, at: Mapping[str, str]) -> dict[str, object]:
    """A study of which one result is kept and another is being computed."""
    run = begin(at["PREFECT"], "identify/identify", STUDY)
    until(lambda: [path for path in home.glob("results/*") if not path.name.startswith(".")], "a result is kept")
    return run


@contextmanager
def uploading(home: Path, at: Mapping[str, str], monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """What `shoal upload` does there."""
    with monkeypatch.context() as settings:
        settings.setenv("SHOAL_HOME", str(home))
        settings.setenv("MLFLOW_TRACKING_URI", at["MLFLOW"])
        yield


def check_schedules(prefect: str) -> dict[str, object]:
    """The next three nights are scheduled, as `shoal doctor` sees; a schedule makes a run, and the worker begins it.

    A night that no worker takes is late. An automation is stated that has acted in the end: on the run that `check`
    asks for, because after one of a schedule Prefect waits a quarter of an hour for an event that is never sent.
    """
    times = [night["expected_start_time"] for night in nights(prefect)]
    assert len(times) == 3
    assert all(time.endswith("T02:00:00Z") for time in times)
    seen = doctor.check_nights(f"{prefect}/api")
    assert seen.ok
    assert seen.found.startswith(f"3 scheduled, the next at {times[0]}; no worker takes it")
    automate(prefect, "compare/compare", after="forward/simulate")
    waiting = begin(prefect, "nightly/night", {})
    scheduled = comes_by_itself(prefect, "forward/simulate", {"scene": "single-pendulum"})
    comes_late(prefect, waiting)
    return scheduled


def check_afterwards(home: Path, at: Mapping[str, str], scheduled: dict[str, object], study: dict[str, object]) -> None:
    """The scheduled run has ended well, whatever died meanwhile, and the automation has acted; old runs are removed."""
    assert ended(at["PREFECT"], scheduled)["state_type"] == "COMPLETED"
    compare = f"{at['PREFECT']}/api/deployments/name/compare/compare"
    until(lambda: call(compare)["paused"], "the automation has paused a deployment")
    goes_after_90_days(at, home, old=scheduled, young=study)


def check_study(at: Mapping[str, str], run: dict[str, object], undisturbed: Mapping[str, Fit]) -> None:
    """The study has come to its end, and MLflow has the figures of an undisturbed one, to the last bit."""
    assert ended(at["PREFECT"], run)["state_type"] == "COMPLETED"
    study = mlflow_run(at, run)
    assert study["info"]["status"] == "FINISHED"
    found = {next(p["value"] for p in one["data"]["params"] if p["key"] == "method"): one for one in parts(at, study)}
    assert set(found) == set(METHODS)
    for method, fit in undisturbed.items():
        assert found[method]["info"]["status"] == "FINISHED"
        figures = metrics(found[method])
        assert figures["final/fitness"] == fit.estimate.fitness
        assert figures["final/evaluations"] == fit.estimate.evaluations
        for name, value in fit.estimate.parameters.items():
            assert figures[f"final/{name}"] == value.value


@pytest.mark.slow
def test_a_study_outlives_prefects_server(tmp_path: Path, undisturbed: Mapping[str, Fit]) -> None:
    """On SQLite; kill -9 in the middle: it is started again, and the worker's flow goes on as if it had been slow."""
    with running(tmp_path, *WITHOUT, settings=OFTEN) as at:
        scheduled = check_schedules(at["PREFECT"])
        check(at)
        # Readable without the server as well, by `shoal ui` and `shoal rerun`.
        assert list((tmp_path / "artifacts").rglob("trajectory.csv"))
        run = begun(tmp_path, at)
        assert kill(tmp_path, "shoal_flows.prefect_server") >= 1
        check_study(at, run, undisturbed)
        assert "prefect ended by itself: it is started again" in (tmp_path / "up.log").read_text()
        check_afterwards(tmp_path, at, scheduled, run)
        fails_aloud(tmp_path)


@pytest.mark.slow
def test_nights_that_nobody_ran_are_not_made_up_for(tmp_path: Path) -> None:
    """Thirty wait for the worker: one runs, the others are cancelled at once."""
    short = {"only": "four-bar-2", "quick": True}
    with running(tmp_path, "--with", "nightly", *WITHOUT) as at:
        waiting = [begin(at["PREFECT"], "nightly/night", short) for _ in range(30)]
        states = Counter(ended(at["PREFECT"], run)["state_type"] for run in waiting)
    assert states == {"COMPLETED": 1, "CANCELLED": 29}
    assert len(list((tmp_path / "validation").glob("night-*.json"))) == 1


@pytest.mark.slow
def test_a_night_that_was_broken_off_does_not_block_the_next(tmp_path: Path) -> None:
    """Killed together with the server, or stopped with everything: its slot is free after two minutes."""
    short = {"only": "four-bar-2", "quick": True}

    def holds_the_slot(prefect: str) -> None:
        night = begin(prefect, "nightly/night", {})
        until(lambda: call(f"{prefect}/api/flow_runs/{night['id']}")["state_type"] == "RUNNING", "the night runs")
        assert slots_taken(prefect) == 1

    with running(tmp_path, "--with", "nightly", *WITHOUT, settings=OFTEN) as at:
        holds_the_slot(at["PREFECT"])
        assert kill(tmp_path, "shoal_flows.prefect_server") >= 1
        assert kill(tmp_path, "prefect.engine") >= 1
        until(lambda: slots_taken(at["PREFECT"]) == 0, "the slot is free")
        assert run_deployment(at["PREFECT"], "nightly/night", short)["state_type"] == "COMPLETED"
        holds_the_slot(at["PREFECT"])
    with running(tmp_path, "--with", "nightly", *WITHOUT, settings=OFTEN) as at:
        until(lambda: slots_taken(at["PREFECT"]) == 0, "the slot is free")
        night = comes_by_itself(at["PREFECT"], "nightly/night", short)
        assert ended(at["PREFECT"], night)["state_type"] == "COMPLETED"
    assert len(list((tmp_path / "validation").glob("night-*.json"))) == 2


def unended(at: Mapping[str, str]) -> tuple[list[str], list[str]]:
    """The runs that stand as running, in MLflow and in Prefect."""
    asked = {"experiment_ids": ["1", "2", "3"], "filter": "attributes.status = 'RUNNING'"}
    tracked = call(f"{at['MLFLOW']}/api/2.0/mlflow/runs/search", asked).get("runs", [])
    begun = call(f"{at['PREFECT']}/api/flow_runs/filter", {"flow_runs": {"state": {"type": {"any_": ["RUNNING"]}}}})
    return [one["info"]["run_id"] for one in tracked], [one["id"] for one in begun]


@pytest.mark.slow
def test_no_run_stands_as_running_that_nobody_runs(tmp_path: Path) -> None:
    """After a stop, which flows are told of, and after kill -9 of everything, which leaves it to the next start."""
    long = {**STUDY, "methods": ["iafsa"], "seeds": list(range(12))}

    def begins(at: Mapping[str, str]) -> tuple[dict[str, object], str]:
        run = begin(at["PREFECT"], "identify/identify", long)
        until(lambda: unended(at)[0], "the study is in MLflow")
        tracked, begun = unended(at)
        assert begun == [run["id"]]
        return run, tracked[0]

    def ends(at: Mapping[str, str], run: dict[str, object], tracked: str) -> tuple[str, dict[str, str]]:
        """What Prefect says of its end, and the tags in MLflow."""
        assert unended(at) == ([], [])
        state = call(f"{at['PREFECT']}/api/flow_runs/{run['id']}")["state"]
        found = call(f"{at['MLFLOW']}/api/2.0/mlflow/runs/get?run_id={tracked}")["run"]
        assert (state["type"], found["info"]["status"]) == ("CRASHED", "KILLED")
        return state["message"], {tag["key"]: tag["value"] for tag in found["data"]["tags"]}

    with running(tmp_path, *WITHOUT) as at:
        stopped = begins(at)
    assert not list((tmp_path / "running").glob("mlflow-*"))
    with running(tmp_path, *WITHOUT) as at:
        said, tags = ends(at, *stopped)
        # On a busy machine the flow may have had no time to tell Prefect, and the next start has.
        assert said in ("Execution was aborted by a termination signal.", WHY)
        assert "broken_off" not in tags
        killed = begins(at)
        kill(tmp_path, "shoal_flows.deployment.worker")
        kill(tmp_path, "prefect", "worker")
        assert kill(tmp_path, "prefect.engine") == 1
        until(lambda: unended(at) == ([], []), "the next worker has ended what was left")
        said, tags = ends(at, *killed)
        assert said == tags["broken_off"] == WHY


@pytest.mark.slow
@installed
def test_a_study_outlives_postgresql(undisturbed: Mapping[str, Fit], monkeypatch: pytest.MonkeyPatch) -> None:
    """kill -9 of all its processes in the middle: it is started again, and Prefect and MLflow find it."""
    # Not below pytest's own folder, which keeps out the user that the database runs as.
    with tempfile.TemporaryDirectory() as name:
        home = Path(name)
        home.chmod(0o755)
        with running(home, "--postgres", *WITHOUT, settings=OFTEN) as at:
            scheduled = check_schedules(at["PREFECT"])
            check(at)
            run = begun(home, at)
            assert kill(home, "postgres") >= 1
            assert ended(at["PREFECT"], run)["state_type"] == "COMPLETED"
            assert "postgres ended by itself: it is started again" in (home / "up.log").read_text()
            # What MLflow could not be told of in between.
            with uploading(home, at, monkeypatch):
                store.upload()
                assert outbox.pending() == []
            check_study(at, run, undisturbed)
            check_afterwards(home, at, scheduled, run)
        assert not (home / "mlflow.db").exists()
        assert not (home / "prefect" / "prefect.db").exists()


@pytest.mark.slow
@installed
def test_everything_starts_again_on_what_is_there() -> None:
    """With the engines' services, twice."""
    with tempfile.TemporaryDirectory() as name:
        home = Path(name)
        home.chmod(0o755)
        for _ in range(2):
            with running(home, "--postgres") as at:
                assert all(urlopen(f"{at[name.upper()]}/ready", timeout=60).status == 200 for name in SERVICES)
                check(at)
