"""The library's results as JSON and back, to the last bit: what a service answers to `shoal.Client`.

What JSON has stays as it is. All else is an object whose key `@` says what it was: `array` (NumPy's own format, in
base64), `number` (not finite), `complex`, `tuple`, `pairs` (a mapping; any comes back as a dictionary, other sequences
as lists),
`distribution` (of scipy) or the class of this package that it is one of. Nothing is executed, and no class of another
package is made.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from enum import StrEnum
from pkgutil import resolve_name
from typing import Any

import numpy as np
from pydantic import BaseModel

KIND = "@"
_PACKAGE = __name__.partition(".")[0]


def packed(value: Any) -> Any:
    """A result as JSON. Raises TypeError for what cannot cross."""
    if value is None or type(value) in (bool, int, str):
        return value
    if isinstance(value, float) and not isinstance(value, np.generic):
        return value if np.isfinite(value) else {KIND: "number", "is": repr(value)}
    if isinstance(value, complex) and not isinstance(value, np.generic):
        return {KIND: "complex", "is": [packed(value.real), packed(value.imag)]}
    if isinstance(value, np.ndarray | np.generic):
        file = io.BytesIO()
        np.save(file, np.asarray(value), allow_pickle=False)
        return {
            KIND: "array",
            "is": base64.b64encode(file.getvalue()).decode(),
            "scalar": isinstance(value, np.generic),
        }
    if isinstance(value, Sequence) and not isinstance(value, tuple | str):
        return [packed(one) for one in value]
    if type(value) is tuple:
        return {KIND: "tuple", "is": [packed(one) for one in value]}
    if isinstance(value, Mapping):
        if all(type(key) is str for key in value) and KIND not in value:
            return {key: packed(one) for key, one in value.items()}
        return {KIND: "pairs", "is": [[packed(key), packed(one)] for key, one in value.items()]}
    return _of_class(value)


def _of_class(value: Any) -> Any:
    kind = type(value)
    named = {KIND: f"{kind.__module__}:{kind.__qualname__}"}
    if kind.__module__.startswith("scipy.stats.") and hasattr(value, "dist"):
        return {KIND: "distribution", "name": value.dist.name, "is": packed((value.args, value.kwds))}
    if not kind.__module__.startswith(f"{_PACKAGE}."):
        raise TypeError(f"{kind.__module__}.{kind.__qualname__} does not cross")
    if isinstance(value, StrEnum):
        return {**named, "is": str(value)}
    if isinstance(value, BaseModel):
        return {**named, "is": packed(value.model_dump(mode="json", exclude_unset=True))}
    if is_dataclass(value):
        return {**named, "is": {one.name: packed(getattr(value, one.name)) for one in fields(value)}}
    if isinstance(value, tuple) and hasattr(value, "_fields"):
        return {**named, "is": {name: packed(one) for name, one in zip(value._fields, value, strict=True)}}
    raise TypeError(f"{kind.__module__}.{kind.__qualname__} does not cross")


def unpacked(found: Any) -> Any:
    """Return the value that `packed` was given; JSON without its marks stays as it is. Raises ValueError."""
    if isinstance(found, list):
        return [unpacked(one) for one in found]
    if not isinstance(found, dict):
        return found
    if KIND not in found:
        return {key: unpacked(one) for key, one in found.items()}
    try:
        kind = str(found[KIND])
        return _KNOWN.get(kind, _as_class)(found)
    except (KeyError, TypeError, AttributeError, ImportError) as error:
        raise ValueError(f"{found[KIND]}: {type(error).__name__}: {error}") from None


def _array(found: dict[str, Any]) -> Any:
    array = np.load(io.BytesIO(base64.b64decode(found["is"], validate=True)), allow_pickle=False)
    return array[()] if found["scalar"] else array


def _distribution(found: dict[str, Any]) -> Any:
    from scipy import stats

    kind = getattr(stats, found["name"])
    if not isinstance(kind, stats.rv_continuous | stats.rv_discrete):
        raise TypeError("no distribution")
    args, keywords = unpacked(found["is"])
    return kind(*args, **keywords)


def _as_class(found: dict[str, Any]) -> Any:
    module, _, name = found[KIND].partition(":")
    if not module.startswith(f"{_PACKAGE}.") or not name.isidentifier():
        raise TypeError("no class of this package")
    kind, content = resolve_name(found[KIND]), unpacked(found["is"])
    if not isinstance(kind, type) or kind.__module__ != module:
        raise TypeError("no class of this package")
    if issubclass(kind, StrEnum):
        return kind(content)
    if issubclass(kind, BaseModel):
        return kind.model_validate(content)
    if is_dataclass(kind) or issubclass(kind, tuple):
        return kind(**content)
    raise TypeError("no class that crosses")


_KNOWN: dict[str, Callable[[dict[str, Any]], Any]] = {
    "array": _array,
    "number": lambda found: float(found["is"]),
    "complex": lambda found: complex(*unpacked(found["is"])),
    "tuple": lambda found: tuple(unpacked(found["is"])),
    "pairs": lambda found: {unpacked(key): unpacked(one) for key, one in found["is"]},
    "distribution": _distribution,
}
