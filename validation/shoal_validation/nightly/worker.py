"""A process that measures, so that an engine which crashes or hangs costs one line and not the night."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
from collections.abc import Callable
from multiprocessing.connection import Connection
from types import TracebackType
from typing import Self

import numpy as np
from shoal.compile import progress
from shoal.trajectory import Status

from shoal_validation.nightly.measure import Measured, attempt

CRASHED, TIMEOUT = "crashed", "timeout"
_CONTEXT = multiprocessing.get_context("spawn")


class Worker:
    """Measures one line after the other in a process of its own; a new one starts where the old one is lost."""

    def __init__(self) -> None:
        self._process: multiprocessing.process.BaseProcess | None = None
        self._pipe: Connection | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stop()

    def measure(self, run: Callable[[], Measured], timeout: float) -> Measured:
        """Return the result of the run within a limit of seconds; `crashed` or `timeout` otherwise."""
        pipe, process = self._ready()
        try:
            pipe.send(run)
            if pipe.poll(timeout):
                found: Measured = pipe.recv()
                return found
        except (EOFError, OSError):
            process.join()
            self._stop()
            return Measured(CRASHED, np.nan, np.nan, f"the process ended with status {process.exitcode}")
        self._stop()
        return Measured(TIMEOUT, np.nan, np.nan, f"stopped after {timeout:g} s")

    def _ready(self) -> tuple[Connection, multiprocessing.process.BaseProcess]:
        if self._process is None or self._pipe is None or not self._process.is_alive():
            self._stop()
            self._pipe, theirs = _CONTEXT.Pipe()
            self._process = _CONTEXT.Process(target=_serve, args=(theirs,), daemon=True)
            self._process.start()
            theirs.close()
        return self._pipe, self._process

    def _stop(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.join()
        if self._pipe is not None:
            self._pipe.close()
        self._process = self._pipe = None


def _serve(pipe: Connection) -> None:
    """Measure what is sent until the other end is gone, which is also who stops at Ctrl-C.

    What engines print is no part of the answer on standard output.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.dup2(2, 1)
    while True:
        try:
            run = pipe.recv()
        except EOFError:
            return
        try:
            with progress.reporting_to(lambda line: print(line, file=sys.stderr, flush=True)):  # noqa: T201 - progress
                found = attempt(run)
        except Exception as error:
            # A defect in one line is its result, not the end of the night.
            found = Measured(str(Status.FAILED), np.nan, np.nan, f"{type(error).__name__}: {error}")
        pipe.send(found)
