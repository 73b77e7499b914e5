"""A Prefect server started on demand, one per process, unless PREFECT_API_URL names one.

Prefect's own ephemeral server takes about twice as long until the first flow runs, and it cannot be
started ahead while other work is done. This one is started again when it dies: its socket is kept by
this process, so whoever asks in the meantime waits instead of being refused.
"""

from __future__ import annotations

import atexit
import os
import socket
import subprocess
import sys
import time
from contextlib import suppress
from threading import Event, Thread
from urllib.error import HTTPError, URLError
from urllib.request import urlopen

from shoal.errors import ComputationError

from shoal_flows import events, settings

_PATIENCE = 300.0
_started: list[_Kept] = []


def start() -> None:
    """Start the server without waiting for it. Call before importing Prefect, which reads its address once."""
    settings.apply()
    # What Prefect's own threads have to say of a server that is away for a while, nobody can do anything about.
    os.environ.setdefault("PREFECT_LOGGING_INTERNAL_LEVEL", "CRITICAL")
    if any(kept.lost for kept in _started):
        stop()
    if not os.environ.get("PREFECT_API_URL"):
        kept = _Kept()
        os.environ["PREFECT_API_URL"] = kept.address
        _started.append(kept)
        atexit.register(stop)


def wait() -> None:
    """Return once the server that `start` started answers, or if another one does. Raises ComputationError."""
    for kept in _started:
        kept.settled.wait()
        if kept.lost:
            raise ComputationError(f"the Prefect server did not start; see {kept.log}")
    if not _started and not answers():
        address = os.environ["PREFECT_API_URL"]
        raise ComputationError(f"PREFECT_API_URL: no server answers at {address}; unset it for a server of its own")


def answers() -> bool:
    """Return whether there is a server at PREFECT_API_URL."""
    return _answers(os.environ["PREFECT_API_URL"])


def shared() -> str:
    """The address of a server that others use too; empty for the one that this process started."""
    return "" if _started else os.environ.get("PREFECT_API_URL", "")


def stop() -> None:
    """Stop the server that this process started."""
    while _started:
        os.environ.pop("PREFECT_API_URL", None)
        _started.pop().stop()


class _Kept:
    """The process of a server, and a thread that starts another whenever it ends by itself.

    settled: whether its first answer or failure is known; lost: whether it answers no more.
    """

    def __init__(self) -> None:
        self._socket = socket.create_server(("127.0.0.1", 0), backlog=128)
        self.address = f"http://127.0.0.1:{self._socket.getsockname()[1]}/api"
        self.log = settings.log_folder() / "prefect-server.log"
        self.settled, self.lost, self._stopping = Event(), False, False
        self._process = self._spawn("wb")
        self._thread = Thread(target=self._keep, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End it for good."""
        self._stopping = True
        self._process.terminate()
        # It may just have been starting another one.
        self._thread.join(10)
        self._process.terminate()
        try:
            self._process.wait(10)
        except subprocess.TimeoutExpired:
            self._process.kill()
        self._forget()
        self._socket.close()

    def _forget(self) -> None:
        """Close the pipe to a process that has ended."""
        if self._process.stdin is not None:
            self._process.stdin.close()

    def _spawn(self, mode: str) -> subprocess.Popen[bytes]:
        descriptor = self._socket.fileno()
        with self.log.open(mode) as log:
            return subprocess.Popen(
                [
                    sys.executable,
                    "-m",
                    "shoal_flows.attached",
                    "shoal_flows.prefect_server",
                    "--descriptor",
                    str(descriptor),
                ],
                stdout=log,
                stderr=subprocess.STDOUT,
                stdin=subprocess.PIPE,
                pass_fds=[descriptor],
                # Ctrl-C is for the flow, which still has to report its end to the server.
                start_new_session=True,
            )

    def _keep(self) -> None:
        answers = self._does_answer()
        self.lost = not answers
        self.settled.set()
        while answers:
            status = self._process.wait()
            if self._stopping:
                return
            answers = self._again(f"signal {-status}" if status < 0 else f"status {status}")
        self.lost = True
        # From now on whoever asks is refused, and waits no longer.
        self._socket.close()

    def _again(self, how: str) -> bool:
        with suppress(ComputationError), events.work(f"Prefect's server, which ended with {how}, started again"):
            self._forget()
            self._process = self._spawn("ab")
            if self._does_answer():
                return True
            raise ComputationError(f"see {self.log}")
        return False

    def _does_answer(self) -> bool:
        """Return whether it answers, as soon as it does; not if it ends before that."""
        deadline = time.monotonic() + _PATIENCE
        while self._process.poll() is None and time.monotonic() < deadline:
            if _answers(self.address):
                return True
            time.sleep(0.1)
        return False


def _answers(address: str) -> bool:
    try:
        with urlopen(address + "/health", timeout=5):
            return True
    except HTTPError:
        # Whatever it says, somebody is there.
        return True
    except (URLError, OSError):
        return False
