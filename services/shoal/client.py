"""The library's functions, computed by a service: one class, one line for each of them.

Names of scenes, problems and recordings are the service's; objects and files are the caller's, and are sent along.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from inspect import Parameter, signature
from pathlib import Path
from typing import Any

import numpy as np
import orjson

from shoal import notebook
from shoal.arguments import brief
from shoal.engines.remote import RemoteEngine
from shoal.errors import ComputationError, InputError
from shoal.identification import Estimate
from shoal.identification.carried import carried
from shoal.identification.problem import as_problem
from shoal.identification.recording.reading import YAML, described
from shoal.identification.recording.source import Channel, FileSource
from shoal.identification.recording.units import with_units
from shoal.requests.function import stated
from shoal.response.read import by_name
from shoal.scene.load import as_scene
from shoal.scene.paths import unwrapped
from shoal.serialization import KIND, unpacked
from shoal.shelf import NAME
from shoal.table import ColumnTable, load_table
from shoal.trajectory import Array

PAUSES = (0.02, 1.0)
"""Between two looks at a job, the shortest and the longest [s]."""
Answer = dict[str, Any]
notebook.shown(Estimate)


def _by_service(function: Callable[..., Any], *, job: bool = False) -> Any:
    """A method with the arguments of a function of the library. job: whether it may take long, and is waited for."""

    def method(self: Client, *args: Any, **kwargs: Any) -> Any:
        told = kwargs.pop("progress", None) if job else None
        if job:
            return self._awaited(self.submit(function.__name__, *args, **kwargs), told)
        request = self._request(function.__name__, *args, **kwargs)
        found = self._answer("POST", f"/v1/{function.__name__}", request, _object)
        file = stated(function, args, kwargs).get("file")
        if file is not None:
            found.save(Path(file))
        return found

    known = signature(function)
    own = Parameter("self", Parameter.POSITIONAL_OR_KEYWORD)
    method.__signature__ = known.replace(parameters=[own, *known.parameters.values()])  # type: ignore[attr-defined]
    method.__name__, method.__doc__ = function.__name__, function.__doc__
    return method


class Client:
    """The service at an http(s) address. The key, if it asks for one, is SHOAL_API_KEY.

    Each method takes what the function of the library with its name takes and returns what it returns, to the last
    bit; `engine` is the service's own. They raise InputError where the service refuses, ComputationError where it fails
    or does not answer. What takes long is a job of the service; `submit` makes one of any of them, and `status`,
    `result` and `cancel` take its id.
    """

    simulate = _by_service(notebook.simulate)
    statics = _by_service(notebook.statics)
    linearize = _by_service(notebook.linearize)
    modes = _by_service(notebook.modes)
    reactions = _by_service(notebook.reactions)
    export = _by_service(notebook.export)
    select = _by_service(notebook.select, job=True)
    sweep = _by_service(notebook.sweep, job=True)
    uncertain = _by_service(notebook.uncertain, job=True)
    identify = _by_service(notebook.identify, job=True)
    design = _by_service(notebook.design, job=True)

    def __init__(self, url: str) -> None:
        self._service = RemoteEngine(url)

    def __repr__(self) -> str:
        return f"Client({self._service.name})"

    def submit(self, operation: str, /, *args: Any, **kwargs: Any) -> str:
        """Begin an operation, given by the name of its method and its arguments; returns the id of the job."""
        request = self._request(operation, *args, **kwargs)
        return str(self._answer("POST", f"/v1/jobs/{operation}", request, lambda found: found["id"]))

    def status(self, job: str) -> Answer:
        """Return the state of a job: `status` queued, running, done, failed or cancelled; `problem`: why it failed."""
        return dict(self._answer("GET", f"/v1/jobs/{job}", read=_job))

    def result(self, job: str) -> Any:
        """Return the result of a finished job, as the method of the same name returns it."""
        return self._answer("GET", f"/v1/jobs/{job}/result")

    def cancel(self, job: str) -> None:
        """Stop a job; one that has ended stays as it is."""
        self._answer("DELETE", f"/v1/jobs/{job}")

    def _awaited(self, job: str, told: Callable[..., None] | None) -> Any:
        pause, last = PAUSES[0], None
        try:
            while (found := self.status(job))["status"] in ("queued", "running"):
                if told is not None and (now := found["progress"]) not in (None, last):
                    last = now
                    told(*now.values())
                time.sleep(pause)
                pause = min(1.5 * pause, PAUSES[1])
        except KeyboardInterrupt:
            self.cancel(job)
            raise
        if found["status"] == "cancelled":
            raise ComputationError(f"{found['operation']}: the job was cancelled")
        return self.result(job)

    def _answer(
        self, method: str, path: str, content: Answer | None = None, read: Callable[[Any], Any] = lambda found: found
    ) -> Any:
        try:
            body = None if content is None else orjson.dumps(content, option=orjson.OPT_SERIALIZE_NUMPY)
        except TypeError as error:
            raise InputError(f"{path}: an argument cannot be sent: {error}") from None
        found = self._service.ask(method, path, body, read)
        try:
            return unpacked(found)
        except ValueError as error:
            about = f"{self._service.name} answers what this version does not know, {error}"
            raise ComputationError(f"engine: {about}; install the same version here and there") from None

    def _own(self) -> str:
        """The service's engine."""
        return str(self._service.ask("GET", "/v1/capabilities", read=lambda found: found["engine"]))

    def _request(self, operation: str, *args: Any, **kwargs: Any) -> Answer:
        """The arguments of a function of the library as the fields of a request. Raises InputError."""
        if not isinstance(getattr(Client, operation, None), Callable) or not hasattr(notebook, operation):  # type: ignore[arg-type]
            raise InputError(f"operation: no operation {operation!r}")
        function = getattr(notebook, operation)
        given = stated(function, args, kwargs)
        given.pop("file", None)
        engine = given.pop("engine", None)
        if engine is not None and engine != (there := self._own()):
            raise InputError(f"engine: the service at {self._service.name} runs {there}, found {engine!r}")
        if "scene" in given:
            given["scene"] = _scene(given["scene"])
        if (values := given.pop("values", None)) is not None:
            found, own = carried(values), dict(given.get("set") or {})
            if "problem" in given:
                given["problem"], given["set"], _ = found.into(as_problem(given["problem"]), own)
            else:
                # What is varied is not what was found; only what a caller states may be refused for that.
                varied = given["vary"] if operation == "sweep" else ()
                given["set"] = {path: value for path, value in found.values.items() if path not in varied} | own
        if "problem" in given:
            given["problem"], given["data"] = _problem(given["problem"], given.pop("data", None))
        if operation == "uncertain":
            given["vary"] = by_name(given["vary"])
        if (pairs := given.get("correlate")) is not None:
            given["correlate"] = [[*pair, value] for pair, value in pairs.items()]
        measured = given.pop("data", None)  # the only numbers that may be missing
        sent = {name: _plain(value, name) for name, value in given.items() if value is not None}
        if measured is not None:
            sent["data"] = measured
        return {**sent, "objects": True}


def _object(found: Any) -> Any:
    """An answer of an operation: an object of the library, or several. Raises KeyError, TypeError for any other."""
    for one in found if isinstance(found, list) else [found]:
        one[KIND]
    return found


def _job(found: Answer) -> Answer:
    """Return the state of a job. Raises KeyError for an unknown one."""
    return {**found, **{name: found[name] for name in ("status", "operation", "progress")}}


def _scene(given: Any) -> Any:
    return given if _is_name(given) else as_scene(given).model_dump(mode="json")


def _is_name(given: Any) -> bool:
    """Return whether it is that of something the service knows."""
    return isinstance(given, str) and Path(given).suffix not in YAML


def _problem(given: Any, data: Any) -> tuple[Any, Answer]:
    """A problem, with its scene, and its recordings by name. Raises InputError."""
    if _is_name(given):
        return given, {name: _recording(FileSource(), one)[1] for name, one in _by_name(data).items()}
    problem = as_problem(given)
    stated = {**problem.model_dump(mode="json", exclude_unset=True), "scene": _scene(problem.scene)}
    found = _by_name(data, next(iter(problem.sources)))
    for name, source in problem.sources.items():
        if isinstance(source, FileSource) and (path := found.get(name, source.path)) is not None:
            fields, found[name] = _recording(source, path, problem.channels_of(source))
            if problem.recordings:
                stated["recordings"][name] = fields
            else:
                stated["source"] = fields
    return stated, found


def _by_name(data: Any, single: str = "recording") -> Answer:
    if data is None:
        return {}
    return dict(data) if isinstance(data, Mapping) else {single: data}


def _recording(source: FileSource, given: Any, channels: tuple[Channel, ...] | None = None) -> tuple[Answer, Any]:
    """The fields of a source without where it lies, and its table, or the name of a recording of the service.

    given: a file, a table, or such a name; channels: those of the source, None where only the
        service knows them. Raises InputError.
    """
    frames = None
    if not isinstance(given, str | Path):
        if not hasattr(given, "columns"):
            raise InputError(f"data: needs a file or a table (a DataFrame), by name for several, found {brief(given)}")
        columns = {str(name): given[name].to_numpy(dtype=float) for name in given.columns}
    elif isinstance(given, str) and NAME.fullmatch(given.partition("@")[0]) and not Path(given).exists():
        return source.model_dump(mode="json", exclude_unset=True, exclude={"path"}), given
    else:
        fields = described(source.model_dump(exclude_unset=True), Path(given))
        source = FileSource.model_validate(fields)
        table = load_table(Path(fields["path"]), source.columns)
        columns, frames = _numbers(table), table.frames
        if table.units is not None and channels is None and not source.channels:
            raise InputError(
                f"data: {given} has a line of units; give the problem as a file, which states them with it"
            )
        if table.units is not None:
            source, channels, _ = with_units(source, tuple(source.channels or channels or ()), table.units)
            source = source.model_copy(update={"channels": list(channels)})
    if frames is not None and len(frames):
        # A line that is blank is a frame too.
        blank = np.full((len(columns), frames[-1] + 1), np.nan)
        for row, numbers in zip(blank, columns.values(), strict=True):
            row[frames] = numbers
        columns = dict(zip(columns, blank, strict=True))
    stated = source.model_dump(mode="json", exclude_unset=True, exclude={"path", "columns"})
    return {**stated, "kind": "file"}, {"columns": columns}


def _numbers(table: ColumnTable) -> dict[str, Array]:
    """The columns that hold numbers; a problem that needs another is refused by the service."""
    found = {}
    for name in table.frame.columns:
        with suppress(InputError):
            found[str(name)] = table.numbers(name)
    return found


def _plain(value: Any, field: str) -> Any:
    """Return a value as JSON holds it. Raises InputError for numbers that are not finite, which would become null."""
    value = unwrapped(value)
    if isinstance(value, Mapping):
        return {key: _plain(one, f"{field}.{key}") for key, one in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_plain(one, field) for one in value]
    if isinstance(value, float) and not np.isfinite(value):
        raise InputError(f"{field}: needs a finite number, found {value}")
    return str(value) if isinstance(value, Path) else value
