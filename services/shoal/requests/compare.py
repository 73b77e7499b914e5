"""The request for a scene on several engines."""

from __future__ import annotations

from dataclasses import KW_ONLY
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BeforeValidator
from pydantic.dataclasses import dataclass

from shoal.arguments import brief
from shoal.requests.fields import At, OfScene, Verify
from shoal.requests.option import Option
from shoal.requests.request import STRICT

if TYPE_CHECKING:
    from collections.abc import Sequence

_ENGINES = "Who simulates, two or more; else Shoal's own solver and at most two others that can run the scene."


def _names(given: Any) -> Any:
    if given is None or (isinstance(given, list | tuple) and given):
        return given
    raise ValueError(f"needs a list of one or more names, found {brief(given)}")


def _split(given: Any) -> Any:
    return [name.strip() for name in given.split(",")] if isinstance(given, str) else given


if TYPE_CHECKING:
    Engines = Sequence[str] | None
else:
    Engines = Annotated[
        list[str] | None,
        BeforeValidator(_names),
        Option(_ENGINES, "NAME,NAME,...", shown="Sequence[str] | None", text=_split),
    ]


@dataclass(frozen=True, config=STRICT)
class Compare(OfScene):
    """Run a scene on several engines, and say how far apart their motions are."""

    engines: Engines = None
    at: At = None
    _: KW_ONLY
    verify: Verify = True
