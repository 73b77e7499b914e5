"""Who wants to be told what is being compiled, and what is done before the first model; nothing heavy is imported."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

Note = Callable[[str], None]
"""Takes a line of text."""

_listening: list[Note] = []
_first: list[Callable[[], None]] = []


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


def before_models(action: Callable[[], None]) -> None:
    """Do this, in place of what was asked for before, when the first model is built: by then the input is right."""
    _first[:] = [action]


def begin() -> None:
    """A model is about to be built."""
    while _first:
        _first.pop()()
