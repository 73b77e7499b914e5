"""A result is never lost because MLflow does not answer, and a study can be repeated from its run."""

from __future__ import annotations

import os
import signal
import sqlite3
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack, closing, contextmanager, nullcontext, suppress
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import numpy as np
import pytest
from click.testing import CliRunner
from deployed import free_port
from mlflow import MlflowClient
from shoal import doctor
from shoal.cli import main
from shoal.engines.compare import Comparison
from shoal.errors import ComputationError, InputError
from shoal_flows import alive
from shoal_flows.rerun import rerun
from shoal_flows.tracking import outbox, record, store
from shoal_flows.tracking.engines import log_comparison
from shoal_flows.tracking.record import LOCAL, Run


def use(monkeypatch: pytest.MonkeyPatch, address: str) -> None:
    """Let what follows speak to this MLflow."""
    monkeypatch.setenv("MLFLOW_TRACKING_URI", address)
    monkeypatch.setenv("MLFLOW_HTTP_REQUEST_MAX_RETRIES", "0")


@pytest.fixture
def silent(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A home of its own, and a server that does not answer."""
    monkeypatch.setenv("SHOAL_HOME", str(tmp_path))
    use(monkeypatch, f"http://127.0.0.1:{free_port()}")


@pytest.mark.slow
@pytest.mark.usefixtures("silent")
def test_a_study_waits_in_the_outbox_and_arrives_whole(
    comparison: Comparison, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    kept_as = log_comparison(comparison, b"\x89PNG")
    assert kept_as.startswith(LOCAL)
    assert len(outbox.pending()) == 4  # the study and three engines
    with pytest.raises(ComputationError, match="MLflow at http"):
        store.upload()
    assert len(outbox.pending()) == 4

    use(monkeypatch, f"sqlite:///{tmp_path / 'later.db'}")
    assert store.upload() == 4
    assert outbox.pending() == []
    client, run_id = store.connect(), outbox.address(kept_as)
    study = client.get_run(run_id)
    assert study.info.status == "FINISHED"
    assert {item.path for item in client.list_artifacts(run_id)} == {"engines.png", "differences.json"}
    parts = client.search_runs([study.info.experiment_id], f"tags.`mlflow.parentRunId` = '{run_id}'")
    assert {part.data.params["engine"] for part in parts} == {"gauss", "exudyn", "casadi"}
    motion = comparison.trajectories["gauss"]
    (gauss,) = (part for part in parts if part.data.params["engine"] == "gauss")
    assert gauss.data.metrics["final/x"] == motion.marker("B")[-1, 0]
    assert len(client.get_metric_history(gauss.info.run_id, "tip/x")) == min(300, len(motion.times))
    assert gauss.info.end_time < store.connect().get_run(run_id).info.end_time + 1


@pytest.mark.usefixtures("silent")
def test_an_upload_that_breaks_off_sends_nothing_twice(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    with store.open_run("Forward", "one") as run:
        run.metric("final/x", 1.5)
    use(monkeypatch, f"sqlite:///{tmp_path / 'later.db'}")
    made: list[str] = []

    def breaks(client: MlflowClient, run_id: str, **_: object) -> None:
        made.append(run_id)
        raise OSError("the line went dead")

    with monkeypatch.context() as broken:
        broken.setattr(MlflowClient, "log_batch", breaks)
        with pytest.raises(ComputationError, match="went dead"):
            store.upload()
    assert len(outbox.pending()) == 1
    assert store.upload() == 1
    client = store.connect()
    experiment = client.get_experiment_by_name("Forward").experiment_id
    (found,) = client.search_runs([experiment])
    assert found.info.run_id == made[0]
    assert found.data.metrics == {"final/x": 1.5}


@pytest.mark.usefixtures("silent")
@pytest.mark.parametrize("end", [None, ValueError("no"), KeyboardInterrupt()])
@pytest.mark.by_day(1)
def test_whatever_the_end_of_a_study_what_waits_goes_along(
    end: BaseException | None, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    with suppress(ValueError, KeyboardInterrupt), store.open_run("Forward", "waits") as waits:
        if end is not None:
            raise end
    assert len(outbox.pending()) == 1
    use(monkeypatch, f"sqlite:///{tmp_path / 'later.db'}")
    with suppress(ValueError, KeyboardInterrupt), store.open_run("Forward", "next") as run:
        if end is not None:
            raise end
    assert outbox.pending() == []
    status = {None: "FINISHED", ValueError: "FAILED", KeyboardInterrupt: "KILLED"}[None if end is None else type(end)]
    for one in (outbox.address(waits.run_id), run.run_id):
        assert store.connect().get_run(one).info.status == status


@pytest.mark.slow
@pytest.mark.usefixtures("silent")
def test_parts_of_a_study_that_was_killed_arrive_without_it(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """They wait for a study that runs; where its process is gone, nothing of it will ever come."""
    let_go = alive.hold(alive.MLFLOW, f"{LOCAL}study", "")
    with store.open_run("Forward", "part", parent=f"{LOCAL}study") as part:
        part.metric("final/x", 1.5)
    use(monkeypatch, f"sqlite:///{tmp_path / 'later.db'}")
    assert store.upload() == 0
    let_go()
    assert store.upload() == 1
    found = store.connect().get_run(outbox.address(part.run_id))
    assert found.data.metrics == {"final/x": 1.5}
    assert "broken_off" in found.data.tags
    assert "mlflow.parentRunId" not in found.data.tags


def damaged(path: Path) -> AbstractContextManager[object]:
    path.write_bytes(np.random.default_rng(0).bytes(5000))
    return nullcontext()


def locked(path: Path) -> AbstractContextManager[object]:
    other = sqlite3.connect(path)
    other.execute("CREATE TABLE held (x)")
    other.execute("BEGIN EXCLUSIVE")
    return closing(other)


@pytest.mark.usefixtures("silent")
@pytest.mark.parametrize(("how", "reason"), [(damaged, "is not a database"), (locked, "locked by another program")])
def test_a_database_that_cannot_be_read_is_one_line_and_nothing_is_lost(
    how: Any, reason: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    path = tmp_path / "mlflow.db"
    # As SQLite takes it: how long [s] to wait for others.
    use(monkeypatch, f"sqlite:///{path}?timeout=0.1")
    with how(path):
        with store.open_run("Forward", "one") as run:
            run.metric("final/x", 1.5)
        assert run.run_id.startswith(LOCAL)
        assert len(outbox.pending()) == 1
        for command in (["upload"], ["rerun", "0123"], ["report", "--all"], ["report", "0123"]):
            done = CliRunner().invoke(main, command)
            assert done.exit_code == ComputationError.exit_status, command
            assert done.stderr.count("\n") == 1
            assert f"MLflow at sqlite:///{path}" in done.stderr
            assert reason in done.stderr
        (check,) = doctor.check_runs(f"sqlite:///{path}", patience=0.1)
        assert not check.ok
    assert len(outbox.pending()) == 1
    path.unlink()
    assert doctor.check_runs(f"sqlite:///{path}") == []
    with closing(sqlite3.connect(path)) as fresh:
        fresh.execute("CREATE TABLE runs (x)")
    (check,) = doctor.check_runs(f"sqlite:///{path}")
    assert check.ok


@pytest.mark.usefixtures("silent")
def test_a_run_comes_back_from_its_folder_as_it_was(tmp_path: Path) -> None:
    run = Run("Forward", "one", {"kind": "forward"}, parent="abc")
    run.params({"scene": "single-pendulum"})
    run.metric("final/x", 1.25, 7)
    run.text("a,b\n", "tables/a.csv")
    run.picture(b"\x89PNG", "a.png")
    run.end("FINISHED")
    run.save(tmp_path / "kept")
    assert record.Run.load(tmp_path / "kept") == run


def test_what_cannot_be_repeated_is_refused_in_one_line() -> None:
    with pytest.raises(InputError, match="MLflow knows no run 'nothing'"):
        rerun("nothing")
    with store.open_run("Forward", "by hand") as run:
        pass
    with pytest.raises(InputError, match="not made by a flow"):
        rerun(run.run_id)


@contextmanager
def mlflow_server(folder: Path, port: int) -> Iterator[subprocess.Popen[bytes]]:
    """A server on a database of its own; killed when the block is left."""
    command = [sys.executable, "-m", "mlflow", "server", "--port", str(port), "--workers", "1"]
    command += [
        "--backend-store-uri",
        f"sqlite:///{folder / 'served.db'}",
        "--artifacts-destination",
        str(folder / "a"),
    ]
    with subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
    ) as made:
        try:
            deadline = time.monotonic() + 600
            while True:
                with suppress(OSError), urlopen(f"http://127.0.0.1:{port}/health", timeout=2):
                    break
                assert made.poll() is None
                assert time.monotonic() < deadline
                time.sleep(0.2)
            yield made
        finally:
            os.killpg(made.pid, signal.SIGKILL)


@pytest.mark.slow
@pytest.mark.usefixtures("silent")
def test_a_server_that_is_killed_in_a_study_gets_the_rest_later(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    port = free_port()
    use(monkeypatch, f"http://127.0.0.1:{port}")
    with mlflow_server(tmp_path, port), ExitStack() as stack:
        study = stack.enter_context(store.open_run("Identification", "study"))
        with store.open_run("Identification", "before", parent=study.run_id) as part:
            part.metric("final/x", 1.0)
        assert outbox.pending() == []
        rest = stack.pop_all()
    with rest:
        with store.open_run("Identification", "after", parent=study.run_id) as part:
            part.metric("final/x", 2.0)
            part.text("all of it", "result.txt")
        study.metric("study/trusted", 2)
    assert len(outbox.pending()) == 2
    with mlflow_server(tmp_path, port):
        use(monkeypatch, f"http://127.0.0.1:{port}")
        assert store.upload() == 2
        client = store.connect()
        whole = client.get_run(study.run_id)
        assert whole.info.status == "FINISHED"
        assert whole.data.metrics == {"study/trusted": 2.0}
        parts = client.search_runs([whole.info.experiment_id], f"tags.`mlflow.parentRunId` = '{study.run_id}'")
        assert {one.info.run_name: one.data.metrics["final/x"] for one in parts} == {"before": 1.0, "after": 2.0}
        (after,) = (one.info.run_id for one in parts if one.info.run_name == "after")
        assert [item.path for item in client.list_artifacts(after)] == ["result.txt"]
