"""A Prefect server started on demand, one per process, unless PREFECT_API_URL names one.

Prefect's own ephemeral server takes about twice as long until the first flow runs, and it cannot be
started ahead while other work is done.
"""

from __future__ import annotations

import atexit
import os
import socket
import subprocess
import sys
import time
from urllib.error import URLError
from urllib.request import urlopen

from shoal.errors import ComputationError

from shoal_flows import settings

_PATIENCE = 120.0
_COMMAND = ("prefect", "server", "start", "--no-services", "--no-ui", "--host", "127.0.0.1")
_started: list[subprocess.Popen[bytes]] = []


def start() -> None:
    """Start the server without waiting for it. Call before importing Prefect, which reads its address once."""
    settings.apply()
    if os.environ.get("PREFECT_API_URL"):
        return
    port = free_port()
    os.environ["PREFECT_API_URL"] = f"http://127.0.0.1:{port}/api"
    with (settings.log_folder() / "prefect-server.log").open("wb") as log:
        process = subprocess.Popen(
            [sys.executable, "-m", "shoal_flows.attached", *_COMMAND, "--port", str(port)],
            stdout=log,
            stderr=subprocess.STDOUT,
            stdin=subprocess.PIPE,
            # Ctrl-C is for the flow, which still has to report its end to the server.
            start_new_session=True,
        )
    _started.append(process)
    atexit.register(stop)


def wait() -> None:
    """Return once the server that `start` started answers. Raises ComputationError."""
    for process in _started:
        url = os.environ["PREFECT_API_URL"] + "/health"
        deadline = time.monotonic() + _PATIENCE
        while not _answers(url):
            if process.poll() is not None or time.monotonic() > deadline:
                log = settings.log_folder() / "prefect-server.log"
                raise ComputationError(f"the Prefect server did not start; see {log}")
            time.sleep(0.1)


def stop() -> None:
    """Stop the server that this process started."""
    while _started:
        process = _started.pop()
        os.environ.pop("PREFECT_API_URL", None)
        process.terminate()
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()


def free_port() -> int:
    """A port of this machine that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def _answers(url: str) -> bool:
    try:
        with urlopen(url, timeout=5) as answer:
            return bool(answer.status == 200)
    except (URLError, OSError):
        return False
