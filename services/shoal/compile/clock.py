"""A clock that stands still while kernels are compiled, for time limits; nothing heavy is imported."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

Hearer = Callable[[bool], None]
"""Takes whether the clock stands still."""

_changing = threading.Lock()
_compiling, _since, _lost = 0, 0.0, 0.0
_hearers: list[Hearer] = []


def now() -> float:
    """Return seconds since some instant, without those in which this process compiled or waited for a compilation."""
    with _changing:
        return (_since if _compiling else time.monotonic()) - _lost


@contextmanager
def stopped() -> Iterator[None]:
    """Stop the clock meanwhile; calls may be nested or come from several threads."""
    _change(1)
    try:
        yield
    finally:
        _change(-1)


def _change(by: int) -> None:
    global _compiling, _since, _lost
    with _changing:
        before, _compiling = _compiling, _compiling + by
        stops, goes = not before, not _compiling
        if stops:
            _since = time.monotonic()
        if goes:
            _lost += time.monotonic() - _since
        if stops or goes:
            for hear in _hearers:
                hear(stops)


@contextmanager
def heard(hear: Hearer) -> Iterator[None]:
    """Call `hear` at each stop and start meanwhile."""
    _hearers.append(hear)
    try:
        yield
    finally:
        _hearers.remove(hear)
