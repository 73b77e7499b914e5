"""What runs together: each part is started, looked after, and started again when it ends by itself."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Protocol

from rich.console import Console
from shoal.errors import ComputationError

from shoal_flows.deployment import processes

PATIENCE = 600.0
TRIES = 3
"""Starts in a row that may fail, as when a server and its database died together."""
_GRACE = 20.0


class Part(Protocol):
    """A program that others need, or that somebody waits for."""

    @property
    def name(self) -> str:
        """As the Procfile calls it."""
        ...

    def start(self) -> None:
        """Start it and return when it can do its work. Raises ComputationError."""
        ...

    def ended(self) -> bool:
        """Whether it is gone."""
        ...


class Line:
    """One line of the Procfile."""

    def __init__(self, name: str, environment: Mapping[str, str]) -> None:
        self.name, self._environment = name, environment
        self._process: subprocess.Popen[bytes] | None = None

    def begin(self) -> None:
        """Start it without waiting."""
        self.stop()
        self._process = subprocess.Popen(
            # Its own session: Ctrl-C is for this process alone. A pipe: it ends with this process, however that ends.
            [sys.executable, "-m", "shoal_flows.attached", *honcho(self.name)],
            env=dict(self._environment),
            stdin=subprocess.PIPE,
            start_new_session=True,
        )

    def ready(self) -> None:
        """Return when it can do its work. Raises ComputationError."""
        deadline = time.monotonic() + PATIENCE
        while not processes.is_ready(self.name):
            if self.ended() or time.monotonic() > deadline:
                raise ComputationError(f"{self.name} did not start; its last lines are above")
            time.sleep(0.2)

    def start(self) -> None:
        """Start it and return when it can do its work.

        Raises ComputationError, and InputError if what is left of the one before still listens.
        """
        processes.check_port(self.name)
        self.begin()
        self.ready()

    def ended(self) -> bool:
        """Whether it is gone."""
        return self._process is None or self._process.poll() is not None

    def stop(self) -> None:
        """End it, and wait for that."""
        if self._process is None:
            return
        self._process.terminate()
        try:
            self._process.wait(_GRACE)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        if self._process.stdin is not None:
            self._process.stdin.close()


def look_after(parts: Sequence[Part], console: Console) -> None:
    """Start again what ends by itself, those before others that need them, for ever.

    Raises ComputationError if one does not start any more.
    """
    failed = Counter[str]()
    while True:
        for part in parts:
            if part.ended():
                console.print(f"{part.name} ended by itself: it is started again")
                try:
                    part.start()
                    failed[part.name] = 0
                except ComputationError:
                    failed[part.name] += 1
                    if failed[part.name] == TRIES:
                        raise
        time.sleep(0.3)


def honcho(name: str) -> list[str]:
    """The command that runs a line of the Procfile."""
    folder = processes.FOLDER
    return ["honcho", "-f", str(folder / "Procfile"), "-d", str(folder), "-e", os.devnull, "start", name]
