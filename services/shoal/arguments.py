"""Limits of arguments: numbers and lists of numbers, as library, command line and services check them.

The fields of requests state theirs as `Limit`, from which help, messages and schemas follow; others call `check`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any

from shoal.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

_LONGEST = 60
"""Characters of a value that a message shows."""


@dataclass(frozen=True)
class Limit:
    """A finite number. gt, ge, lt, le: its bounds, named as in Python's operator module; whole: whether an integer.

    what: in words; unit: of its bounds
    """

    what: str = "a number"
    unit: str = ""
    gt: float | None = None
    ge: float | None = None
    lt: float | None = None
    le: float | None = None
    whole: bool = False

    @property
    def bounds(self) -> dict[str, Any]:
        """Those there are."""
        return {name: bound for name, bound in asdict(self).items() if name in _WORDS and bound is not None}

    def holds(self, value: Any) -> bool:
        """Return whether a value is such a number; true, false, texts and arrays are none."""
        if not isinstance(value, Integral if self.whole else Real) or isinstance(value, bool):
            return False
        return math.isfinite(value) and all(_HOLDS[name](value, bound) for name, bound in self.bounds.items())

    def read(self, value: Any) -> Any:
        """Return a value as a number of Python's. Raises ValueError that says what would be right."""
        if value is None:
            return None
        if not self.holds(value):
            raise ValueError(f"needs {self}, found {brief(value)}")
        return int(value) if self.whole else float(value)

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        from pydantic_core import core_schema

        return core_schema.no_info_before_validator_function(self.read, handler(source))

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> dict[str, Any]:
        names = {"gt": "exclusiveMinimum", "ge": "minimum", "lt": "exclusiveMaximum", "le": "maximum"}
        return {**handler(schema), **{names[name]: bound for name, bound in self.bounds.items()}}

    def __str__(self) -> str:
        bounds = " and ".join(f"{_WORDS[name]} {bound:g}" for name, bound in self.bounds.items())
        return " ".join(filter(None, (self.what, bounds, self.unit)))


_WORDS = {"gt": "above", "ge": "of at least", "lt": "below", "le": "of at most"}
_HOLDS = {
    "gt": lambda value, bound: value > bound,
    "ge": lambda value, bound: value >= bound,
    "lt": lambda value, bound: value < bound,
    "le": lambda value, bound: value <= bound,
}

LIMITS = {
    "bootstrap": Limit("a whole number", ge=0, whole=True),
    "count": Limit("a whole number", ge=1, whole=True),
    "sample": Limit("a whole number", ge=0, whole=True),
    "seed": Limit("a whole number", ge=0, whole=True),
    "time": Limit("a time", "s", ge=0),
    "time_limit": Limit("a time", "s", gt=0),
    "tolerance": Limit("a length", "m", gt=0),
}
"""Of arguments that mean the same wherever they are taken."""


def check(**given: Any) -> None:
    """Arguments of `LIMITS` by name, None for those that are left out. Raises InputError that names the first wrong."""
    for name, value in given.items():
        if value is not None and not LIMITS[name].holds(value):
            raise InputError(f"{name}: needs {LIMITS[name]}, found {brief(value)}")


def check_apart(values: Any, varied: Iterable[str]) -> None:
    """Raises InputError where a field that is varied is set to one value too, which would count nowhere.

    values: fields of a scene by path as a caller states them; what an estimate carries is none that is stated
    """
    for path in varied:
        if isinstance(values, Mapping) and path in values:
            raise InputError(f"{path}: is set to {brief(values[path])} and varied as well; state one of the two")


def one_of(name: str, value: Any, known: tuple[str, ...]) -> None:
    """Raises InputError where a value is none of the names there are."""
    if value not in known:
        raise InputError(f"{name}: needs one of {', '.join(known)}, found {brief(value)}")


def mapping(name: str, given: Any, what: str) -> Mapping[Any, Any]:
    """A mapping of one or more entries. Raises InputError; what: they are, in words."""
    if not isinstance(given, Mapping) or not given:
        raise InputError(f"{name}: needs a mapping of one or more {what}, found {brief(given)}")
    return given


def numbers(name: str, given: Any, what: str = "numbers") -> npt.NDArray[np.float64]:
    """A list of one or more finite real numbers as an array of its own. Raises InputError; what: they are, in words."""
    import numpy as np

    try:
        found = np.asarray(given)
    except ValueError:  # lists of different lengths
        found = np.array(given, dtype=object)
    right = found.ndim == 1 and found.size > 0 and found.dtype.kind in "iuf" and not np.ma.is_masked(given)
    if not (right and np.isfinite(found).all()):
        raise InputError(f"{name}: needs a list of one or more finite {what}, found {brief(given)}")
    return found.astype(float)


def brief(value: Any) -> str:
    """Return a value as a message shows it: its `repr` in one short line."""
    text = " ".join(repr(value.tolist() if hasattr(value, "tolist") else value).split())
    return text if len(text) <= _LONGEST else text[: _LONGEST - 3] + "..."
