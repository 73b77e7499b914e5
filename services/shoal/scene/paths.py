"""Fields of a scene by dotted path: keys, components, and a copy with lanes in place of a number."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from shoal.arguments import brief
from shoal.errors import InputError
from shoal.scene.function import Function
from shoal.scene.initial import Begin, InitialState
from shoal.scene.record import Record
from shoal.scene.sampled import INSTANTS, Sampled, SampledState

_VECTORS = (".rotation", ".spin")
"""Of a start in space."""


def parts(path: Any) -> list[str]:
    """The names along a dotted path. Raises InputError for what is no text."""
    if not isinstance(path, str):
        raise InputError(f"values: {path!r} is no dotted path of a field, such as initial.OA.angle")
    return path.split(".")


def unwrapped(value: Any) -> Any:
    """A value of a field with numbers and lists of Python in place of numpy's. Raises InputError for masked ones."""
    if isinstance(value, np.ndarray | np.generic):
        if np.ma.is_masked(value):
            raise InputError(f"values: a masked array is no value of a field, found {brief(value)}")
        return value.tolist()
    if isinstance(value, Mapping):
        return {name: unwrapped(one) for name, one in value.items()}
    return type(value)(unwrapped(one) for one in value) if type(value) in (list, tuple) else value


def with_lanes(place: Any, path: list[str], lanes: npt.NDArray[np.float64]) -> Any:
    """A copy of what a scene holds, with an array of a number by lane at a path, unchecked."""
    if not path:
        return lanes
    head, *rest = path
    if isinstance(place, tuple):
        return tuple(with_lanes(entry, rest, lanes) if k == int(head) else entry for k, entry in enumerate(place))
    if isinstance(place, Mapping):
        inner = place.get(head, InitialState())
        return {**place, head: with_lanes(inner, rest, lanes)}
    inside = getattr(place, head)
    if inside is None and head == "velocity":
        inside = (0.0, 0.0)
    return place.model_copy(update={head: with_lanes(inside, rest, lanes)})


def lanes_of(part: Any) -> int:
    """Number of lanes in a part of a scene with arrays in place of numbers; 0 if there are none."""
    if isinstance(part, np.ndarray):
        return part.size
    if isinstance(part, Record):
        return max((lanes_of(getattr(part, name)) for name in type(part).model_fields), default=0)
    if isinstance(part, Mapping):
        return max((lanes_of(one) for one in part.values()), default=0)
    return max((lanes_of(one) for one in part), default=0) if isinstance(part, tuple) else 0


def shared(place: Any, path: list[str]) -> bool:
    """Return whether lanes cannot differ in the number at a path: it lies in a function of time, in a list of
    lists, or among instants. They can in a signal that is a number.
    """
    for part, below in zip(path, [*path[1:], ""], strict=True):
        if isinstance(place, Mapping):
            place = place.get(part)
        elif isinstance(place, tuple):
            if below:
                return True
            place = place[int(part)]
        else:
            place = getattr(place, part, None)
        if isinstance(place, Sampled | SampledState) and below in INSTANTS:
            return True
        if isinstance(place, Function):
            return path != ["signals", part] or place.number is None
    return False


def key(place: Any, part: str, path: str, parent: str) -> Any:
    """The key of a mapping, or the index of a vector's component. Raises InputError."""
    if isinstance(place, dict) and part in place:
        return part
    if isinstance(place, list | tuple) and part.isdecimal() and int(part) < len(place):
        return int(part)
    raise unknown(path, parent, place)


def unknown(path: str, parent: str, place: Any) -> InputError:
    """Return the error for a path that does not exist."""
    if place is None and parent.startswith("initial.") and parent.endswith((".position", *_VECTORS)):
        whole = ", such as [0, 0, 0]" if parent.endswith(_VECTORS) else ""
        return InputError(f"{path}: {parent} is not stated, so it has no component to set; state it whole{whole}")
    if (part := path.split(".")[0]) in ("controllers", "actuators"):
        name, *gain = path.split(".")[1:] or ["NAME"]
        such = f"signals.{name}_{gain[0]}" if len(gain) == 1 else f"signals.{name}_kp and the like"
        return InputError(
            f"{path}: no such field; {part} are read as signals and states: set {such}, or state another one in the "
            "file of the scene"
        )
    if parent in ("signals", "states"):
        return InputError(
            f"{path}: no such field; {parent} has {', '.join(place or ()) or 'none'}; a new one is stated in the file "
            "of the scene"
        )
    if isinstance(place, Record):
        place = type(place).model_fields
    if isinstance(place, Begin):
        place = InitialState.model_fields
    if isinstance(place, list | tuple):
        place = {str(k): entry for k, entry in enumerate(place)}
    known = (", ".join(place) if isinstance(place, Mapping) else "") or "nothing below it"
    return InputError(f"{path}: no such field; {parent or 'the scene'} has {known}")
