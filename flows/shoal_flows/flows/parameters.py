"""The types of the flows' parameters, with the choices that Prefect's form offers.

The choices are advice to the form: beside the names of scenes, problems and recordings it has a field for YAML, a path
or an address. What is given is checked by who uses it. What a parameter means stands in the docstring of its flow,
from where Prefect takes it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import wraps
from inspect import Parameter, Signature, cleandoc
from types import MappingProxyType
from typing import Annotated, Any, NamedTuple, Self, TypeVar

import numpy as np
from pydantic import AfterValidator, BaseModel, BeforeValidator, Field, WithJsonSchema, model_validator
from shoal.engines import ENGINES
from shoal.errors import InputError
from shoal.identification.methods import METHODS
from shoal.requests import request_of
from shoal.requests.request import offered, read
from shoal.trajectory import Array
from shoal_validation.nightly.plan import IDENTIFICATION
from shoal_validation.problems import PROBLEMS

from shoal_flows.choices import LIBRARY, MARK, library, names
from shoal_flows.exports import FORMS
from shoal_flows.inputs import held


def _one_of(names: Iterable[str]) -> Any:
    return Field(json_schema_extra={"enum": list(names)})


def _named(kind: str, own: str) -> Any:
    """A text, or one of the names of a kind. The form shows a field of many lines, and a list that fills it.

    The field stands first: some of Prefect's forms return to the first that a text fits whenever it is changed.
    """
    listed = {"type": "string", "title": "by name", "enum": names(kind), MARK: kind, LIBRARY: library()}
    return WithJsonSchema({"anyOf": [{"type": "string", "title": own}, listed]})


SceneName = Annotated[str, _named("scenes", "name, YAML, path or address")]
ProblemName = Annotated[str, _named("problems", "name, YAML, path or address")]
StudyName = Annotated[str, _named("studies", "name, YAML, path or address")]
Data = Annotated[str, _named("recordings", "name, path or address")]


def _different(given: list[Any]) -> list[Any]:
    if twice := [one for k, one in enumerate(given) if one in given[:k]]:
        raise ValueError(f"{twice[0]} is given twice, and would be computed twice")
    return given


EngineName = Annotated[str, _one_of(ENGINES)]
Engines = Annotated[list[EngineName], Field(min_length=2, json_schema_extra={"uniqueItems": True})]
Methods = Annotated[list[Annotated[str, _one_of(METHODS)]], Field(min_length=1), AfterValidator(_different)]
Forms = Annotated[list[Annotated[str, _one_of(FORMS)]], Field(min_length=1, json_schema_extra={"uniqueItems": True})]
Seeds = Annotated[list[int], Field(min_length=1), AfterValidator(_different)]
Values = dict[str, Any]
ALL = "all"
Only = Annotated[
    str,
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "string", "title": "name, also of a scene of the library"},
                {"type": "string", "title": "built in", "enum": [ALL, *PROBLEMS, *IDENTIFICATION]},
            ]
        }
    ),
]


def spans(text: str) -> list[tuple[float, float]]:
    """Windows [s] as a form takes them, `0.3 to 0.4, 0.7 to 0.8`. Raises InputError."""
    found = []
    for part in filter(None, map(str.strip, text.split(","))):
        try:
            low, high = map(float, part.split(" to "))
        except ValueError:
            low, high = np.nan, np.nan
        if not low < high < np.inf:
            raise InputError(f"hold_out: needs windows such as 0.3 to 0.4, found {part!r}")
        found.append((low, high))
    return found


class Axis(BaseModel):
    """One value to vary, evenly from low to high."""

    path: str = Field(title="field of the scene", description="Such as initial.OA.angle, in SI units.")
    low: float = Field(title="from")
    high: float = Field(title="to")
    count: int = Field(title="how many", ge=1)

    @model_validator(mode="after")
    def _both_ends(self) -> Self:
        if self.count == 1 and self.low != self.high:
            raise ValueError(f"{self.path}: one value is not at both ends; count is 2 or more, or high is low")
        return self

    def values(self) -> Array:
        """All of them, (count,)."""
        return np.linspace(self.low, self.high, self.count)


def _axes(given: Any) -> Any:
    """Axes as {path: [low, high, count]}, the short form of the command line, as the list of the form."""
    if not isinstance(given, Mapping):
        return given
    for path, span in given.items():
        if not (isinstance(span, list | tuple) and len(span) == 3):
            raise ValueError(f"{path}: needs [low, high, count], found {span!r}")
    return [{"path": path, "low": low, "high": high, "count": count} for path, (low, high, count) in given.items()]


def _once_each(axes: list[Axis]) -> list[Axis]:
    paths = [axis.path for axis in axes]
    if twice := next((path for path in paths if paths.count(path) > 1), None):
        raise ValueError(f"{twice} is varied twice")
    return axes


Axes = Annotated[list[Axis], BeforeValidator(_axes), Field(min_length=1), AfterValidator(_once_each)]

R = TypeVar("R")
TYPES: dict[str, Any] = {
    **{"scene": SceneName, "problem": ProblemName, "data": Data, "engine": EngineName, "engines": Engines | None},
    **{"set": Values, "vary": Axes, "hold_out": str, "sensor_noise": dict[str, float]},
}
"""Types of fields that a form shows otherwise than a function."""
ABSENT: dict[str, Any] = {"set": {}, "data": "", "hold_out": "", "sensor_noise": {}}
"""What a form shows for fields that are not stated, where that is not nothing."""
HELD = {"scene": "scenes", "problem": "problems", "data": "recordings"}
"""Fields that name entries of the library, by its kinds; a run keeps a copy of each."""
READ: dict[str, Callable[[Any], Any]] = {
    "vary": lambda axes: {axis.path: axis.values() for axis in axes},
    "hold_out": spans,
}
"""From what a form holds to the value of a field."""


class Own(NamedTuple):
    """A parameter of a flow that no field of its request states: its type, default and meaning."""

    type: Any
    default: Any
    help: str


def form(
    name: str, *, without: tuple[str, ...] = (), own: Mapping[str, Own] = MappingProxyType({}), **defaults: Any
) -> Callable[[Callable[..., R]], Callable[..., R]]:
    """Make the function of a flow whose parameters are the fields of a request.

    without: fields that the flow states by parameters of its `own`; defaults: those of the form
    """
    kind = request_of(name)
    shown = {field: one for field, one in offered(kind, "form").items() if field not in without}
    stated = {
        field: Own(TYPES.get(field, one.type), defaults.get(field, ABSENT.get(field, one.default)), one.option.help)
        for field, one in shown.items()
    } | dict(own)

    parameters = Signature(
        [
            Parameter(field, Parameter.POSITIONAL_OR_KEYWORD, default=one.default, annotation=one.type)
            for field, one in stated.items()
        ]
    )

    def made(function: Callable[..., R]) -> Callable[..., R]:
        @wraps(function)
        def asked(*args: Any, **kwargs: Any) -> R:
            given = dict(parameters.bind(*args, **kwargs).arguments)
            beside = {field: given.pop(field, one.default) for field, one in own.items()}
            for field in HELD.keys() & given.keys():
                given[field] = held(field, HELD[field], given[field])
            filled = {field: value for field, value in given.items() if value not in (None, "") or field in defaults}
            found = {field: READ.get(field, lambda value: value)(value) for field, value in filled.items()}
            return function(read(kind, found), **beside)

        meaning = "\n".join(f"    {field}: {one.help}" for field, one in stated.items())
        asked.__dict__.update(__signature__=parameters, request=kind)
        asked.__doc__ = f"{cleandoc(function.__doc__ or '')}\n\nArgs:\n{meaning}\n"
        return asked

    return made
