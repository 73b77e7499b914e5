"""`python -m shoal_flows.deployment.worker ARGS`: `prefect worker start ARGS` that leaves no run standing as "running".

Runs left by an earlier worker are ended first. When this one is stopped, its flows are stopped too and end their runs;
Prefect's worker would kill them.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from uuid import uuid4

from shoal.errors import ComputationError, ShoalError
from shoal.shelf import shelf

from shoal_flows import alive, choices, settings
from shoal_flows.left import Unstarted, end_left
from shoal_flows.tracking.upload import upload

_GRACE = 4.0
"""Seconds that flows have to end their runs: honcho kills after five. What takes longer is ended at the next start."""
_EVERY, _STARTS = 30.0, 300.0
"""Seconds between two looks for runs that no process begins, and that a process has to begin one on a busy machine."""


def main(arguments: Sequence[str]) -> int:
    """Run a worker until it ends or this process is stopped; return the exit status."""
    try:
        settings.apply()
        if ended := end_left():
            sys.stderr.write(f"worker: {ended} runs that were broken off are ended\n")
        with suppress(ComputationError):  # else with the next study
            upload()
        shelf().identity(make=True)
        if different := choices.difference():
            sys.stderr.write(f"worker: {different}, then state the deployments again (make up)\n")
    except ShoalError as error:
        sys.stderr.write(f"worker: {error}\n")
        return error.exit_status
    name = uuid4().hex
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    process = subprocess.Popen(
        [sys.executable, "-m", "shoal_flows.attached", "prefect", "worker", "start", *arguments],
        env={**os.environ, alive.WORKER: name},
        stdin=subprocess.PIPE,
        # Signals for the whole group reach this process alone, which has its flows end first.
        start_new_session=True,
    )
    try:
        return _watched(process, Unstarted(_pool(arguments)))
    except KeyboardInterrupt:
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, signal.SIG_IGN)
        _end_flows(name)
        process.terminate()
        process.wait()
        return 0


def _watched(process: subprocess.Popen[bytes], unstarted: Unstarted) -> int:
    """Wait for the worker; now and then end the runs that it could not start. Returns its exit status."""
    while True:
        with suppress(subprocess.TimeoutExpired):
            return process.wait(_EVERY)
        if ended := unstarted.end(_STARTS):
            sys.stderr.write(f"worker: {ended} runs that no process began are ended\n")


def _pool(arguments: Sequence[str]) -> str:
    return arguments[arguments.index("--pool") + 1] if "--pool" in arguments else "default"


def _end_flows(worker: str) -> None:
    """Have the flows of a worker end their runs."""
    for pid in {mark.pid for mark in alive.of_worker(worker)}:
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGTERM)
    deadline = time.monotonic() + _GRACE
    while alive.of_worker(worker) and time.monotonic() < deadline:
        time.sleep(0.05)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
