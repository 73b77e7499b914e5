"""Lines of progress during compilation, and work before the first model; nothing heavy is imported."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

Note = Callable[[str], None]
"""Takes a line of text."""

_listening: list[Note] = []
_first: list[Callable[[], None]] = []


@contextmanager
def reporting_to(note: Note) -> Iterator[None]:
    """Pass `note` a line for every kernel that this process compiles meanwhile and that takes a second or more."""
    _listening.append(note)
    try:
        yield
    finally:
        _listening.remove(note)


def report(line: str) -> None:
    """Pass a line to all that `reporting_to` names."""
    for note in _listening:
        note(line)


def before_first_model(action: Callable[[], None]) -> None:
    """Register an action, in place of an earlier one, for when the first model is built: the input is valid then."""
    _first[:] = [action]


def begin() -> None:
    """Run the action of `before_first_model`, once; called where a model is about to be built."""
    while _first:
        _first.pop()()
