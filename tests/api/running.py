"""Real services on a free port of this machine."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import httpx
import uvicorn
from shoal.api.program import create_program
from shoal.api.serve import configured
from shoal.api.settings import Settings
from shoal.api.worker import MakeEngine

STOPPED = 5.0
"""A service that has not stopped by then [s] is left to the end of the process: no wait is without a limit."""


@contextmanager
def serving(engine: str, settings: Settings, make_engine: MakeEngine | None = None) -> Iterator[str]:
    """The address of a service that is ready, until the end of the block."""
    program = create_program(engine, settings, make_engine)
    with listening(configured(program, port=0, log_config=None, log_level="warning")) as server:
        url = f"http://127.0.0.1:{port_of(server)}"
        eventually(lambda: httpx.get(f"{url}/ready").is_success)
        yield url


@contextmanager
def listening(config: uvicorn.Config) -> Iterator[uvicorn.Server]:
    """A server in a thread of its own that takes connections, until the end of the block."""
    config.timeout_graceful_shutdown = 1
    server = uvicorn.Server(config)
    thread = threading.Thread(target=server.run, daemon=True)
    thread.start()
    try:
        while not server.started:
            time.sleep(0.01)
        yield server
    finally:
        server.should_exit = True
        thread.join(STOPPED)


def port_of(server: uvicorn.Server) -> int:
    """Where it listens."""
    return int(server.servers[0].sockets[0].getsockname()[1])


def eventually(met: Callable[[], bool], seconds: float = 300.0) -> None:
    """Wait until something is so."""
    deadline = time.monotonic() + seconds
    while not met():
        assert time.monotonic() < deadline, "it did not come to that in time"
        time.sleep(0.02)
