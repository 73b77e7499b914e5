"""`make up` and `make up-postgres`: a real deployment run through Prefect's API, and nothing left behind."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.request import Request, urlopen

import pytest
from shoal_flows.server import free_port

PORTS = ("MLFLOW", "PREFECT", "WORKER", "GAUSS", "EXUDYN", "CASADI", "POSTGRES")
SERVICES = ("gauss", "exudyn", "casadi")
PATIENCE = 120.0


def call(address: str, data: dict[str, Any] | None = None) -> Any:
    body = None if data is None else json.dumps(data).encode()
    request = Request(address, body, {"Content-Type": "application/json"})
    with urlopen(request, timeout=30) as answer:
        return json.load(answer)


def of_home(home: Path) -> set[int]:
    """Every process of this machine that was told this home, whoever is its parent."""
    wanted = f"SHOAL_HOME={home}".encode()
    found = set()
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            if wanted in (entry / "environ").read_bytes().split(b"\0"):
                found.add(int(entry.name))
        except OSError:
            continue
    return found


@contextmanager
def running(home: Path, *options: str) -> Iterator[dict[str, str]]:
    """`make up`, with its addresses; stopped with SIGTERM as a service manager does, which has to succeed."""
    ports = {name: str(free_port()) for name in PORTS}
    environment = {
        **{name: value for name, value in os.environ.items() if not name.startswith(("PREFECT_", "MLFLOW_"))},
        **{f"SHOAL_{name}_PORT": port for name, port in ports.items()},
        "SHOAL_HOME": str(home),
    }
    command = [sys.executable, "-m", "shoal_flows.deployment.up", *options]
    log = home / "up.log"
    with log.open("wb") as out:
        process = subprocess.Popen(command, env=environment, stdout=out, stderr=subprocess.STDOUT)
    try:
        deadline = time.monotonic() + PATIENCE
        while "(Ctrl-C stops everything)" not in log.read_text(errors="replace"):
            assert process.poll() is None, log.read_text(errors="replace")[-4000:]
            assert time.monotonic() < deadline, log.read_text(errors="replace")[-4000:]
            time.sleep(0.2)
        yield {name: f"http://127.0.0.1:{port}" for name, port in ports.items()}
    finally:
        process.send_signal(signal.SIGTERM)
        ended = process.wait(60)
        sys.stdout.write(log.read_text(errors="replace")[-6000:])  # shown where the test fails
    assert ended == 0
    time.sleep(0.5)
    assert of_home(home) == set()


def run_deployment(prefect: str, name: str, parameters: dict[str, Any]) -> dict[str, Any]:
    """A run of a deployment, after it has ended."""
    deployment = call(f"{prefect}/api/deployments/name/{name}")["id"]
    run = call(f"{prefect}/api/deployments/{deployment}/create_flow_run", {"parameters": parameters})
    deadline = time.monotonic() + PATIENCE
    while run["state_type"] in ("SCHEDULED", "PENDING", "RUNNING"):
        assert time.monotonic() < deadline, run
        time.sleep(0.5)
        run = call(f"{prefect}/api/flow_runs/{run['id']}")
    return dict(run)


def artifacts_of(prefect: str, run: dict[str, Any]) -> dict[str, Any]:
    found = call(f"{prefect}/api/artifacts/filter", {"artifacts": {"flow_run_id": {"any_": [run["id"]]}}})
    return {one["key"]: one["data"] for one in found}


def check(at: dict[str, str]) -> None:
    """A deployment runs, shows its table, its end and its run in MLflow, and what MLflow has of it."""
    run = run_deployment(at["PREFECT"], "forward/forward", {"scene": "single-pendulum"})
    assert run["state_type"] == "COMPLETED"
    shown = artifacts_of(at["PREFECT"], run)
    assert shown["progress"] == 100.0
    assert "| marker | x [m] | y [m] |" in shown["result"]
    link = shown["mlflow-run"]
    run_id = link[link.index("(") + 1 : link.index(")")].rpartition("/")[2] if "(" in link else link.rpartition("/")[2]
    tracked = call(f"{at['MLFLOW']}/api/2.0/mlflow/runs/get?run_id={run_id}")["run"]
    assert tracked["info"]["status"] == "FINISHED"
    assert {"key": "scene", "value": "single-pendulum"} in tracked["data"]["params"]
    files = call(f"{at['MLFLOW']}/api/2.0/mlflow/artifacts/list?run_id={run_id}")["files"]
    assert "trajectory.csv" in {file["path"] for file in files}


def test_a_deployment_runs_on_sqlite(tmp_path: Path) -> None:
    with running(tmp_path, *(word for name in SERVICES for word in ("--without", name))) as at:
        check(at)
    # Readable without the server as well, by `shoal ui` and `shoal rerun`.
    assert list((tmp_path / "artifacts").rglob("trajectory.csv"))


@pytest.mark.slow
@pytest.mark.skipif(
    not (shutil.which("initdb") or list(Path("/usr/lib/postgresql").glob("*/bin/initdb"))),
    reason="PostgreSQL is not installed",
)
def test_a_deployment_runs_on_postgresql() -> None:
    # Not below pytest's own folder, which keeps out the user that the database runs as.
    with tempfile.TemporaryDirectory() as name:
        home = Path(name)
        home.chmod(0o755)
        for _ in range(2):  # the second time on what the first has left
            with running(home, "--postgres") as at:
                assert all(urlopen(f"{at[name.upper()]}/ready", timeout=5).status == 200 for name in SERVICES)
                check(at)
        assert not (home / "mlflow.db").exists()
        assert not (home / "prefect" / "prefect.db").exists()
