"""`make up` and `make up-postgres`: real deployments, whatever dies meanwhile, and nothing left behind."""

from __future__ import annotations

import shutil
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from urllib.request import urlopen

import pytest
from shoal.identification import Measurement
from shoal_flows import jobs
from shoal_flows.jobs import Cell, Fit
from shoal_flows.tracking import outbox, store

sys.path.insert(0, str(Path(__file__).parent))

from deployed import (
    PATIENCE,
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
    run = run_deployment(at["PREFECT"], "forward/forward", {"scene": "single-pendulum"})
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
    deadline = time.monotonic() + PATIENCE
    while not [path for path in home.glob("results/*") if not path.name.startswith(".")]:
        assert time.monotonic() < deadline
        time.sleep(0.05)
    return run


@contextmanager
def uploading(home: Path, at: Mapping[str, str], monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """What `shoal upload` does there."""
    caches = (store.connect, store._experiment)
    with monkeypatch.context() as settings, ExitStack() as after:
        settings.setenv("SHOAL_HOME", str(home))
        settings.setenv("MLFLOW_TRACKING_URI", at["MLFLOW"])
        for cached in caches:
            cached.cache_clear()
            after.callback(cached.cache_clear)
        yield


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


def test_a_study_outlives_prefects_server(tmp_path: Path, undisturbed: Mapping[str, Fit]) -> None:
    """On SQLite; kill -9 in the middle: it is started again, and the worker's flow goes on as if it had been slow."""
    with running(tmp_path, *WITHOUT) as at:
        check(at)
        # Readable without the server as well, by `shoal ui` and `shoal rerun`.
        assert list((tmp_path / "artifacts").rglob("trajectory.csv"))
        run = begun(tmp_path, at)
        assert kill(tmp_path, "prefect", "server", "start") >= 1
        check_study(at, run, undisturbed)
        assert "prefect ended by itself: it is started again" in (tmp_path / "up.log").read_text()


@pytest.mark.slow
def test_nights_that_nobody_ran_are_not_made_up_for(tmp_path: Path) -> None:
    """Thirty wait for the worker: one runs, the others are cancelled at once."""
    short = {"only": "four-bar-2", "quick": True}
    with running(tmp_path, "--with", "nightly", *WITHOUT) as at:
        waiting = [begin(at["PREFECT"], "nightly/validation", short) for _ in range(30)]
        states = Counter(ended(at["PREFECT"], run)["state_type"] for run in waiting)
    assert states == {"COMPLETED": 1, "CANCELLED": 29}
    assert len(list((tmp_path / "validation").glob("night-*.json"))) == 1


@installed
def test_a_study_outlives_postgresql(undisturbed: Mapping[str, Fit], monkeypatch: pytest.MonkeyPatch) -> None:
    """kill -9 of all its processes in the middle: it is started again, and Prefect and MLflow find it."""
    # Not below pytest's own folder, which keeps out the user that the database runs as.
    with tempfile.TemporaryDirectory() as name:
        home = Path(name)
        home.chmod(0o755)
        with running(home, "--postgres", *WITHOUT) as at:
            run = begun(home, at)
            assert kill(home, "postgres") >= 1
            assert ended(at["PREFECT"], run)["state_type"] == "COMPLETED"
            assert "postgres ended by itself: it is started again" in (home / "up.log").read_text()
            # What MLflow could not be told of in between.
            with uploading(home, at, monkeypatch):
                store.upload()
                assert outbox.pending() == []
            check_study(at, run, undisturbed)
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
                assert all(urlopen(f"{at[name.upper()]}/ready", timeout=5).status == 200 for name in SERVICES)
                check(at)
