"""Schemas of requests and answers. Quantities are in SI units, angles in radians."""

from __future__ import annotations

from typing import Annotated, Any, Literal, NamedTuple

from pydantic import BaseModel, ConfigDict, Field

from shoal.scene.record import Base
from shoal.trajectory import Status

BuiltIn = Annotated[str, Field(min_length=1, max_length=100)]
Path = Annotated[str, Field(min_length=1, max_length=200)]
Column = Annotated[str, Field(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_ ./()-]{0,99}$")]
RecordingName = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_-]{0,99}$")]
Fields = dict[Path, Any]
Number = float | None
"""null is what is not finite."""


class Asked(Base):
    """Base of requests: unknown fields and non-finite numbers are refused."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, frozen=True)


class Motion(BaseModel):
    """Motion of one scene per lane.

    times [s]: (samples,); points: marker positions [m], (samples, markers, 2, lanes); angles [rad]: (samples, markers,
    lanes); velocities [m/s] and rates [rad/s] likewise, null where the engine does not return them
    status, energy_drift, constraint_drift: one per lane; steps: time steps; wall_s: of the computation
    findings: what was found out about each lane, empty where nothing was about any; message, advice: of the first lane
    that is not ok
    model: what was computed; its `verification` holds the estimated errors [m], of lanes the largest of a few of them
    selection: with a tolerance, how the model was found; end: of one scene, the final state, from which a run can go on
    reasons, changes: one per lane, where lanes were requested: why it is not ok (empty if it is), and the values
    used in place of stated ones of its start, as `initial_changes` of the `model` of one scene
    Numbers that are not finite are null.
    """

    engine: str
    times: list[float]
    markers: list[str]
    points: list[list[list[list[Number]]]]
    angles: list[list[list[Number]]]
    velocities: list[list[list[list[Number]]]] | None
    rates: list[list[list[Number]]] | None
    status: list[Status]
    energy_drift: list[Number]
    constraint_drift: list[Number]
    steps: int
    wall_s: float
    message: str
    advice: list[str]
    findings: list[list[dict[str, Any]]]
    model: dict[str, Any]
    selection: dict[str, Any] | None = None
    end: dict[str, Any] | None = None
    reasons: list[str] = []
    changes: list[dict[str, Any]] = []


class Table(Asked):
    """A recording. columns: name -> numbers, all of one length, null where nothing was measured."""

    columns: Annotated[dict[Column, list[Number]], Field(min_length=1, max_length=100)]


class JobStatus(BaseModel):
    """A computation in the background. progress: numbers by name, if known; problem: why it failed, as a document."""

    id: str
    operation: str
    status: Literal["queued", "running", "done", "failed", "cancelled"]
    progress: dict[str, Number] | None = None
    problem: dict[str, Any] | None = None


class EngineDocument(BaseModel):
    """Capabilities of the engine; see `shoal.engines.Capabilities`."""

    engine: str
    elements: list[str]
    joints: list[str]
    loads: list[str]
    features: list[str]
    lanes: bool


class LibraryEntry(BaseModel):
    """An entry of the library. kind: scenes, recordings, problems or studies; version: a hash of its content."""

    kind: str
    name: str
    version: str
    description: str


class Library(BaseModel):
    """Built-in names, and the entries of this installation's user library.

    identity: of this library; empty before it exists.
    """

    identity: str
    scenes: list[str]
    problems: list[str]
    entries: list[LibraryEntry]


class LibraryDocument(LibraryEntry):
    """An entry with all its versions, the oldest first, and its files (base64) by path."""

    versions: list[str]
    files: dict[str, str]


class PutRequest(Asked):
    """Files of an entry by path, base64; NAME.yaml is its document, the others are those that it names."""

    files: Annotated[dict[Path, Annotated[str, Field(pattern=r"^[A-Za-z0-9+/]*={0,2}$")]], Field(min_length=1)]


class LibraryTask(NamedTuple):
    """A task on the library; name is NAME or NAME@VERSION."""

    operation: Literal["list", "get", "put", "delete"]
    kind: str = ""
    name: str = ""
    files: dict[str, str] | None = None


class VersionDocument(BaseModel):
    """Versions of the packages that compute."""

    engine: str
    versions: dict[str, str]


class Health(BaseModel):
    """Liveness or readiness of the program."""

    status: str


MODELS = ("tip-motion", "misfit")
"""Names of UM-Bridge's models; see `models`."""
Operation = Literal["InputSizes", "OutputSizes", "Evaluate", "Gradient", "ApplyJacobian"]


class ModelCall(Base):
    """A call of UM-Bridge 1.0; which fields count depends on the endpoint."""

    model_config = ConfigDict(allow_inf_nan=False, frozen=True)

    name: BuiltIn
    config: dict[str, Any] = {}
    input: list[list[float]] = []
    outWrt: int = 0
    inWrt: int = 0
    sens: list[float] = []
    vec: list[float] = []


class ModelTask(NamedTuple):
    """A call of a model, and the requested operation."""

    operation: Operation
    call: ModelCall
