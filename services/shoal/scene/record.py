"""The frozen base of everything a user writes, and the scalar types its fields share."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Annotated, Any, get_args

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from shoal.errors import InputError


class Record(BaseModel):
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
    return units[given] if isinstance(given, str) else given


def _pointing(value: Vector3) -> Vector3:
    if not any(value):
        raise ValueError("an axis needs a direction, found [0, 0, 0]")
    return value


Axis = Annotated[Vector3, BeforeValidator(_letter), AfterValidator(_pointing)]
"""A direction in space, of any length; x, y and z stand for the unit vectors of the ground."""


def kinds(annotation: Any) -> tuple[str, ...]:
    """The kinds of the records that a type is made of, in their order."""
    if isinstance(annotation, type) and issubclass(annotation, Record):
        return (annotation.model_fields["kind"].default,) if "kind" in annotation.model_fields else ()
    return tuple(kind for part in get_args(annotation) for kind in kinds(part))


_MEMBER = re.compile(r"constrained-|tuple\[|float$|function-")
"""How pydantic names a member of a union in a path."""


def one_line(error: ValidationError, what: str, model: type[Record] | None = None) -> InputError:
    """Turn pydantic's report on a model into one line that names the field, the value and what is right."""
    first = error.errors()[0]
    parts = [str(part) for part in first["loc"]]
    field = model.model_fields.get(parts[0]) if model and parts[2:] else None
    # Pydantic puts the kind that tells the members of a field apart into the path, after the member's name.
    if field and parts[2] in kinds(field.annotation):
        del parts[2]
    path = ".".join(part for part in parts if part not in {"file", "engine"} and not _MEMBER.match(part))
    message = first["msg"].removeprefix("Value error, ")
    others = error.error_count() - 1
    more = f" (and {others} more)" if others else ""
    found = "" if first["type"] in ("missing", "value_error") else f", found {_short(first['input'])}"
    return InputError(f"{what}: {path + ': ' if path else ''}{message}{found}{more}")


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
