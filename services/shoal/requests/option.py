"""Documentation and spelling of the fields of requests, beside their types."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

Front = Literal["python", "command", "study", "http", "form"]
"""Ways of asking: the function, the command line, the file of a study, the service, the flow."""
HERE: tuple[Front, ...] = ("python", "command", "study")
"""Of what only exists beside who asks, such as a file or an engine."""
EVERYWHERE: tuple[Front, ...] = (*HERE, "http", "form")


@dataclass(frozen=True)
class Option:
    """Documentation of a field, and its spelling.

    help: a sentence, with units; metavar: how the command line writes its value; many: whether that takes one entry at
    a time; old: its name until the release before; names: kind of names that it takes (see `shoal.choices`); shown: its
    type for readers, where the annotation does not tell it; fronts: where it is offered; text: what it makes of a value
    on the command line or in a study's file (raises ValueError); bare: the value of an option that is given without one
    """

    help: str
    metavar: str = ""
    many: bool = False
    old: str = ""
    names: str = ""
    shown: str = ""
    fronts: tuple[Front, ...] = EVERYWHERE
    text: Callable[[Any], Any] | None = None
    bare: str = ""
