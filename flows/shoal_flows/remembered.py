"""Results by what they depend on: a study that was broken off, or is asked for again, computes what is missing."""

from __future__ import annotations

import os
import pickle
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from shoal.home import home

from shoal_flows import workers

P = ParamSpec("P")
T = TypeVar("T")
_reused: list[str] = []
_fresh = False
_NEW, _DAY = ".new-", 86400.0


def run(key: str, function: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
    """The result kept under this key, else that of `workers.run`, which is kept from now on.

    With SHOAL_FRESH set, everything is computed again.
    """
    file = folder() / key
    if not (_fresh or os.environ.get("SHOAL_FRESH")) and (found := _read(file)) is not None:
        _reused.append(key)
        result: T = found[0]
        return result
    result = workers.run(function, *args, **kwargs)
    _write(file, result)
    return result


def reused() -> int:
    """Return the number of results of this process that were computed before."""
    return len(_reused)


@contextmanager
def recomputed() -> Iterator[None]:
    """Compute everything within the block."""
    global _fresh
    before, _fresh = _fresh, True
    try:
        yield
    finally:
        _fresh = before


def folder() -> Path:
    """Return the folder of results, made on demand; write access to it allows running code. Raises InputError."""
    found = home() / "results"
    found.mkdir(mode=0o700, exist_ok=True)
    return found


def _read(file: Path) -> tuple[Any] | None:
    try:
        return (pickle.loads(file.read_bytes()),)
    except Exception:
        # There is none, or nobody can read it any more: it is computed again.
        return None


def _write(file: Path, result: Any) -> None:
    """At once: a process that is killed leaves a whole file or none."""
    handle, name = tempfile.mkstemp(dir=file.parent, prefix=_NEW)
    with os.fdopen(handle, "wb") as stream:
        _clear(file.parent, os.fstat(handle).st_mtime)
        pickle.dump(result, stream)
    os.replace(name, file)


def _clear(where: Path, now: float) -> None:
    """Remove what processes left that were killed while they wrote: what is older than a day; now [s]: the folder's."""
    for path in where.glob(f"{_NEW}*"):
        with suppress(FileNotFoundError):
            if now - path.stat().st_mtime > _DAY:
                path.unlink()
