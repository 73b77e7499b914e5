"""Requests of a service, one for each function of the library, by its name.

The fields of a request are the arguments of that function. Quantities are in SI units, angles in radians. The service's
own process knows the requests only; `tasks` computes them.
"""

from __future__ import annotations

import re
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Field

from shoal.api.schemas import Asked, BuiltIn, Fields, Motion, Path, RecordingName, Table
from shoal.scene.record import limited

Times = list[float]
Positive = Annotated[float, Field(gt=0)]
Tolerance = Annotated[float, limited("tolerance")]
TimeLimit = Annotated[float, limited("time_limit")]
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

    objects: answer the whole object of the library's function, as `shoal.wire` writes it for `shoal.Client`
    """

    answer: ClassVar[Any] = dict[str, Any]
    follows: ClassVar[tuple[str, ...]] = ()

    objects: bool = False

    def arguments(self) -> dict[str, Any]:
        """Those of the library's function, as far as they are stated, without what names scenes and data."""
        return self.model_dump(exclude={"objects", "scene", "problem", "recordings", "values"}, exclude_unset=True)


class OfScene(Request):
    """A scene (a name, or an object as /v1/schemas/scene describes it). values: fields of it to set, by path."""

    scene: BuiltIn | dict[str, Any]
    values: Fields = {}

    @property
    def instants(self) -> Times | None:
        """When it is looked at [s]; None is its own times."""
        return getattr(self, "times", None)

    @property
    def varied(self) -> dict[str, Times]:
        """Axes of a grid over which it is computed."""
        return {}

    @property
    def runs(self) -> int:
        """Return the number of further runs."""
        return 1


class OfProblem(Request):
    """A problem (a name, or an object as /v1/schemas/problem describes it). values: fields of its scene to set.

    The `scene` of a problem is a name, or an object. recordings: by the problem's names, `recording` where it
    has but one source; each a table, or the name of one in the library. measured: whether none may be missing
    """

    measured: ClassVar[bool] = False

    problem: BuiltIn | dict[str, Any]
    recordings: dict[RecordingName, Table | BuiltIn] = {}
    values: Fields = {}


class Simulate(OfScene):
    """The motion of a scene, or of one per lane. A run that failed carries its status.

    times: sampling instants [s], else the scene's own; verify: estimate the errors by more careful runs
    tolerance: error [m] that the markers may have, for which the cheapest model is found
    lanes: path -> one number per lane; then one scene per lane is simulated
    """

    answer: ClassVar[Any] = Motion

    times: Times | None = None
    tolerance: Tolerance | None = None
    verify: bool = True
    lanes: dict[Path, Times] | None = None


class Select(OfScene):
    """The cheapest model whose estimated error at the markers is below a tolerance [m], with its motion."""

    tolerance: Tolerance
    times: Times | None = None


class Sweep(OfScene):
    """Marker positions at one instant `time` [s], the scene's end if not stated, over the full grid of `vary`.

    vary: path -> values; verify: estimate the errors at some of its points by more careful runs
    """

    vary: Annotated[dict[Path, Some], Field(min_length=1)]
    time: Annotated[float, limited("time")] | None = None
    verify: bool = True

    @property
    def instants(self) -> Times | None:
        """When it is looked at [s]; None is its own times."""
        return None if self.time is None else [self.time]

    @property
    def varied(self) -> dict[str, Times]:
        """Axes of a grid over which it is computed."""
        return self.vary


class Uncertain(OfScene):
    """Bounds and statistics of the markers if fields are intervals or distributions; see `shoal uncertain`.

    vary: path -> [low, high], or a text such as "normal(1, 0.01)"; a bound such as "-2%" is relative to the value of
    the scene; correlations: [path, path, value] of random ones; times: instants [s], else the scene's own; gap:
    between outer and attained bounds, as a share of the width, to be reached; tolerance: error [m] of the model
    verify: estimate mesh and step errors of extremal runs; most: runs that may be made
    limits: what must not happen, such as "B.y < -1.2"; requirements: what must hold, such as "B.y > -1.2";
    limit_method, limit_runs: for their probabilities
    allocate: look for the widest tolerances that keep the limit, with `costs` by path and the `target` probability
    time_limit: in s, after which it ends with what is known
    """

    follows: ClassVar[tuple[str, ...]] = ("runs",)

    vary: Annotated[dict[Path, Uncertainty], Field(min_length=1, max_length=100)]
    correlations: Annotated[list[tuple[Path, Path, float]], Field(max_length=1000)] = []
    times: Some | None = None
    method: BuiltIn = "auto"
    gap: Annotated[float, limited("gap")] | None = None
    tolerance: Tolerance | None = None
    verify: bool = True
    seed: Annotated[int, limited("seed", le=2**32 - 1)] = 0
    degree: Annotated[int, limited("degree")] | None = None
    count: Annotated[int, limited("count")] | None = None
    most: Annotated[int, limited("most", le=20_000)] = 2_000
    limits: Annotated[list[Annotated[str, Field(max_length=200)]], Field(max_length=10)] = []
    requirements: Annotated[list[Annotated[str, Field(max_length=200)]], Field(max_length=10)] = []
    limit_method: BuiltIn = "auto"
    limit_runs: Annotated[int, limited("limit_runs", le=20_000)] = 5_000
    allocate: bool = False
    costs: dict[Path, Positive] | None = None
    target: Annotated[float, limited("target")] = 1e-3
    time_limit: TimeLimit | None = None

    @property
    def runs(self) -> int:
        """Return the number of runs that may be made, about."""
        return self.most + (len(self.limits) + len(self.requirements) + 4 * self.allocate) * self.limit_runs

    def arguments(self) -> dict[str, Any]:
        """With correlations as the library has them."""
        found = super().arguments()
        if self.correlations:
            found["correlations"] = {(one, other): value for one, other, value in self.correlations}
        return found


class AtRest(OfScene):
    """Base of analyses without a motion. verify: estimate the mesh error by a second run on twice as many elements."""

    verify: bool = True

    @property
    def instants(self) -> Times | None:
        """The start."""
        return [0.0]


class Statics(AtRest):
    """Static equilibrium of a scene, with the loads at `time` [s], and its stability."""

    time: Annotated[float, limited("time")] = 0.0
    tolerance: Tolerance | None = None


class Modes(AtRest):
    """The `count` lowest eigenfrequencies and their shapes, about the equilibrium or the start.

    speeds: of the body that turns fastest [rad/s], for a Campbell diagram
    """

    count: Annotated[int, limited("count", le=1000)] = 10
    about: Literal["equilibrium", "start"] = "equilibrium"
    speeds: Annotated[list[Annotated[float, Field(ge=0)]], Field(min_length=1, max_length=1000)] | None = None


class Reactions(OfScene):
    """Forces and torques in the joints at `times` [s] of the motion. verify: estimate their errors by more runs."""

    times: Some
    verify: bool = True


class Export(OfScene):
    """A scene as the `text` of a file of another tool, `name`d, and the `distance` [m] between the motions.

    verify: whether it is run there and here
    """

    to: Literal["exudyn", "mjcf"]
    verify: bool = True

    @property
    def runs(self) -> int:
        """Here and, to compare, there."""
        return 2 if self.verify else 1


class Identify(OfProblem):
    """The parameters of a problem from measured motion; the fields are those of `shoal identify`. time_limit in s.

    hold_out: windows [from, to] [s] that are predicted instead of fitted; by name of several recordings
    """

    measured: ClassVar[bool] = True
    follows: ClassVar[tuple[str, ...]] = ("iteration", "best", "mean", "evaluations")

    method: BuiltIn | None = None
    seed: Annotated[int, limited("seed", le=2**32 - 1)] = 0
    tolerance: Tolerance | None = None
    time_limit: TimeLimit | None = None
    profiles: bool = False
    bootstrap: Annotated[int, limited("bootstrap", le=10_000)] = 0
    sample: Annotated[int, limited("sample", le=100_000)] = 0
    hold_out: list[Window] | dict[RecordingName, list[Window]] | None = None


class Design(OfProblem):
    """Optimal experiment design for the parameters; the fields are those of `shoal design`.

    about: `answer`, of an identification, or `start`, which needs no data; noise in m, angle_noise in rad, sensor_noise
    by what a sensor measures (acceleration, rate, force, torque, strain) in SI units, duration in s, rate in Hz
    """

    about: Literal["answer", "start"] | None = None
    noise: Positive | None = None
    angle_noise: Positive | None = None
    sensor_noise: dict[str, Positive] | None = None
    duration: Positive | None = None
    rate: Positive | None = None
    parameter: BuiltIn | None = None


OPERATIONS: dict[str, type[Request]] = {
    "simulate": Simulate,
    "select": Select,
    "sweep": Sweep,
    "uncertain": Uncertain,
    "statics": Statics,
    "modes": Modes,
    "reactions": Reactions,
    "export": Export,
    "identify": Identify,
    "design": Design,
}
