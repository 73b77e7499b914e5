"""The identification problem: which numbers of which scene, from which measurement."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, ValidationError, model_validator

from shoal.arguments import brief
from shoal.errors import InputError
from shoal.identification.bounds import accepts, possible_bound
from shoal.identification.recording.source import IN_SPACE, Channel, EngineSource, FileSource, Source
from shoal.identification.recording.virtual_sensors import check_sensors
from shoal.scene import Scene, expression, load_scene
from shoal.scene.joints import Gear
from shoal.scene.load import names, read_named
from shoal.scene.paths import unwrapped
from shoal.scene.record import Positive, Record, one_line
from shoal.scene.scene import Name
from shoal.shelf import NAME, located, shelf

MEASUREMENT = (
    *("clock", "delay", "scale", "x", "y", "tilt", "mounting"),
    *("bias_ax", "bias_ay", "bias_az", "bias_rate", "bias_wx", "bias_wy", "bias_wz"),
)
"""What a parameter can be that is none of the scene's: the path is `measurement.` and one of these."""
PROPORTIONAL = {"x", "y", *(name for name in MEASUREMENT if name.startswith("bias_"))}
"""Those of them that channels follow in proportion, so that a fit has one place for them."""
RESERVED = "measurement"
_FREE = (".angle", ".rate")
_POSITIVE = {
    *(
        "length",
        "height",
        "width",
        "end_height",
        "end_width",
        "wall",
        "web",
        "flange",
        "density",
        "mass",
        "inertia",
        "youngs_modulus",
    ),
    *("rho_A", "rho_I", "rho_I_side", "EA", "EI", "EI_side", "GJ", "GA"),
    *("stiffness", "damping", "friction", "drag", "coulomb", "armature", "mu", "retardation", "clock", "scale"),
}
"""Last names of paths to quantities that are positive, and known by their order of magnitude rather than by a sum."""


class Prior(Record):
    """Prior knowledge of a parameter: a normal distribution."""

    mean: float
    std: Positive


class Parameter(Record):
    """A number to be found: its path in the scene, its bounds, and where to start if nothing better is known.

    path: a field of the scene, or `measurement.` and clock, delay, scale, x, y, tilt, mounting or a bias; without one
        the parameter only stands in `ties`
    scale: `log` for numbers that are known in order of magnitude only; `auto` is that for quantities that are positive
        by nature (a mass, a length, a modulus, friction) where `lower` is above 0, else `linear`
    own: every recording has its own (an initial state, for instance), named RECORDING.NAME; or the names of those that
        have, the others are as they state (a delay of the second sensor)
    """

    path: str | None = None
    lower: float
    upper: float
    start: float | None = None
    scale: Literal["auto", "linear", "log"] = "auto"
    prior: Prior | None = None
    own: bool | tuple[Name, ...] = False

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if not self.lower < self.upper:
            raise ValueError(f"lower {self.lower:g} is not below upper {self.upper:g}")
        if self.start is not None and not self.lower <= self.start <= self.upper:
            raise ValueError(f"start {self.start:g} is not between lower {self.lower:g} and upper {self.upper:g}")
        if self.scale == "log" and self.lower <= 0:
            raise ValueError(f"lower {self.lower:g} is not positive, as a logarithmic scale needs")
        head, _, rest = (self.path or "").partition(".")
        if head == RESERVED and rest not in MEASUREMENT:
            raise ValueError(f"path {self.path!r}: a measurement has {', '.join(MEASUREMENT)}")
        return self

    @property
    def logarithmic(self) -> bool:
        """Return whether it is sought by its logarithm."""
        positive = self.lower > 0 and (self.path or "").rpartition(".")[2] in _POSITIVE
        return self.scale == "log" or (self.scale == "auto" and positive)

    @property
    def begin(self) -> float:
        """Default start of a search: the stated start, else the middle of the range."""
        if self.start is not None:
            return self.start
        return math.sqrt(self.lower) * math.sqrt(self.upper) if self.logarithmic else (self.lower + self.upper) / 2

    @property
    def of_measurement(self) -> bool:
        """Return whether it describes the measurement, not the machine."""
        return (self.path or "").startswith(RESERVED + ".")


def _apart(given: Any) -> Any:
    """Uncertainties that are stated field by field, as many that are independent of each other."""
    return [{path: size} for path, size in given.items()] if isinstance(given, Mapping) else given


class Problem(Record):
    """Identification problem. `values` replace fields of the scene; `noise` is the standard deviation of a channel.

    source, or recordings by name: the data; several are fitted at once
    ties: path -> expression in parameters and constants, for fields that depend on parameters
    constants: name -> field of the scene, for use in `ties` and `quantities`
    quantities: expressions in parameters and constants that the answer reports with their uncertainty
    uncertainties: standard deviations of fields of the scene that are taken as known, in SI units; as a list, each
        entry states a joint error of fields, and the entries are independent of each other
    loss: how a deviation counts; all but `squares` let outliers weigh less
    """

    name: str
    description: str = ""
    scene: str
    values: dict[str, Any] = {}
    parameters: Annotated[dict[Name, Parameter], Field(min_length=1)]
    ties: dict[str, str] = {}
    channels: list[Channel] = []
    source: Source | None = None
    recordings: dict[Name, Source] = {}
    noise: Positive | None = None
    loss: Literal["squares", "huber", "soft-l1", "cauchy"] = "squares"
    constants: dict[str, str] = {}
    quantities: dict[str, str] = {}
    uncertainties: Annotated[tuple[dict[str, float], ...], BeforeValidator(_apart)] = ()
    method: str = "auto"

    @model_validator(mode="after")
    def _known_names(self) -> Self:
        known = {*self.parameters, *self.constants}
        expressions = {f"quantities.{name}": text for name, text in self.quantities.items()}
        expressions |= {f"ties.{path}": text for path, text in self.ties.items()}
        for where, text in expressions.items():
            try:
                unknown = expression.names(text) - known
            except InputError as error:
                raise ValueError(f"{where}: {error}") from None
            if unknown:
                raise ValueError(f"{where}: {sorted(unknown)[0]!r} is neither a parameter nor a constant")
        fitted = {parameter.path for parameter in self.parameters.values()} | {*self.ties}
        for name, path in self.constants.items():
            if path in fitted:
                raise ValueError(f"constants.{name}: {path} is not constant; it is sought or tied")
        for path in self.uncertain:
            if path in fitted:
                raise ValueError(f"uncertainties: {path} is sought or tied, not known")
        used = {name for text in self.ties.values() for name in expression.names(text)}
        for name, parameter in self.parameters.items():
            if parameter.path is None and name not in used:
                raise ValueError(f"parameters.{name}: has no path and stands in none of the ties")
        self._check_own({name for text in expressions.values() for name in expression.names(text)})
        return self

    def _check_own(self, used: set[str]) -> None:
        """Raise ValueError where a parameter of some recordings names others, or stands where all of them need it."""
        for name, parameter in self.parameters.items():
            if isinstance(parameter.own, bool):
                continue
            unknown = [one for one in parameter.own if one not in self.recordings]
            if unknown or not parameter.own:
                there = f"the recordings ({', '.join(self.recordings)})" if self.recordings else "several recordings"
                raise ValueError(f"parameters.{name}.own: {', '.join(unknown) or 'nobody'} is none of {there}")
            if name in used and len(set(parameter.own)) < len(self.recordings):
                raise ValueError(f"parameters.{name}.own: ties and quantities need it of every recording")

    @model_validator(mode="after")
    def _data(self) -> Self:
        if (self.source is None) == (not self.recordings):
            raise ValueError("source: give either one source or several recordings")
        for name, source in self.sources.items():
            channels = self.channels_of(source)
            if not channels and isinstance(source, EngineSource):
                raise ValueError("channels: at least one is needed")
            if isinstance(source, FileSource) and not all(channel.column for channel in channels):
                raise ValueError(f"channels: each needs the `column` of the file it is read from ({name})")
        return self

    @property
    def uncertain(self) -> dict[str, float]:
        """Fields of the scene that are taken as known, and the standard deviation of each, in SI units."""
        paths = {path: None for entry in self.uncertainties for path in entry}
        return {path: math.hypot(*(entry.get(path, 0.0) for entry in self.uncertainties)) for path in paths}

    @property
    def sources(self) -> dict[str, EngineSource | FileSource]:
        """Sources of the data, by the name of the recording."""
        return self.recordings or ({"recording": self.source} if self.source is not None else {})

    def channels_of(self, source: EngineSource | FileSource) -> tuple[Channel, ...]:
        """The signals of a recording."""
        return tuple(source.channels or self.channels)

    def load_scene(self, values: Mapping[str, Any] | None = None) -> Scene:
        """The scene to fit, with this problem's and the given values set, and every path checked. Raises InputError."""
        scene = load_scene(self.scene)
        scene = scene.with_values({**self.values, **(values or {})})
        self._check_gears(scene)
        self._check_bounds(scene)
        for path in (*self.ties, *self.constants.values()):
            try:
                scene.value(path)
            except InputError as error:
                raise InputError(f"{self.name}: ties or constants: {error}") from None
        self._check_uncertain(scene)
        for source in self.sources.values():
            if channels := self.channels_of(source):
                self.check_channels(channels, scene, self.name)
        return scene

    def _check_uncertain(self, scene: Scene) -> None:
        """Return whether what is uncertain are numbers of the scene. Raises InputError."""
        for path, size in self.uncertain.items():
            where = f"{self.name}: uncertainties"
            try:
                value = scene.value(path)
            except InputError as error:
                raise InputError(f"{where}: {error}") from None
            if isinstance(value, bool) or not isinstance(value, int | float):
                raise InputError(f"{where}: {path} is {str(value)[:40]!r}, no number that could be off")
            if not size > 0.0:
                raise InputError(f"{where}: {path}: needs a standard deviation above 0, found {size:g}")

    def _check_gears(self, scene: Scene) -> None:
        """Refuse a gear's ratio that is sought, or tied to what is. Raises InputError."""
        sought = {f"parameters.{name}.path": parameter.path for name, parameter in self.parameters.items()}
        for where, path in {**sought, **{f"ties.{path}": path for path in self.ties}}.items():
            part, name, field = (*(path or "").split("."), "", "", "")[:3]
            if part == "joints" and field == "ratio" and isinstance(scene.joints.get(name), Gear):
                raise InputError(
                    f"{self.name}: {where}: {path} is of whole teeth and cannot be sought; fit with each that may be "
                    f"(--set {path}=RATIO) and compare the residuals"
                )

    def _check_bounds(self, scene: Scene) -> None:
        """Return whether the scene accepts the bounds of each parameter. Raises InputError."""
        bounds = {
            name: (parameter.path, parameter.lower, parameter.upper)
            for name, parameter in self.parameters.items()
            if parameter.path is not None and not parameter.of_measurement
        }
        # A start is free in its angles and rates: one scene for all of them tells as much as one for each.
        free = {name for name, (path, *_) in bounds.items() if path.startswith("initial.") and path.endswith(_FREE)}
        try:
            for side in (1, 2) if free else ():
                scene.with_values({bounds[name][0]: bounds[name][side] for name in free})
        except InputError:
            free = set()
        for name, (path, *ends) in bounds.items():
            for end, bound in zip(("lower", "upper"), ends, strict=True) if name not in free else ():
                if accepts(scene, {path: bound}):
                    continue
                fields = partial(self._fields, scene, name)
                try:
                    scene.with_values(fields(bound))
                except InputError as error:
                    nearest = possible_bound(scene, path, bound, fields)
                    possible = "" if nearest is None else f"; with the rest of {scene.name} as it is {nearest:g} can be"
                    where = f"{self.name}: parameters.{name}.{end}"
                    raise InputError(f"{where}: {bound:g} cannot be: {error}{possible}") from None

    def _fields(self, scene: Scene, name: str, value: float) -> dict[str, float]:
        """Fields that a value of a parameter sets, by path, ties included; the others are at their starts."""
        known = {other: parameter.begin for other, parameter in self.parameters.items()} | {name: value}
        known |= {constant: float(scene.value(path)) for constant, path in self.constants.items()}
        tied = {path: text for path, text in self.ties.items() if name in expression.names(text)}
        found = {path: expression.evaluate(text, known) for path, text in tied.items()}
        return {self.parameters[name].path or name: value, **found}

    def check_channels(self, channels: tuple[Channel, ...], scene: Scene, where: str) -> None:
        """Return whether a recording can be compared with the scene. Raises InputError."""
        if not channels:
            raise InputError(f"{where}: channels: none are stated, neither by the problem nor by the recording")
        for channel in channels:
            for marker in (channel.marker or None, channel.to):
                if marker is not None and marker not in scene.markers:
                    known = ", ".join(scene.markers)
                    raise InputError(f"{where}: channels: no marker {marker!r}; there are {known}")
            if channel.signal is not None and channel.signal not in {**scene.signals, **scene.states}:
                known = ", ".join([*scene.signals, *scene.states]) or "none"
                raise InputError(f"{where}: channels: no signal or state {channel.signal!r}; there are {known}")
            if channel.quantity in IN_SPACE and scene.dimensions == 2:
                raise InputError(
                    f"{where}: channels: {channel.quantity} is measured in space; {scene.name} is a scene in the plane"
                )
            if channel.quantity in ("angle", "rate") and scene.dimensions == 3:
                instead = "x, y and z are" if channel.quantity == "angle" else "wx, wy and wz are"
                raise InputError(f"{where}: channels: {channel.quantity} is measured in the plane; in space {instead}")
            if channel.noise is None and self.noise is None and any(p.prior for p in self.parameters.values()):
                raise InputError(
                    f"{where}: noise: a prior weighs against the data by their noise; state it for {channel.place}"
                )
        try:
            check_sensors(scene, channels)
        except InputError as error:
            raise InputError(f"{where}: {error}") from None

    @classmethod
    def parse(cls, data: Any, source: str) -> Problem:
        """Check `data` as read from YAML. Raises InputError, one line that names the field."""
        try:
            return cls.model_validate(data)
        except ValidationError as error:
            raise one_line(error, source, cls) from None


def problem_library() -> Traversable:
    """The folder of the built-in problems."""
    return files("shoal.identification") / "library"


def problem_names() -> list[str]:
    """List the problems that there are.

    Returns:
        The names of built-in problems, then of the user library, each sorted.

    Examples:
        >>> "paper-case-1" in shoal.problem_names()
        True
    """
    return [*built_in_problems(), *(entry.name for entry in shelf().entries("problems"))]


def built_in_problems() -> list[str]:
    """Names of the problems that come with Shoal, sorted."""
    return names(problem_library())


def as_problem(given: Problem | Mapping[str, Any] | str | Path) -> Problem:
    """A problem as it is, by its fields, or as `load_problem` takes it; files that fields name are found from here.

    Raises InputError.
    """
    if isinstance(given, Problem):
        return given
    if isinstance(given, Mapping):
        return Problem.parse(unwrapped(given), "problem")
    if not isinstance(given, str | Path):
        raise InputError(
            f"problem: needs a problem, its fields, a name or the path of a YAML file, found {brief(given)}"
        )
    return load_problem(given)


def load_problem(name: str | Path) -> Problem:
    """Load a problem of identification.

    Args:
        name: A built-in name, one of the user library, or a YAML file; what this names is beside it, or in the library.

    Returns:
        The problem.

    Raises:
        InputError: There is no such problem, or a field of it is wrong.

    Examples:
        >>> list(shoal.load_problem("paper-case-1").parameters)
        ['theta1', 'theta2']
    """
    name = str(name)
    name = name if name in built_in_problems() else located("problems", name)
    problem = Problem.parse(read_named(name, problem_library(), "problem", problem_names()), name)
    if not Path(name).suffix:
        return problem
    folder = Path(name).parent
    changes: dict[str, Any] = {
        "recordings": {key: _from_folder(folder, one) for key, one in problem.recordings.items()}
    }
    if problem.source is not None:
        changes["source"] = _from_folder(folder, problem.source)
    if Path(problem.scene).suffix and (folder / problem.scene).exists():
        changes["scene"] = str(folder / problem.scene)
    return problem.model_copy(update=changes)


def _from_folder(folder: Path, source: EngineSource | FileSource) -> EngineSource | FileSource:
    """The source with a path that starts from the folder of the YAML file that names it, unless it is a name."""
    if isinstance(source, EngineSource) or source.path is None:
        return source
    if not (folder / source.path).exists() and NAME.fullmatch(source.path.partition("@")[0]):
        return source
    return source.model_copy(update={"path": str(folder / source.path)})
