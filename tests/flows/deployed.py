"""A whole deployment on this machine, and what tests do to it."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any
from urllib.error import HTTPError
from urllib.request import Request, urlopen

from shoal.csrf import csrf_headers

PORTS = ("MLFLOW", "PREFECT", "WORKER", "NIGHTLY", "GAUSS", "EXUDYN", "CASADI", "POSTGRES")
SERVICES = ("gauss", "exudyn", "casadi")
PATIENCE = 600.0
"""Seconds for what ends when the thing happens: on a busy machine a server takes minutes to start."""


def call(address: str, data: dict[str, Any] | None = None) -> Any:
    """What a server answers; one that has too much to do (503) is asked again, as Prefect's own client does."""
    body = None if data is None else json.dumps(data).encode()
    request = Request(address, body, {"Content-Type": "application/json", **({} if body is None else token(address))})
    for pause in (0.5, 1, 2, 4, 8, 16, 0):
        try:
            with urlopen(request, timeout=30) as answer:
                return json.load(answer)
        except HTTPError as error:
            if error.code != 503 or not pause:
                raise
            time.sleep(pause)


def token(address: str) -> dict[str, str]:
    """Headers with which Prefect's server lets a request change something; MLflow's asks for none."""
    return {} if "/mlflow/" in address else csrf_headers(f"{address.partition('/api/')[0]}/api", 60)


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


def kill(home: Path, *words: str) -> int:
    """kill -9 for every process of this home whose command has all these words; how many there were."""
    found = [pid for pid in of_home(home) if set(words) <= set(command(pid))]
    for pid in found:
        os.kill(pid, signal.SIGKILL)
    return len(found)


def command(pid: int) -> list[str]:
    """What a process runs, by the last parts of paths; nothing if it is gone."""
    with suppress(OSError):
        return [Path(word).name for word in Path(f"/proc/{pid}/cmdline").read_text().split("\0")]
    return []


def free_port() -> int:
    """A port of this machine that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@contextmanager
def running(home: Path, *options: str, settings: Mapping[str, str] | None = None) -> Iterator[dict[str, str]]:
    """`make up`, with its addresses; stopped with SIGTERM as a service manager does, which has to succeed."""
    ports = {name: str(free_port()) for name in PORTS}
    environment = {
        **{name: value for name, value in os.environ.items() if not name.startswith(("PREFECT_", "MLFLOW_"))},
        **{f"SHOAL_{name}_PORT": port for name, port in ports.items()},
        "SHOAL_HOME": str(home),
        **(settings or {}),
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
        stopped = process.wait(PATIENCE)
        sys.stdout.write(log.read_text(errors="replace")[-6000:])  # shown where the test fails
    assert stopped == 0
    deadline = time.monotonic() + 60
    while left := of_home(home):
        assert time.monotonic() < deadline, [command(pid) for pid in left]
        time.sleep(0.1)


def begin(prefect: str, name: str, parameters: dict[str, Any]) -> dict[str, Any]:
    """A run of a deployment, asked for."""
    deployment = call(f"{prefect}/api/deployments/name/{name}")["id"]
    return dict(call(f"{prefect}/api/deployments/{deployment}/create_flow_run", {"parameters": parameters}))


def ended(prefect: str, run: dict[str, Any]) -> dict[str, Any]:
    """The run after it has ended; a server that is away for a while is asked again."""
    deadline = time.monotonic() + PATIENCE
    while run["state_type"] in ("SCHEDULED", "PENDING", "RUNNING"):
        assert time.monotonic() < deadline, run
        time.sleep(0.3)
        with suppress(OSError):
            run = call(f"{prefect}/api/flow_runs/{run['id']}")
    return run


def run_deployment(prefect: str, name: str, parameters: dict[str, Any]) -> dict[str, Any]:
    """A run of a deployment, after it has ended."""
    return ended(prefect, begin(prefect, name, parameters))


def artifacts_of(prefect: str, run: dict[str, Any]) -> dict[str, Any]:
    found = call(f"{prefect}/api/artifacts/filter", {"artifacts": {"flow_run_id": {"any_": [run["id"]]}}})
    return {one["key"]: one["data"] for one in found}


def mlflow_run(at: Mapping[str, str], run: dict[str, Any]) -> dict[str, Any]:
    """The run in MLflow to which the artifacts of a flow run lead."""
    (run_id,) = re.findall(r"/runs/(\w+)", artifacts_of(at["PREFECT"], run)["mlflow-run"])
    return dict(call(f"{at['MLFLOW']}/api/2.0/mlflow/runs/get?run_id={run_id}")["run"])


def parts(at: Mapping[str, str], study: dict[str, Any]) -> list[dict[str, Any]]:
    """The runs of a study in MLflow."""
    info = study["info"]
    asked = {
        "experiment_ids": [info["experiment_id"]],
        "filter": f"tags.`mlflow.parentRunId` = '{info['run_id']}'",
    }
    return list(call(f"{at['MLFLOW']}/api/2.0/mlflow/runs/search", asked).get("runs", []))


def metrics(run: dict[str, Any]) -> dict[str, float]:
    """The last value of every metric of a run."""
    return {one["key"]: one["value"] for one in run["data"]["metrics"]}
