"""Identifications as jobs: progress, results, cancellation, a client that goes away, a worker that dies."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import psutil
import pytest
from running import eventually
from shoal.engines import get_engine
from shoal.scene import Scene

Machine = dict[str, Any]
JOBS = "/v1/jobs/identify"


@pytest.fixture(scope="module")
def recording(machine: Machine) -> dict[str, list[float]]:
    """The path of the end from 0.3 rad, as a recording would have it."""
    times = np.linspace(0.0, 1.0, 51)
    scene = Scene.parse(machine).with_values({"initial.OA.angle": 0.3})
    x, y = get_engine("gauss").simulate(scene, times).marker("A").T
    return {"t": times.tolist(), "x": x.tolist(), "y": y.tolist()}


def body(machine: Machine, problem: Machine, name: str, columns: dict[str, list[float]]) -> Machine:
    """A request whose scene has a name that the obedient engine obeys."""
    return {
        "problem": {**problem, "scene": machine | {"name": name}},
        "data": {"recording": {"columns": columns}},
    }


def ended(client: httpx.Client, job: str) -> Machine:
    """The status of a job, when it has ended."""
    eventually(lambda: client.get(job).json()["status"] not in ("queued", "running"))
    return dict(client.get(job).json())


def test_inline_problem_and_recording(
    gauss: httpx.Client, machine: Machine, problem: Machine, recording: dict[str, list[float]]
) -> None:
    """From arrays to a parameter, without a file of the client's; who asks twice with one key gets the same job."""
    asked, key = body(machine, problem, "pendulum", recording), {"Idempotency-Key": "once"}
    answer = gauss.post(JOBS, json=asked, headers=key)
    assert answer.status_code == 202
    job = answer.headers["location"]
    assert gauss.post(JOBS, json=asked, headers=key).headers["location"] == job
    assert gauss.post(JOBS, json={**asked, "seed": 1}, headers=key).status_code == 422
    assert ended(gauss, job)["status"] == "done"
    estimate = gauss.get(f"{job}/result").json()
    assert estimate["parameters"]["theta"]["value"] == pytest.approx(0.3, abs=1e-6)
    assert "/" not in estimate["data"]


def test_events_follow_the_search(
    gauss: httpx.Client, machine: Machine, problem: Machine, recording: dict[str, list[float]]
) -> None:
    """Server-sent events: progress on the way, then the end, then the stream closes."""
    job = gauss.post(JOBS, json=body(machine, problem, "pendulum", recording)).headers["location"]
    with gauss.stream("GET", f"{job}/events") as stream:
        assert stream.headers["content-type"].startswith("text/event-stream")
        news = [json.loads(line.removeprefix("data: ")) for line in stream.iter_lines() if line.startswith("data: ")]
    assert news[-1]["status"] == "done"
    assert news[-1]["progress"]["evaluations"] > 0


def test_job_survives_its_client(
    gauss: httpx.Client, machine: Machine, problem: Machine, recording: dict[str, list[float]]
) -> None:
    """The client that asked and listened breaks off; the job ends well."""
    with httpx.Client(base_url=gauss.base_url) as leaving:
        job = leaving.post(JOBS, json=body(machine, problem, "pendulum", recording)).headers["location"]
        with leaving.stream("GET", f"{job}/events") as stream:
            assert next(stream.iter_lines())
    assert ended(gauss, job)["status"] == "done"


def test_unknown_job(gauss: httpx.Client) -> None:
    for path in ("", "/result", "/events"):
        assert gauss.get(f"/v1/jobs/nothing{path}").json()["type"] == "urn:shoal:not-found"
    assert gauss.delete("/v1/jobs/nothing").status_code == 404


def test_job_of_an_unknown_operation(gauss: httpx.Client) -> None:
    answer = gauss.post("/v1/jobs/simulat", json={"scene": "single-pendulum"})
    assert (answer.status_code, answer.json()["field"]) == (404, "operation")
    assert answer.json()["detail"].startswith("no operation 'simulat'; there are simulate, ")


def test_wrong_recording_fails_the_job(gauss: httpx.Client, machine: Machine, problem: Machine) -> None:
    """What only reading shows is told by the job, as a problem document."""
    request = body(machine, problem, "pendulum", {"t": [0.0, 0.1, 0.2], "x": [1.0, 1.0, 1.0]})
    status = ended(gauss, gauss.post(JOBS, json=request).headers["location"])
    assert status["status"] == "failed"
    assert status["problem"]["status"] == 422
    assert "y" in status["problem"]["detail"]


def test_cancelled_at_once(
    obedient: httpx.Client, machine: Machine, problem: Machine, recording: dict[str, list[float]]
) -> None:
    """A hanging computation is killed, long before its time is over, and the next job runs."""
    job = obedient.post(JOBS, json=body(machine, problem, "hang", recording)).headers["location"]
    eventually(lambda: obedient.get(job).json()["status"] == "running")
    assert obedient.delete(job).status_code == 204
    assert obedient.get(job).json()["status"] == "cancelled"
    following = obedient.post(JOBS, json=body(machine, problem, "crash", recording)).headers["location"]
    status = ended(obedient, following)
    assert status["problem"]["type"] == "urn:shoal:crashed"
    assert obedient.get(f"{job}/result").status_code == 409


def test_cancelled_worker_is_gone(
    obedient: httpx.Client, machine: Machine, problem: Machine, recording: dict[str, list[float]], tmp_path: Path
) -> None:
    """Not only the job: the process that computed it has ended, and the service lives."""
    note = tmp_path / "pid"
    request = body(machine | {"description": str(note)}, problem, "hang", recording)
    job = obedient.post(JOBS, json=request).headers["location"]
    eventually(note.exists)
    pid = int(note.read_text())
    assert psutil.pid_exists(pid)
    obedient.delete(job)
    eventually(lambda: not psutil.pid_exists(pid))
    assert obedient.get("/health").is_success


def test_waiting_jobs_are_bounded(
    obedient: httpx.Client, machine: Machine, problem: Machine, recording: dict[str, list[float]]
) -> None:
    """One runs, one waits, the third is told to come again; those that wait can be cancelled."""
    request = body(machine, problem, "hang", recording)
    answers = [obedient.post(JOBS, json=request) for _ in range(3)]
    codes = [answer.status_code for answer in answers]
    for answer in answers:
        if answer.status_code == 202:
            obedient.delete(answer.headers["location"])
    assert codes == [202, 202, 429]
    assert answers[2].headers["retry-after"] == "10"
