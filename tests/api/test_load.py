"""More clients than workers: everybody is served, in turn, and nothing piles up."""

from __future__ import annotations

import inspect
import sys
import threading
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import engines_for_tests
import httpx
import psutil
import pytest
from fastapi import APIRouter
from fastapi.routing import APIRoute
from running import eventually, serving
from shoal.api import program, routes, umbridge
from shoal.api.settings import Settings
from shoal_validation.benchmarks import service

Machine = dict[str, Any]


def post(client: httpx.Client, machine: Machine) -> httpx.Response:
    return client.post("/v1/simulate", json={"scene": machine, "at": [0.1]})


def crowd(settings: Settings, machine: Machine, clients: int, seconds: float) -> tuple[Counter[int], list[int]]:
    """Statuses, and answers per client, of clients that ask without a pause or come again when they are told to."""
    statuses, served = Counter[int](), [0] * clients
    everybody = threading.Barrier(clients)

    def one(k: int) -> None:
        with httpx.Client(base_url=url, timeout=60) as client:
            everybody.wait()
            end = time.monotonic() + seconds
            while time.monotonic() < end or not served[k]:
                answer = post(client, machine)
                statuses[answer.status_code] += 1
                served[k] += answer.status_code == 200
                time.sleep(float(answer.headers.get("retry-after", 0)))

    with (
        serving(engines_for_tests.NAME, settings, engines_for_tests.obedient) as url,
        ThreadPoolExecutor(clients) as threads,
    ):
        list(threads.map(one, range(clients)))
    return statuses, served


@pytest.mark.parametrize("router", [routes.health, routes.v1, routes.jobs, routes.by_id, umbridge.router])
def test_nothing_of_a_call_goes_to_another_thread(router: APIRouter) -> None:
    """What is no coroutine runs on a thread of its own; two such dependencies were half of a call's overhead."""
    assert inspect.iscoroutinefunction(program.state_key)
    for route in router.routes:
        assert isinstance(route, APIRoute)
        parts = [route.dependant]
        while parts:
            part = parts.pop()
            parts += part.dependencies
            assert inspect.iscoroutinefunction(part.call) or inspect.isasyncgenfunction(part.call), route.path


@pytest.mark.slow
def test_every_client_is_served_alike(machine: Machine) -> None:
    """64 clients that never pause, two workers, the usual queue: first come, first served."""
    statuses, served = crowd(Settings(workers=2), machine, clients=64, seconds=8.0)
    assert set(statuses) == {200}
    assert min(served) > 0.8 * max(served) > 8, sorted(served)


@pytest.mark.slow
def test_who_comes_again_gets_through(machine: Machine) -> None:
    """With hardly a queue clients are sent away; those that come again when they are told to are served."""
    statuses, served = crowd(Settings(workers=2, queue=2), machine, clients=64, seconds=5.0)
    assert set(statuses) == {200, 429}
    assert min(served) >= 1


def test_nobody_computes_for_a_client_that_left(obedient: httpx.Client, machine: Machine, tmp_path: Path) -> None:
    """A call whose client gave up while it waited in line is dropped when its turn comes."""
    eventually(lambda: post(obedient, machine).status_code == 200)
    note = tmp_path / "computed"
    with ThreadPoolExecutor(1) as threads:
        begun = tmp_path / "begun"
        first = threads.submit(post, obedient, machine | {"name": "short", "description": str(begun)})
        eventually(begun.exists)
        with (
            httpx.Client(base_url=obedient.base_url, timeout=httpx.Timeout(60, read=0.1)) as hasty,
            pytest.raises(httpx.ReadTimeout),
        ):
            post(hasty, machine | {"description": str(note)})
        assert first.result().status_code == 200
    assert post(obedient, machine).status_code == 200
    assert not note.exists()
    assert post(obedient, machine | {"description": str(note)}).status_code == 200
    assert note.exists()


def test_what_a_client_that_left_had_computed_is_ended(
    obedient: httpx.Client, machine: Machine, tmp_path: Path
) -> None:
    """Its worker is gone before its time is over, and a fresh one takes the next call."""
    eventually(lambda: post(obedient, machine).status_code == 200)
    note = tmp_path / "pid"
    with (
        httpx.Client(base_url=obedient.base_url, timeout=httpx.Timeout(60, read=0.3)) as hasty,
        pytest.raises(httpx.ReadTimeout),
    ):
        # It holds the clock still while it "compiles": nothing but the client's leaving ends it.
        post(hasty, machine | {"name": "stuck", "description": str(note)})
    eventually(note.exists)
    eventually(lambda: not psutil.pid_exists(int(note.read_text())), 30.0)
    assert post(obedient, machine).status_code == 200


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="resident memory is counted as on Linux")
def test_memory_stays_flat() -> None:
    """Ten thousand calls: no more memory after the last than after two thousand, but for 8 MiB."""
    with service.serving(workers="2") as (url, process):
        sizes = service.memory(url, process, 10_000)
    assert max(sizes[2:]) - sizes[1] < 8.0, sizes
