"""Requests of a service, one for each function of the library, by its name.

The fields of a request are the arguments of that function. Quantities are in SI units, angles in radians. The service's
own process knows the requests only; `tasks` computes them.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from inspect import cleandoc
from typing import Annotated, Any, ClassVar, Self, TypeVar, get_args

from pydantic import BeforeValidator, Field, ModelWrapValidatorHandler, PrivateAttr, create_model, model_validator

from shoal.api.schemas import Asked, BuiltIn, Fields, Motion, Path, RecordingName, Table
from shoal.arguments import Limit
from shoal.errors import InputError
from shoal.requests import request_of
from shoal.requests.request import Field as FieldOfRequest
from shoal.requests.request import offered, renamed

Times = list[float]
Positive = Annotated[float, Field(gt=0)]
Some = Annotated[Times, Field(min_length=1)]
NUMBERS = r"^\s*[a-z-]+\s*\([-+0-9.eE,\s]*\)\s*$"
Distribution = Annotated[str, Field(max_length=200, pattern=NUMBERS)]
"""With numbers: files of the service are not read for anybody."""
End = float | Annotated[str, Field(max_length=30, pattern=r"^\s*[-+0-9.eE]+\s*%\s*$")]
Window = tuple[float, float]


def _known(given: Any) -> Any:
    """Say in one line what a text that is no distribution should be. Raises ValueError."""
    if isinstance(given, str) and not re.match(NUMBERS, given):
        raise ValueError(
            f"{given[:200]!r} is no distribution with numbers, such as normal(1,0.01); a service reads no files: "
            "observations are studied by `shoal uncertain --engine URL`, which reads them on its own side"
        )
    return given


Uncertainty = Annotated[tuple[End, End] | Distribution, BeforeValidator(_known)]


class Request(Asked):
    """Base of all requests. answer: type of the answer; follows: the numbers by which a job reports progress.

    objects: answer the whole object of the library's function, as `shoal.serialization` writes it for `shoal.Client`
    """

    answer: ClassVar[Any] = dict[str, Any]
    follows: ClassVar[tuple[str, ...]] = ()
    of: ClassVar[Any] = None

    objects: bool = False
    _notes: list[str] = PrivateAttr(default_factory=list)

    @model_validator(mode="wrap")
    @classmethod
    def _by_names_of_today(cls, given: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        notes = list[str]()
        if cls.of is not None and isinstance(given, dict):
            try:
                given = renamed(cls.of, given, notes.append)
            except InputError as error:
                raise ValueError(str(error)) from None
        found = handler(given)
        found._notes.extend(notes)
        return found

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on the request, which go with the answer."""
        return tuple(self._notes)

    def arguments(self) -> dict[str, Any]:
        """Those of the library's function, as far as they are stated, without what names scenes and data."""
        beside = {"objects", "scene", "problem", "data", "set", "lanes"}
        return self.model_dump(exclude=beside, exclude_unset=True)


TIGHTER = {"seed": 2**32 - 1, "bootstrap": 10_000, "sample": 100_000, "runs": 20_000, "limit_runs": 20_000}
"""The largest numbers that this service takes, by field."""
RUNS = 2_000
"""Most runs of an uncertain response where the request does not say: a service admits scenes by the runs that they may
take, and with the library's 20,000 it would refuse all but the smallest."""
R = TypeVar("R", bound=Request)


def of(name: str, **defaults: Any) -> Callable[[type[R]], type[R]]:
    """Give a body the fields of a request, but for those that it states itself. defaults: those of the service."""

    def made(body: type[R]) -> type[R]:
        kind = request_of(name)
        stated = {
            field: (_typed(one), ... if one.required else defaults.get(field, one.default))
            for field, one in offered(kind, "http").items()
            if field not in body.model_fields
        }
        about = cleandoc(kind.__doc__ or "")
        make: Any = create_model
        found: type[R] = make(body.__name__, __base__=body, __module__=body.__module__, __doc__=about, **stated)
        found.of = kind
        return found

    return made


def _typed(one: FieldOfRequest) -> Any:
    kind, limit = one.type, one.limit
    if limit is not None and one.name in TIGHTER:
        number: Any = Annotated[int if limit.whole else float, replace(limit, le=TIGHTER[one.name])]
        kind = number | None if type(None) in get_args(kind) else number
    return Annotated[kind, Field(description=one.option.help)]


class OfScene(Request):
    """A scene (a name, or an object as /v1/schemas/scene describes it). set: fields of it, by path."""

    scene: BuiltIn | dict[str, Any]
    set: Fields = {}

    @property
    def instants(self) -> Times | None:
        """When it is looked at [s]; None is its own times."""
        return getattr(self, "at", None)

    @property
    def varied(self) -> dict[str, Times]:
        """Axes of a grid over which it is computed."""
        return {}

    @property
    def work(self) -> int:
        """Return the number of runs, about."""
        return 1


class OfProblem(Request):
    """A problem (a name, or an object as /v1/schemas/problem describes it). set: fields of its scene.

    The `scene` of a problem is a name, or an object. data: by the names of the problem's recordings, `recording` where
    it has but one source; each a table, or the name of one in the library. measured: whether none may be missing
    """

    measured: ClassVar[bool] = False

    problem: BuiltIn | dict[str, Any]
    data: dict[RecordingName, Table | BuiltIn] = {}
    set: Fields = {}


@of("simulate")
class Simulate(OfScene):
    """The motion of a scene, or of one per lane: lanes: path -> one number per lane."""

    answer: ClassVar[Any] = Motion

    lanes: dict[Path, Times] | None = None


@of("select")
class Select(OfScene):
    """The cheapest model within a tolerance."""


@of("sweep")
class Sweep(OfScene):
    """Marker positions at one instant over a grid."""

    vary: Annotated[dict[Path, Some], Field(min_length=1)]
    at: Annotated[float, Limit("a time", "s", ge=0)] | None = None

    @property
    def instants(self) -> Times | None:
        """When it is looked at [s]; None is its own times."""
        return None if self.at is None else [self.at]

    @property
    def varied(self) -> dict[str, Times]:
        """Axes of a grid over which it is computed."""
        return self.vary


@of("uncertain", runs=RUNS)
class Uncertain(OfScene):
    """Bounds and statistics of the markers."""

    follows: ClassVar[tuple[str, ...]] = ("runs",)

    vary: Annotated[dict[Path, Uncertainty], Field(min_length=1, max_length=100)]
    correlate: Annotated[list[tuple[Path, Path, float]], Field(max_length=1000)] = []
    method: BuiltIn = "auto"
    limit: Annotated[list[Annotated[str, Field(max_length=200)]], Field(max_length=10)] = []
    require: Annotated[list[Annotated[str, Field(max_length=200)]], Field(max_length=10)] = []
    limit_method: BuiltIn = "auto"
    cost: dict[Path, Positive] | None = None

    @property
    def work(self) -> int:
        """Return the number of runs that may be made, about."""
        allocated = 4 * bool(getattr(self, "allocate", False))
        runs, limit_runs = (int(getattr(self, name)) for name in ("runs", "limit_runs"))
        return runs + (len(self.limit) + len(self.require) + allocated) * limit_runs


class AtRest(OfScene):
    """Base of analyses without a motion."""

    @property
    def instants(self) -> Times | None:
        """The start."""
        return [0.0]


@of("statics")
class Statics(AtRest):
    """Static equilibrium of a scene."""


@of("modes")
class Modes(AtRest):
    """The lowest eigenfrequencies of a scene and their shapes."""

    count: Annotated[int, Limit("a whole number", ge=1, le=1000, whole=True)] = 10
    speeds: Annotated[list[Annotated[float, Field(ge=0)]], Field(min_length=1, max_length=1000)] | None = None


@of("linearize")
class Linearize(AtRest):
    """A linear model for the design of controllers."""


@of("reactions")
class Reactions(OfScene):
    """Forces and torques in the joints."""


@of("export")
class Export(OfScene):
    """A scene as the `text` of a file of another tool."""

    @property
    def work(self) -> int:
        """Here and, to compare, there."""
        return 2 if getattr(self, "verify", True) else 1


@of("identify")
class Identify(OfProblem):
    """The parameters of a problem from measured motion."""

    measured: ClassVar[bool] = True
    follows: ClassVar[tuple[str, ...]] = ("iteration", "best", "mean", "evaluations")

    method: BuiltIn | None = None
    hold_out: list[Window] | dict[RecordingName, list[Window]] | None = None


@of("design")
class Design(OfProblem):
    """Optimal experiment design for the parameters."""

    sensor_noise: dict[str, Positive] | None = None
    parameter: BuiltIn | None = None


OPERATIONS: dict[str, type[Request]] = {
    "simulate": Simulate,
    "select": Select,
    "sweep": Sweep,
    "uncertain": Uncertain,
    "statics": Statics,
    "modes": Modes,
    "linearize": Linearize,
    "reactions": Reactions,
    "export": Export,
    "identify": Identify,
    "design": Design,
}
