"""Liveness of runs: each run holds a lock on a file below Shoal's home for as long as its process lives.

The system releases the lock however the process ends: by a signal, with its container, with the machine. A lock that
can be taken shows that its run has ended; neither clocks nor process ids are needed.
"""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import IO

from shoal.home import home

MLFLOW, PREFECT = "mlflow", "prefect"
WORKER = "SHOAL_WORKER"
"""The setting by which a worker knows the flows that it started."""


@dataclass(frozen=True)
class Mark:
    """Record of a run for other processes.

    kind: MLFLOW or PREFECT; server: the address that knows the run, empty for one of the process's own
    pid: of the process that runs it; worker: which started that, empty if none did
    """

    kind: str
    run_id: str
    server: str
    pid: int
    worker: str


def hold(kind: str, run_id: str, server: str) -> Callable[[], None]:
    """Say that this process runs a run, until it calls what is returned, or ends."""
    mark = Mark(kind, run_id, server, os.getpid(), os.environ.get(WORKER, ""))
    path = _folder() / f"{kind}-{run_id}"
    try:
        file = path.open("a+")
    except OSError:
        return lambda: None  # a study does not fail for that
    if not _locked(file):
        file.close()
        return lambda: None  # held already
    with suppress(OSError):
        file.truncate(0)
        file.write(json.dumps(asdict(mark)))
        file.flush()

    def let_go() -> None:
        with suppress(OSError):
            path.unlink(missing_ok=True)
        file.close()

    return let_go


@contextmanager
def held(kind: str, run_id: str, server: str) -> Iterator[None]:
    """`hold` within the block."""
    let_go = hold(kind, run_id, server)
    try:
        yield
    finally:
        let_go()


def settle(end: Callable[[Mark], bool]) -> int:
    """Call `end` for every run whose process is gone; those for which it returns True are forgotten, and counted."""
    settled = 0
    for path in _marks():
        with suppress(FileNotFoundError), path.open("a+") as file:
            mark = _read(file) if _locked(file) else None
            if mark is not None and end(mark):
                path.unlink(missing_ok=True)
                settled += 1
    return settled


def of_worker(worker: str) -> list[Mark]:
    """Return the runs of a worker's flows that are alive."""
    found = []
    for path in _marks():
        with suppress(FileNotFoundError), path.open("a+") as file:
            mark = _read(file)
            if mark is not None and mark.worker == worker and not _locked(file):
                found.append(mark)
    return found


def is_held(kind: str, run_id: str) -> bool:
    """Return whether a process of this home runs a run."""
    with suppress(FileNotFoundError), (_folder() / f"{kind}-{run_id}").open("r+") as file:
        return not _locked(file)
    return False


def run_ids(kind: str) -> set[str]:
    """The runs of a kind that a process of this home has begun and not ended."""
    return {path.name.removeprefix(f"{kind}-") for path in _marks() if path.name.startswith(f"{kind}-")}


def _folder() -> Path:
    folder = home() / "running"
    folder.mkdir(exist_ok=True)
    return folder


def _marks() -> list[Path]:
    return sorted(path for path in _folder().iterdir() if path.is_file())


def _locked(file: IO[str]) -> bool:
    """Return whether the lock was free; it is held until the file is closed."""
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def _read(file: IO[str]) -> Mark | None:
    file.seek(0)
    with suppress(ValueError, TypeError):
        return Mark(**json.load(file))
    return None  # made a moment ago
