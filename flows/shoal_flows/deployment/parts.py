"""Supervision of processes: each is started, watched, and restarted when it ends by itself."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Protocol

from rich.console import Console
from shoal.errors import ComputationError

from shoal_flows.deployment import processes

PATIENCE = 600.0
TRIES = 3
"""Starts in a row that may fail, as when a server and its database died together."""
PAUSE = 0.3
"""Seconds between two looks at all parts."""
_GRACE = 20.0


class Part(Protocol):
    """A supervised program."""

    @property
    def name(self) -> str:
        """Return its name in the Procfile."""
        ...

    @property
    def needs(self) -> Sequence[str]:
        """Names of the parts that have to be ready before it starts."""
        ...

    def begin(self) -> None:
        """Start it. Raises ComputationError, and InputError where its port is taken."""
        ...

    def is_ready(self) -> bool:
        """Return whether it can do its work."""
        ...

    def ended(self) -> bool:
        """Return whether it is gone."""
        ...


class Line:
    """One line of the Procfile."""

    def __init__(self, name: str, environment: Mapping[str, str]) -> None:
        self.name, self._environment = name, environment
        self._process: subprocess.Popen[bytes] | None = None

    @property
    def needs(self) -> Sequence[str]:
        """Names of the parts that have to be ready before it starts."""
        return processes.NEEDS.get(self.name, ())

    def begin(self) -> None:
        """Start it without waiting. Raises InputError if a process of an earlier start still listens."""
        self.stop()
        processes.check_port(self.name)
        self._process = subprocess.Popen(
            # Its own session: Ctrl-C is for this process alone. A pipe: it ends with this process, however that ends.
            [sys.executable, "-m", "shoal_flows.attached", *honcho(self.name)],
            env=dict(self._environment),
            stdin=subprocess.PIPE,
            start_new_session=True,
        )

    def is_ready(self) -> bool:
        """Return whether it can do its work."""
        return processes.is_ready(self.name)

    def ready(self) -> None:
        """Return when it can do its work. Raises ComputationError."""
        deadline = time.monotonic() + PATIENCE
        while not self.is_ready():
            if self.ended() or time.monotonic() > deadline:
                raise ComputationError(f"{self.name} did not start; its last lines are above")
            time.sleep(0.2)

    def ended(self) -> bool:
        """Return whether it is gone."""
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
    """Start again what ends by itself, for ever: side by side, but for parts that need another one which is starting.

    parts: each after those that it needs. Raises ComputationError if one does not start any more.
    """
    failed, starting = Counter[str](), dict[str, float]()
    while True:
        for part in parts:
            if part.ended() or time.monotonic() > starting.get(part.name, math.inf):
                if starting.pop(part.name, None) is not None:
                    failed[part.name] += 1
                if failed[part.name] == TRIES:
                    raise ComputationError(f"{part.name} did not start; its last lines are above")
                if starting.keys().isdisjoint(part.needs):
                    console.print(f"{part.name} ended by itself: it is started again")
                    starting[part.name] = time.monotonic() + PATIENCE
                    with suppress(ComputationError):  # it has ended when it is looked at next
                        part.begin()
            elif part.name in starting and part.is_ready():
                del starting[part.name]
                failed[part.name] = 0
                console.print(f"{part.name} is ready")
        time.sleep(PAUSE)


def honcho(name: str) -> list[str]:
    """The command that runs a line of the Procfile."""
    folder = processes.FOLDER
    return ["honcho", "-f", str(folder / "Procfile"), "-d", str(folder), "-e", os.devnull, "start", name]
