"""The frozen base of everything a user writes, and the scalar types its fields share."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from difflib import get_close_matches
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, get_args

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
    model_validator,
)
from pydantic_core import InitErrorDetails

from shoal.errors import InputError

_MAY_HOLD_TRUTH = (bool, dict, list, tuple)


def _formula(given: Any) -> Any:
    """Return the text of a number; anything else as it is given."""
    return repr(given) if type(given) in (int, float) else given


Formula = Annotated[str, BeforeValidator(_formula)]
"""A formula of measures and signals, or a number."""


class Base(BaseModel):
    """Base of input models: true and false (in YAML also yes, no, on, off) are refused in place of a number."""

    @model_validator(mode="before")
    @classmethod
    def _no_truth(cls, given: Any) -> Any:
        for name, value in given.items() if isinstance(given, dict) else ():
            if isinstance(value, _MAY_HOLD_TRUTH) and name in _numbers(cls) and _holds_truth(value):
                error = InitErrorDetails(type="float_type", loc=(name,), input=value)
                raise ValidationError.from_exception_data(cls.__name__, [error])
        return given


@cache
def _numbers(model: type[BaseModel]) -> frozenset[str]:
    """The fields of a model that hold numbers and neither flags nor other models, which look after themselves."""
    held = {name: set(_scalars(field.annotation)) for name, field in model.model_fields.items()}
    numbers = (name for name, kinds in held.items() if kinds & {int, float} and bool not in kinds)
    return frozenset(model.model_fields[name].alias or name for name in numbers)


def _scalars(annotation: Any) -> Iterator[Any]:
    """Yield the scalar types that a type is made of."""
    if parts := get_args(annotation):
        for part in parts:
            yield from _scalars(part)
    else:
        yield annotation


def _holds_truth(given: Any) -> bool:
    """Return whether a value is, or has among its parts, true or false."""
    parts = given.values() if isinstance(given, dict) else given if isinstance(given, list | tuple) else ()
    return isinstance(given, bool) or any(map(_holds_truth, parts))


class Record(Base):
    """An immutable description in SI units; unknown fields and non-finite numbers are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


def _plausible_angle(value: float) -> float:
    if abs(value) > 4 * math.pi:
        raise ValueError("an angle is in radians, between -4 pi and 4 pi (is this in degrees?)")
    return value


Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]
Angle = Annotated[float, AfterValidator(_plausible_angle)]
if TYPE_CHECKING:
    Vector = tuple[float, float]  # what computes in the plane unpacks two
else:
    Vector = Annotated[tuple[float, ...], Field(min_length=2, max_length=3)]
"""Two components, in space three; where the third is left out it is zero."""
Vector3 = tuple[float, float, float]


def _letter(given: Any) -> Any:
    units = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
    if isinstance(given, str) and given not in units:
        raise ValueError(f"an axis has three components, such as [1, 0, 0], or is x, y or z; found {given!r}")
    if isinstance(given, list | tuple) and len(given) == 2:
        in_plane = "in the plane the line of a slider is its `direction`, an angle [rad]"
        raise ValueError(f"an axis is of space and has three components; {in_plane}; found {list(given)}")
    return units[given] if isinstance(given, str) else given


def _pointing(value: Vector3) -> Vector3:
    if not any(value):
        raise ValueError("an axis needs a direction, found [0, 0, 0]")
    return value


Axis = Annotated[Vector3, BeforeValidator(_letter), AfterValidator(_pointing)]
"""A direction in space, of any length; x, y and z stand for the unit vectors."""


def kinds(annotation: Any) -> tuple[str, ...]:
    """The kinds of the records that a type is made of, in their order."""
    return tuple(one.model_fields["kind"].default for one in records(annotation) if "kind" in one.model_fields)


_MEMBER = re.compile(r"constrained-|tuple\[|float$|str$|function-")
"""How pydantic names a member of a union in a path."""
_WORDS = {
    "tuple_type": "needs a list",
    "too_long": "has {actual_length} entries, where at most {max_length} belong",
    "union_tag_not_found": "needs a kind{of}",
    "union_tag_invalid": "no kind is called {tag}; there are {expected_tags}",
    "float_type": "needs a number",
    "float_parsing": "needs a number",
    "int_type": "needs a whole number",
    "int_parsing": "needs a whole number",
    "int_from_float": "needs a whole number",
    "dict_type": "needs entries with names",
    "model_type": "needs entries with names",
    "model_attributes_type": "needs entries with names",
}
"""What pydantic's errors of a type are called."""
_TOLD = ("missing", "value_error", "union_tag_invalid")
"""Errors whose message holds the value, or that have none."""


def records(annotation: Any) -> tuple[type[Record], ...]:
    """The records that a type is made of, in their order."""
    if isinstance(annotation, type) and issubclass(annotation, Record):
        return (annotation,)
    return tuple(record for part in get_args(annotation) for record in records(part))


def one_line(error: ValidationError, what: str, model: type[Record] | None = None) -> InputError:
    """Turn pydantic's report on a model into one line that names the field, the value and what is right."""
    first = error.errors()[0]
    if first["type"] == "missing":
        # A field that is written wrongly is missing; its name as it is written tells more.
        beside = (one for one in error.errors() if one["loc"][:-1] == first["loc"][:-1])
        first = next((one for one in beside if one["type"] == "extra_forbidden"), first)
    path, message = _path(first, model), first["msg"].removeprefix("Value error, ")
    found = "" if first["type"] in _TOLD and not _lacks(first) else f", found {_short(first['input'])}"
    if first["type"] == "extra_forbidden":
        message, found = f"no such field{found}{_there_are(first['loc'], model)}", ""
    elif _lacks(first):
        message = "has too few numbers"
    elif first["type"] in _WORDS:
        field = model.model_fields.get(str(first["loc"][0])) if model and first["loc"] else None
        of = f", one of {', '.join(kinds(field.annotation))}" if field else ""
        message = _WORDS[first["type"]].format(of=of, **first.get("ctx", {}))
    if first["type"] == "string_type" and any("tuple[" in str(one["loc"]) for one in error.errors()):
        message = "needs a name, or a list of two or three numbers"
    others = len({_path(one, model) for one in error.errors()}) - 1
    more = f" (and {others} more)" if others else ""
    return InputError(f"{what}: {path + ': ' if path else ''}{message}{found}{more}")


def _lacks(error: Any) -> bool:
    """Return whether a list is too short."""
    return error["type"] == "missing" and isinstance(error["loc"][-1], int)


def _there_are(path: tuple[int | str, ...], model: type[Record] | None) -> str:
    """The fields that there are in the place of one that there is not; empty where that is not known."""
    here = [model] if model else []
    for part in map(str, path[:-1]):
        if fields := [record.model_fields[part] for record in here if part in record.model_fields]:
            here = [record for field in fields for record in records(field.annotation)]
        elif of_kind := [record for record in here if kinds(record) == (part,)]:
            here = of_kind
    names = list(dict.fromkeys(field.alias or name for record in here for name, field in record.model_fields.items()))
    if near := get_close_matches(str(path[-1]), names, 1):
        return f"; did you mean {near[0]}?"
    return f"; there are {', '.join(names)}" if names else ""


def _path(error: Any, model: type[Record] | None) -> str:
    """Return the path of an error as a user writes it; of a list that is too short the list itself."""
    parts = [str(part) for part in error["loc"][: -1 if _lacks(error) else None]]
    field = model.model_fields.get(parts[0]) if model and parts[2:] else None
    # Pydantic puts the kind that tells the members of a field apart into the path, after the member's name.
    if field and parts[2] in kinds(field.annotation):
        del parts[2]
    return ".".join(part for part in parts if part not in {"file", "engine"} and not _MEMBER.match(part))


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
