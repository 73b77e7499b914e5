"""Validation of requests: from stated fields to a request, or to one line that names the wrong field."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache
from typing import Annotated, Any, NoReturn, TypeVar, get_args, get_origin

from pydantic import ConfigDict, ValidationError
from pydantic_core import PydanticCustomError, PydanticUndefined

from shoal.arguments import Limit, brief
from shoal.errors import InputError
from shoal.requests.option import Front, Option

STRICT = ConfigDict(extra="forbid", arbitrary_types_allowed=True)
"""Of the models of requests."""
Q = TypeVar("Q")
_NEEDED = {
    "bool_type": "true or false",
    "bool_parsing": "true or false",
    "string_type": "a text",
    "dict_type": "a mapping",
    "mapping_type": "a mapping",
    "list_type": "a list",
    "callable_type": "a function",
}
"""What is right where pydantic finds another type."""


@dataclass(frozen=True)
class Field:
    """A field of a request. type: its annotation; limit: of its number, if it is one."""

    name: str
    type: Any
    option: Option
    default: Any
    required: bool
    positional: bool

    @property
    def limit(self) -> Limit | None:
        """The limits of its number, if it is one."""
        return next((one for one in _metadata(self.type) if isinstance(one, Limit)), None)

    @property
    def flag(self) -> bool:
        """Return whether it is true or false."""
        return self.type is bool

    @property
    def choices(self) -> tuple[str, ...]:
        """The texts that it takes, if they are stated by its type."""
        return tuple(one for one in _literals(self.type) if isinstance(one, str))

    def read(self, value: Any) -> Any:
        """Return a value that stands on the command line or in a file. Raises ValueError."""
        if self.option.text is not None:
            return self.option.text(value)
        if self.limit is not None and isinstance(value, str):
            try:
                return int(value) if self.limit.whole else float(value)
            except ValueError:
                return value
        return value


@cache
def fields(request: Any) -> dict[str, Field]:
    """Return the fields of a request by name, those first that may be given without their name."""
    found = []
    for name, info in request.__pydantic_fields__.items():
        option = next(one for one in info.metadata if isinstance(one, Option))
        default = info.get_default(call_default_factory=True)
        required = default is PydanticUndefined
        beside = [one for one in info.metadata if one is not option]
        kind = Annotated[(info.annotation, *beside)] if beside else info.annotation
        found.append(Field(name, kind, option, None if required else default, required, not info.kw_only))
    return {one.name: one for one in sorted(found, key=lambda one: not one.positional)}


def offered(request: Any, front: Front) -> dict[str, Field]:
    """Return the fields that a way of asking has."""
    return {name: one for name, one in fields(request).items() if front in one.option.fronts}


def renamed(request: Any, given: Mapping[str, Any], say: Callable[[str], None]) -> dict[str, Any]:
    """Return what is given under the names of today; `say` is called for every name of the release before.

    Raises InputError.
    """
    found = dict(given)
    for name, one in fields(request).items():
        old = one.option.old
        # What is called so today is no mapping.
        if old not in given or (old in fields(request) and not isinstance(given[old], Mapping)):
            continue
        if name in given:
            raise InputError(f"{old}: is called {name} now, which is given too; state {name} alone")
        say(f"{old} is called {name} now; the old name goes with the next release")
        found[name] = found.pop(old)
    return found


def read(
    request: Callable[..., Q], given: Mapping[str, Any], *, named: Callable[[str], str] = str, text: bool = False
) -> Q:
    """Return the request that fields state. Raises InputError that names the first field that is wrong.

    named: how whoever asks writes the name of a field; text: whether values are as on a command line or in a file
    """
    values = dict(given)
    for name, one in fields(request).items() if text else ():
        if name in values:
            try:
                values[name] = one.read(values[name])
            except ValueError as error:
                raise InputError(f"{named(name)}: {error}") from None
    try:
        return request(**values)
    except ValidationError as error:
        raise InputError(_line(error, request, named)) from None


def wrong(field: str, text: str) -> NoReturn:
    """Refuse a field in view of another, within a request."""
    raise PydanticCustomError("wrong", "{text}", {"field": field, "text": text})


def _line(error: ValidationError, request: Any, named: Callable[[str], str]) -> str:
    every = error.errors()
    first = next((one for one in every if one["type"] == "unexpected_keyword_argument"), every[0])
    where = [str(part) for part in first["loc"]] or [str(first["ctx"]["field"])]
    name, found = where[0], brief(first["input"])
    head = ": ".join([named(name), *where[1:2]])
    if first["type"] == "unexpected_keyword_argument":
        near = get_close_matches(name, fields(request), 1)
        known = ", ".join(map(named, fields(request)))
        return f"{head}: no such field; " + (f"did you mean {named(near[0])}?" if near else f"there are {known}")
    if first["type"] in ("missing", "missing_argument"):
        return f"{head}: is missing; {fields(request)[name].option.help}"
    if first["type"] in ("wrong", "value_error"):
        return f"{head}: {first['msg'].removeprefix('Value error, ')}"
    if first["type"] == "literal_error":
        return f"{head}: needs one of {', '.join(fields(request)[name].choices)}, found {found}"
    return f"{head}: needs {_NEEDED.get(first['type'], 'another value')}, found {found}"


def _metadata(annotation: Any) -> Iterator[Any]:
    yield from getattr(annotation, "__metadata__", ())
    for part in get_args(annotation):
        yield from _metadata(part)


def _literals(annotation: Any) -> Iterator[Any]:
    for part in get_args(annotation):
        if get_args(part):
            yield from _literals(part)
        elif isinstance(part, str) and not get_origin(part):
            yield part
