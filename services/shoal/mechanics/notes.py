"""Who wants to be told what is being compiled; no part of the compiler is imported for it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

Note = Callable[[str], None]
"""Takes a line of text."""

_listening: list[Note] = []


@contextmanager
def telling(note: Note) -> Iterator[None]:
    """Meanwhile let `note` hear of every kernel that this process compiles and that takes a second or more."""
    _listening.append(note)
    try:
        yield
    finally:
        _listening.remove(note)


def tell(line: str) -> None:
    """Pass a line to all who listen."""
    for note in _listening:
        note(line)
