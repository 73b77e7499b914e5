"""Cost of a service: the overhead of a call, a crowd of clients, and its memory over many requests.

    python -m shoal_validation.benchmarks.service [--calls 300] [--clients 64] [--requests 10000]

Every figure is measured against `shoal serve gauss` as a process of its own on this machine.
"""

from __future__ import annotations

import argparse
import os
import socket
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import click
import httpx
import numpy as np
import psutil

REQUEST: dict[str, object] = {"scene": "single-pendulum", "times": [0.1, 0.2]}
LARGE: dict[str, object] = {"scene": "flexible-double-pendulum"}


@contextmanager
def serving(**settings: str) -> Iterator[tuple[str, psutil.Process]]:
    """Address and process of a service that is ready."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-c", "from shoal.cli import main; main()", "serve", "gauss", "--port", str(port)]
    environment = {**os.environ, **{f"SHOAL_API_{name.upper()}": value for name, value in settings.items()}}
    with subprocess.Popen(command, env=environment, stderr=subprocess.DEVNULL) as process:
        url = f"http://127.0.0.1:{port}"
        try:
            _wait(url)
            yield url, psutil.Process(process.pid)
        finally:
            process.terminate()


def _wait(url: str, seconds: float = 600.0) -> None:
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        try:
            if httpx.get(f"{url}/ready").is_success:
                return
        except httpx.TransportError:
            pass
        time.sleep(0.2)
    raise TimeoutError(f"{url} did not become ready")


def overhead(url: str, request: dict[str, object] | None, calls: int) -> str:
    """Time of a call beyond the engine's own `wall_s`, in words. request: None for /health, which computes nothing.

    The client's own share is in it: building the request, reading the answer.
    """
    with httpx.Client(base_url=url, timeout=60) as client:
        beyond = []
        for k in range(calls + 20):
            begin = time.perf_counter()
            answer = client.post("/v1/simulate", json=request) if request else client.get("/health")
            spent = time.perf_counter() - begin
            if k >= 20:  # the first ones warm up
                beyond.append(spent - answer.json().get("wall_s", 0.0))
    tenth, median, late = np.quantile(beyond, [0.1, 0.5, 0.95]) * 1e3
    return f"10 % {tenth:.2f} ms, median {median:.2f} ms, 95 % {late:.2f} ms"


def crowd(url: str, clients: int) -> Counter[int]:
    """Statuses of as many calls at once."""
    limits = httpx.Limits(max_connections=clients)
    with httpx.Client(base_url=url, timeout=60, limits=limits) as client, ThreadPoolExecutor(clients) as threads:
        return Counter(threads.map(lambda _: client.post("/v1/simulate", json=LARGE).status_code, range(clients)))


def memory(url: str, service: psutil.Process, requests: int) -> list[float]:
    """Resident memory of the service and all its processes [MiB] after each tenth of the requests."""
    found = []
    with httpx.Client(base_url=url) as client:
        for _tenth in range(10):
            for _ in range(requests // 10):
                client.post("/v1/simulate", json=REQUEST).raise_for_status()
            found.append(sum(one.memory_info().rss for one in [service, *service.children(recursive=True)]) / 2**20)
    return found


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--calls", type=int, default=300)
    parser.add_argument("--clients", type=int, default=64)
    parser.add_argument("--requests", type=int, default=10_000)
    asked = parser.parse_args()
    with serving(workers="2") as (url, service):
        for request in (None, REQUEST, LARGE):
            name = request["scene"] if request else "a call that computes nothing"
            click.echo(f"overhead of {name}: {overhead(url, request, asked.calls)}")
        statuses = crowd(url, asked.clients)
        click.echo(f"{asked.clients} clients at once, 2 workers, the usual queue: {dict(statuses)}")
        sizes = memory(url, service, asked.requests)
        click.echo(f"memory over {asked.requests} requests [MiB]: {', '.join(f'{size:.0f}' for size in sizes)}")


if __name__ == "__main__":
    main()
