"""A clock that stands still while kernels are compiled: what time limits are about, on any machine; nothing heavy."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

Hearer = Callable[[bool], None]
"""Told whether the clock stands still."""

_changing = threading.Lock()
_compiling, _since, _lost = 0, 0.0, 0.0
_hearers: list[Hearer] = []


def now() -> float:
    """Seconds since some instant in which this process compiled nothing, nor waited for another that did."""
    with _changing:
        return (_since if _compiling else time.monotonic()) - _lost


@contextmanager
def stopped() -> Iterator[None]:
    """Meanwhile it stands still, also where this is asked for again or by another thread."""
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
    """Meanwhile let somebody hear of each change."""
    _hearers.append(hear)
    try:
        yield
    finally:
        _hearers.remove(hear)
