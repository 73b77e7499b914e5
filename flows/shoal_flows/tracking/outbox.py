"""Outbox: runs that could not be sent to MLflow, kept below Shoal's home."""

from __future__ import annotations

import fcntl
import json
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from shoal.home import home

from shoal_flows import alive
from shoal_flows.tracking.record import LOCAL, Run

_IDS = "ids.json"


def folder() -> Path:
    """Return their folder, made on demand. Raises InputError."""
    found = home() / "outbox"
    found.mkdir(exist_ok=True)
    return found


def keep(run: Run) -> None:
    """Put a run that has ended into the outbox."""
    run.save(folder() / f"{run.started}-{run.run_id}")


def pending() -> list[Path]:
    """The runs that wait, oldest first, so that a study comes before its parts."""
    waiting = (path for path in folder().iterdir() if path.is_dir() and not path.name.startswith("."))
    return sorted(waiting, key=lambda path: int(path.name.partition("-")[0]))


def upload(make: Callable[[Run], None], send: Callable[[Run], None]) -> int:
    """Send what waits and forget it; returns how many were sent.

    make: gives a run its id of MLflow; send: sends all of it; an exception ends the upload, and nothing is lost.
    """
    with _alone() as alone:
        return sum(_upload(where, make, send) for where in pending()) if alone else 0


def _upload(where: Path, make: Callable[[Run], None], send: Callable[[Run], None]) -> int:
    run = Run.load(where)
    given = _given()
    kept_as, run.parent = run.run_id, given.get(run.parent or "", run.parent)
    # A run that was made before the last try broke off is gone on with.
    run.run_id = given.get(kept_as, kept_as)
    if run.parent and run.parent.startswith(LOCAL):
        if alive.is_held(alive.MLFLOW, run.parent):
            return 0  # of a study that has not ended
        run.parent, run.tags["broken_off"] = None, "the study that this run is a part of was killed before it was kept"
    if not run.known:
        make(run)
        _remember(kept_as, run.run_id)
    send(run)
    shutil.rmtree(where)
    return 1


@contextmanager
def _alone() -> Iterator[bool]:
    """Return whether no other process uploads within the block."""
    with (folder() / ".lock").open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            yield False
            return
        yield True


def address(run_id: str) -> str:
    """MLflow's id of a run that was in the outbox; the same id if it still is, or never was."""
    return _given().get(run_id, run_id)


def _given() -> dict[str, str]:
    file = folder() / _IDS
    return dict(json.loads(file.read_text())) if file.exists() else {}


def _remember(kept_as: str, run_id: str) -> None:
    fresh = folder() / f".{_IDS}"
    fresh.write_text(json.dumps({**_given(), kept_as: run_id}, indent=1))
    fresh.replace(folder() / _IDS)
