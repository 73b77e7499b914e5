"""Progress of a running flow for listeners in the same process: a line when work starts, when it ends, and notes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

Listener = Callable[[str, str], None]
"""Called with the name of the work and `started`, `done` or `failed`, or with a line and `note`; from any thread."""

_listeners: list[Listener] = []


@contextmanager
def listening(listener: Listener) -> Iterator[None]:
    """Let `listener` hear everything within the block."""
    _listeners.append(listener)
    try:
        yield
    finally:
        _listeners.remove(listener)


@contextmanager
def work(name: str) -> Iterator[None]:
    """Announce that the block runs, and how it ended."""
    _report(name, "started")
    try:
        yield
    except BaseException:
        _report(name, "failed")
        raise
    _report(name, "done")


def note(line: str) -> None:
    """Pass on a line that belongs to no work, or to what is within it."""
    _report(line, "note")


def _report(name: str, what: str) -> None:
    for listener in _listeners:
        listener(name, what)
