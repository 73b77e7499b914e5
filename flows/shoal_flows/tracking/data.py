"""Recordings as MLflow's data sets: runs on the same samples have the same digest, wherever these came from."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    # A second of importing, which a page of what is in MLflow does without.
    from shoal.identification import Measurement
    from shoal.identification.recording.measurement import Recording

_CONTEXT = "mlflow.data.context"
"""The tag by which MLflow tells what a run used a data set for."""


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
    channels = [channel.signal for channel in recording.channels]
    digest = hashlib.sha256(repr((channels, recording.values.shape)).encode())
    digest.update(recording.times.tobytes() + recording.values.tobytes())
    columns = [{"type": "double", "name": column, "required": True} for column in ("t", *channels)]
    told = {"num_rows": len(recording.times), "num_elements": int(recording.values.size)}
    source = {"tags": {"mlflow.source.type": "PROJECT", "mlflow.source.name": recording.origin}}
    # An origin begins with the file or the engine, and goes on with what was taken from it.
    called = recording.origin.partition(",")[0] or name
    return Data(called, digest.hexdigest()[:16], *map(json.dumps, ({"mlflow_colspec": columns}, told, source)))


def inputs(data: list[Data]) -> list[object]:
    """As MLflow's client takes them."""
    from mlflow.entities import Dataset, DatasetInput, InputTag

    used = [InputTag(_CONTEXT, "identification")]
    sets = [Dataset(one.name, one.digest, "code", one.source, one.schema, one.profile) for one in data]
    return [DatasetInput(one, used) for one in sets]
