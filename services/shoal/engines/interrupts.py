"""Ctrl-C during a call into a library that takes it for a failure of its own."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def interruptible() -> Iterator[None]:
    """Raise KeyboardInterrupt at the end of the block if it came within it.

    Exudyn and CasADi turn an interrupt in a callback into a RuntimeError, or ignore it. Only the main thread receives
    signals; in others, and where SIGINT is ignored, nothing is done.
    """
    usual = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(usual):
        yield
        return
    came = threading.Event()

    def hear(*signalled: Any) -> None:
        came.set()
        usual(*signalled)

    signal.signal(signal.SIGINT, hear)
    try:
        yield
    except Exception:
        if not came.is_set():
            raise
    finally:
        signal.signal(signal.SIGINT, usual)
    if came.is_set():
        raise KeyboardInterrupt
