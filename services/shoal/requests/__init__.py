"""Requests: one frozen model for each command, from which every way to state it follows.

The fields of a model are the arguments of the function in `import shoal`, the options of the command line, the fields
of a study's file, of a service's body and of a flow's form. A new option is one line: its type, default and `Option`.
"""

from __future__ import annotations

from importlib import import_module  # noqa: TID251 - within this package, which no contract divides
from typing import Any

NAMES = (
    *("simulate", "select", "sweep", "compare", "uncertain"),
    *("statics", "modes", "linearize", "reactions", "export", "fmu"),
    *("identify", "design"),
)
"""Commands that have a request, which is the class of that name in the module of that name."""


def request_of(name: str) -> type[Any]:
    """Return the request of a command, imported on demand: pydantic takes longer than `shoal --help` may."""
    found: type[Any] = getattr(import_module(f"shoal.requests.{name}"), name.capitalize())
    return found
