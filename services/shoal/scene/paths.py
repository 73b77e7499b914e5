"""Fields of a scene by dotted path: keys, components, and a copy with lanes in place of a number."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from shoal.errors import InputError
from shoal.scene.initial import Begin, InitialState
from shoal.scene.record import Record


def with_lanes(place: Any, path: list[str], lanes: npt.NDArray[np.float64]) -> Any:
    """A copy of what a scene holds, with an array of a number by lane at a path, unchecked."""
    head, *rest = path
    if isinstance(place, tuple):
        return tuple(lanes if k == int(head) else entry for k, entry in enumerate(place))
    if isinstance(place, Mapping):
        inner = place.get(head, InitialState())
        return {**place, head: with_lanes(inner, rest, lanes)}
    inside = getattr(place, head)
    if inside is None and head == "velocity":
        inside = (0.0, 0.0)
    value = with_lanes(inside, rest, lanes) if rest else lanes
    return place.model_copy(update={head: value})


def key(place: Any, part: str, path: str, parent: str) -> Any:
    """The key of a mapping, or the index of a vector's component. Raises InputError."""
    if isinstance(place, dict) and part in place:
        return part
    if isinstance(place, list | tuple) and part.isdecimal() and int(part) < len(place):
        return int(part)
    raise unknown(path, parent, place)


def unknown(path: str, parent: str, place: Any) -> InputError:
    """What to say of a path that leads nowhere."""
    if isinstance(place, Record):
        place = type(place).model_fields
    if isinstance(place, Begin):
        place = InitialState.model_fields
    if isinstance(place, list | tuple):
        place = {str(k): entry for k, entry in enumerate(place)}
    known = ", ".join(place) if isinstance(place, Mapping) else "nothing below it"
    return InputError(f"{path}: no such field; {parent or 'the scene'} has {known}")
