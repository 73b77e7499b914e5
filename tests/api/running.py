"""Real services on a free port of this machine."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import httpx
import uvicorn
from shoal.api.program import create_program
from shoal.api.settings import Settings
from shoal.api.worker import MakeEngine

STOPPED = 5.0
"""A service that has not stopped by then [s] is left to the end of the process: no wait is without a limit."""


@contextmanager
def serving(engine: str, settings: Settings, make_engine: MakeEngine | None = None) -> Iterator[str]:
    """The address of a service that is ready, until the end of the block."""
    program = create_program(engine, settings, make_engine)
    config = uvicorn.Config(program, port=0, log_level="warning", timeout_graceful_shutdown=1)
    server = uvicorn.Server(config)
    thread = threading.Thread(target=server.run, daemon=True)
    thread.start()
    try:
        while not server.started:
            time.sleep(0.01)
        url = f"http://127.0.0.1:{server.servers[0].sockets[0].getsockname()[1]}"
        eventually(lambda: httpx.get(f"{url}/ready").is_success)
        yield url
    finally:
        server.should_exit = True
        thread.join(STOPPED)


def eventually(met: Callable[[], bool], seconds: float = 300.0) -> None:
    """Wait until something is so."""
    deadline = time.monotonic() + seconds
    while not met():
        assert time.monotonic() < deadline, "it did not come to that in time"
        time.sleep(0.02)
