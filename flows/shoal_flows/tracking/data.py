"""Recordings as MLflow's data sets: runs on the same samples have the same digest, independent of their source."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    # A second of importing, which a page of what is in MLflow does without.
    from shoal.identification import Measurement
    from shoal.identification.recording.measurement import HeldOut, Recording

_CONTEXT = "mlflow.data.context"
"""The tag by which MLflow tells what a run used a data set for."""
_WHOLE = "recording"
"""The tag of a source that holds what is the same for all parts of a recording."""


@dataclass(frozen=True)
class Data:
    """One data set. name: of its file or engine; digest: of its samples; schema, profile, source: JSON as MLflow's."""

    name: str
    digest: str
    schema: str
    profile: str
    source: str


def of_measurement(measurement: Measurement) -> list[Data]:
    """One for each recording."""
    return [_of(name, recording) for name, recording in measurement.recordings.items()]


def _of(name: str, recording: Recording) -> Data:
    channels = [channel.label for channel in recording.channels]
    digest = _digest(recording)
    columns = [{"type": "double", "name": column, "required": True} for column in ("t", *channels)]
    told = {"num_rows": len(recording.times), "num_elements": int(recording.values.size)}
    # What was held out is of the same recording.
    whole = recording.table or _digest(recording, *recording.held)
    source = {"tags": {"mlflow.source.type": "PROJECT", "mlflow.source.name": recording.origin, _WHOLE: whole}}
    # An origin begins with the file or the engine, and goes on with what was taken from it.
    called = recording.origin.partition(",")[0] or name
    return Data(called, digest, *map(json.dumps, ({"mlflow_colspec": columns}, told, source)))


def _digest(recording: Recording, *held: HeldOut) -> str:
    """Hash the samples of a recording and the held-out windows, in the order of time."""
    parts: list[Recording | HeldOut] = [recording, *held]
    times = np.concatenate([part.times for part in parts])
    values = np.concatenate([part.values for part in parts])
    order = np.argsort(times, kind="stable")
    digest = hashlib.sha256(repr(([channel.label for channel in recording.channels], values.shape)).encode())
    digest.update(times[order].tobytes() + values[order].tobytes())
    return digest.hexdigest()[:16]


def whole(digest: str, source: str) -> str:
    """Return the key of a recording, independent of the fitted part, from MLflow's record of a data set."""
    return str(json.loads(source).get("tags", {}).get(_WHOLE, digest))


def inputs(data: list[Data]) -> list[object]:
    """Return the data sets for MLflow's client."""
    from mlflow.entities import Dataset, DatasetInput, InputTag

    used = [InputTag(_CONTEXT, "identification")]
    sets = [Dataset(one.name, one.digest, "code", one.source, one.schema, one.profile) for one in data]
    return [DatasetInput(one, used) for one in sets]
