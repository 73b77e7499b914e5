"""One call of a service: the engine's own numbers, and a clear status whatever the engine does."""

from __future__ import annotations

import os
import signal
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from running import eventually
from shoal.engines import get_engine
from shoal.scene import load_scene

Machine = dict[str, Any]


def post(client: httpx.Client, machine: Machine, **changes: Any) -> httpx.Response:
    return client.post("/v1/simulate", json={"scene": machine, "at": [0.1], **changes})


def test_lanes_are_the_engines_own(gauss: httpx.Client) -> None:
    """Every bit of every lane survives the way."""
    angles = [0.3, 0.4, 0.1 + 0.2]
    answer = gauss.post(
        "/v1/simulate", json={"scene": "single-pendulum", "at": [0.1, 0.2], "lanes": {"initial.OA.angle": angles}}
    )
    local = get_engine("gauss").simulate_many(
        load_scene("single-pendulum"), {"initial.OA.angle": np.array(angles)}, [0.1, 0.2]
    )
    assert answer.status_code == 200
    assert np.array_equal(np.array(answer.json()["points"]), local.points)
    assert answer.json()["status"] == ["ok"] * 3


def test_inline_scene_and_values(gauss: httpx.Client, machine: Machine) -> None:
    answer = post(gauss, machine, set={"initial.OA.angle": 0.5}, at=[0.0])
    assert answer.status_code == 200
    assert answer.json()["points"][0][0][0] == pytest.approx([np.cos(0.5)])


def test_the_end_of_a_run_is_where_another_goes_on(gauss: httpx.Client, machine: Machine) -> None:
    """The answer has the state, which a request takes back; a path would be one of the server's."""
    whole, first = (post(gauss, machine, at=times).json() for times in ([0.1, 0.2], [0.1]))
    on = post(gauss, machine | {"initial": {"from": first["end"]}}, at=[0.0, 0.1]).json()
    assert np.array(on["points"]) == pytest.approx(np.array(whole["points"]), abs=1e-9)
    refused = post(gauss, machine, set={"initial.from": "end.json"})
    assert refused.status_code == 422
    assert "`statics` or the `end` of a run's JSON, found 'end.json'" in refused.json()["detail"]


def test_refusal_reads_as_the_engine_says_it(gauss: httpx.Client, machine: Machine) -> None:
    """The problem document carries the engine's own line and the field."""
    answer = post(gauss, machine, set={"bodies.OA.mass": -1.0})
    assert answer.status_code == 422
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json()["field"] == "pendulum.bodies.OA.mass"
    assert "found -1.0" in answer.json()["detail"]


def test_not_finite_is_null(obedient: httpx.Client, machine: Machine) -> None:
    answer = post(obedient, machine | {"name": "nan"})
    assert answer.json()["points"] == [[[[None], [None]]]]


def test_crash_ends_one_call(obedient: httpx.Client, machine: Machine) -> None:
    """A worker that dies takes its call with it, nothing else; a fresh one answers the next."""
    answer = post(obedient, machine | {"name": "crash"})
    assert (answer.status_code, answer.json()["type"]) == (500, "urn:shoal:crashed")
    assert obedient.get("/health").is_success
    assert post(obedient, machine).status_code == 200


def test_worker_that_died_in_its_sleep(obedient: httpx.Client, machine: Machine, tmp_path: Path) -> None:
    """Nobody's call pays for a worker that was killed while it had nothing to do."""
    eventually(lambda: post(obedient, machine).status_code == 200)
    note = tmp_path / "pid"
    assert post(obedient, machine | {"name": "pid", "description": str(note)}).status_code == 200
    os.kill(int(note.read_text()), signal.SIGKILL)
    time.sleep(0.1)
    assert post(obedient, machine).status_code == 200


def test_hang_ends_after_its_time(obedient: httpx.Client, machine: Machine) -> None:
    begin = time.monotonic()
    answer = post(obedient, machine | {"name": "hang"})
    assert (answer.status_code, answer.json()["type"]) == (504, "urn:shoal:timeout")
    # Not before its time, which `hang` outlasts by an hour.
    assert time.monotonic() - begin > 3.9
    eventually(lambda: post(obedient, machine).status_code == 200)


def test_memory_is_bounded(obedient: httpx.Client, machine: Machine) -> None:
    """An allocation beyond the worker's memory is refused, and the worker lives on."""
    answer = post(obedient, machine | {"name": "huge"})
    assert (answer.status_code, answer.json()["type"]) == (422, "urn:shoal:too-much")


def test_full_queue(obedient: httpx.Client, machine: Machine) -> None:
    """One computes, one waits, the others are told to come again."""
    eventually(lambda: post(obedient, machine).status_code == 200)
    with ThreadPoolExecutor(4) as threads:
        answers = list(threads.map(lambda _: post(obedient, machine | {"name": "short"}), range(4)))
    assert sorted(answer.status_code for answer in answers) == [200, 200, 429, 429]
    assert all(a.headers["retry-after"] == "1" for a in answers if a.status_code == 429)
