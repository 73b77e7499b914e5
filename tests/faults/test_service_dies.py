"""A service that dies in the middle of an identification: one clear line, and the run goes on to the same bits."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import orjson
import psutil
import pytest
from click.testing import CliRunner
from shoal.api.operations import Simulate
from shoal.api.settings import Settings
from shoal.api.tasks import Bench, call
from shoal.cli import main
from shoal.engines import get_engine, remote

SHOAL = [sys.executable, "-c", "from shoal.cli import main; main()"]
IDENTIFY = ["identify", "paper-case-1-same-mesh", "--json", "--method"]
VARYING = ("wall_s", "engine")


class Mortal(httpx.BaseTransport):
    """A service in this process that is gone after so many calls; `last` says how: without an answer, or with one."""

    def __init__(self, calls: int, last: httpx.Response | None = None) -> None:
        self.calls, self.last = calls, last
        self._bench = Bench(get_engine("gauss"), Settings())

    def handle_request(self, request: httpx.Request) -> httpx.Response:
        self.calls -= 1
        if self.calls < 0:
            if self.last is None:
                raise httpx.ConnectError("Connection refused")
            return self.last
        asked = Simulate.model_validate(orjson.loads(request.read()))
        return httpx.Response(200, content=call(self._bench, ("simulate", asked), lambda _: None))


def answer(text: str) -> dict[str, Any]:
    """What must be the same in every bit."""
    found: dict[str, Any] = json.loads(text)
    return {name: value for name, value in found.items() if name not in VARYING}


@pytest.fixture(scope="module")
def undisturbed() -> dict[str, Any]:
    """The answer here, which a service gives to the same bits."""
    return answer(CliRunner().invoke(main, [*IDENTIFY, "least-squares"]).stdout)


@pytest.mark.by_day(1)
@pytest.mark.parametrize(
    ("last", "line"),
    [
        (None, "does not answer: Connection refused"),
        (httpx.Response(404, text="<html>no such backend"), "is not a service of Shoal"),
    ],
)
def test_a_search_goes_on_where_the_service_left_it(
    last: httpx.Response | None,
    line: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    undisturbed: dict[str, Any],
) -> None:
    """However it goes, no point is kept as a bad one because the service was not there."""
    monkeypatch.setattr(remote, "RETRIES", 0)
    real, service = remote.RemoteEngine, Mortal(4, last)
    monkeypatch.setattr(remote, "RemoteEngine", lambda url: real(url, service))
    command = [*IDENTIFY, "least-squares", "--engine", "http://service", "--checkpoint", str(tmp_path / "kept")]
    broken = CliRunner().invoke(main, command)
    assert broken.exit_code == 3, broken.stderr
    assert len(broken.stderr.splitlines()) == 1
    assert line in broken.stderr
    service.calls = 10**9
    resumed = CliRunner().invoke(main, command)
    assert resumed.exit_code == 0, resumed.stderr
    assert "going on from" in resumed.stderr
    assert answer(resumed.stdout) == undisturbed


@contextmanager
def served(port: int) -> Iterator[subprocess.Popen[bytes]]:
    """`shoal serve gauss`, ready."""
    process = subprocess.Popen([*SHOAL, "serve", "gauss", "--port", str(port)], stderr=subprocess.DEVNULL)
    try:
        deadline = time.monotonic() + 600
        while True:
            assert process.poll() is None
            assert time.monotonic() < deadline
            try:
                if httpx.get(f"http://127.0.0.1:{port}/ready").is_success:
                    break
            except httpx.TransportError:
                pass
            time.sleep(0.2)
        yield process
    finally:
        process.kill()
        process.wait()


@pytest.mark.slow
def test_kill_in_the_middle(tmp_path: Path) -> None:
    """kill -9 of the real service: a line, status 3, no process left behind; the same command then goes on."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    kept = tmp_path / "kept"
    command = [*SHOAL, *IDENTIFY, "iafsa", "--engine", f"http://127.0.0.1:{port}", "--checkpoint", str(kept)]
    with served(port) as service:
        children = psutil.Process(service.pid).children(recursive=True)
        search = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        while not kept.exists() or kept.stat().st_size < 100_000:
            assert search.poll() is None, "the run ended before the service could be killed"
            time.sleep(0.002)
        os.kill(service.pid, signal.SIGKILL)
        out, err = search.communicate(timeout=600)
    assert (search.returncode, out) == (3, "")
    assert err.startswith(f"shoal: engine: http://127.0.0.1:{port} does not answer: [Errno 111] Connection refused;")
    assert err.count("\n") == 1
    assert not psutil.wait_procs(children, timeout=60)[1]
    with served(port):
        resumed = subprocess.run(command, capture_output=True, text=True, check=True)
        whole = subprocess.run(command[:-2], capture_output=True, text=True, check=True)
    assert "going on from" in resumed.stderr
    assert answer(resumed.stdout) == answer(whole.stdout)
