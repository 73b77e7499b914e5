"""The files of a model: the identified scenes, the problem and its data, in the form that MLflow loads."""

from __future__ import annotations

import csv
from importlib.metadata import version
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from shoal.identification import Problem, load_problem
from shoal.identification.recording.measurement import Recording
from shoal.scene import Scene
from shoal.scene.edited import as_yaml

from shoal_flows.jobs import Fit

# Not shoal itself: from a registry of packages it would be another's, of the same name.
_REQUIREMENTS = ("mlflow", "numba", "numpy", "pandas", "pydantic", "scipy")


def documents(fit: Fit) -> dict[str, str]:
    """Texts by path: `scenes/RECORDING.yaml` as identified; `problem.yaml`, `stated.yaml` and `data/` as asked.

    `shoal identify problem.yaml` in their folder repeats the identification. Raises InputError.
    """
    problem, estimate = load_problem(fit.cell.problem), fit.estimate
    recordings = estimate.measurement.recordings
    return {
        **{f"scenes/{name}.yaml": _scene(scene) for name, scene in estimate.scenes.items()},
        "stated.yaml": _scene(problem.load_scene(fit.cell.values)),
        "problem.yaml": as_yaml(_asked(problem, {name: _source(name, one) for name, one in recordings.items()})),
        **{f"data/{name}.csv": _table(one) for name, one in recordings.items()},
    }


def packed(fit: Fit) -> dict[str, bytes]:
    """The folder of a model by path, as `mlflow.pyfunc` loads it."""
    from mlflow import pyfunc

    from shoal_flows.tracking.model import predictor

    recordings = list(fit.estimate.scenes)
    with TemporaryDirectory() as folder:
        identification, target = Path(folder) / "identification", Path(folder) / "model"
        for path, text in documents(fit).items():
            file = identification / path
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text, encoding="utf-8")
        pyfunc.save_model(
            target,
            python_model=predictor.__file__,
            artifacts={"identification": str(identification)},
            model_config={"engine": fit.estimate.engine, "recording": recordings[0]},
            signature=_signature(fit),
            input_example=_example(fit),
            pip_requirements=[f"{name}=={version(name)}" for name in _REQUIREMENTS],
        )
        files = [path for path in target.rglob("*") if path.is_file() and "__pycache__" not in path.parts]
        return {path.relative_to(target).as_posix(): path.read_bytes() for path in files}


def _signature(fit: Fit) -> Any:
    from mlflow.models import ModelSignature
    from mlflow.types import ColSpec, ParamSchema, ParamSpec, Schema

    from shoal_flows.tracking.model.predictor import TIME, with_unit

    columns = [with_unit(f"{marker}.{part}") for marker in fit.motion.markers for part in ("x", "y", "angle")]
    recordings = list(fit.estimate.scenes)
    params = ParamSchema([ParamSpec("recording", "string", recordings[0])]) if len(recordings) > 1 else None
    outputs = Schema([ColSpec("double", column) for column in columns])
    return ModelSignature(Schema([ColSpec("double", TIME)]), outputs, params)


def _example(fit: Fit) -> Any:
    """A few instants of the motion that was measured."""
    import pandas as pd

    from shoal_flows.tracking.model.predictor import TIME

    return pd.DataFrame({TIME: np.linspace(0.0, float(fit.motion.times[-1]), 6)})


def _scene(scene: Scene) -> str:
    return as_yaml(scene.model_dump(mode="json"))


def _asked(problem: Problem, sources: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """The problem on `stated.yaml`, with the samples that were fitted as its data."""
    left_out = {"values", "channels", "source", "recordings"}
    data = problem.model_dump(mode="json", exclude_unset=True, exclude=left_out)
    return {**data, "scene": "stated.yaml", **({"recordings": sources} if problem.recordings else _only(sources))}


def _only(sources: dict[str, dict[str, Any]]) -> dict[str, Any]:
    (source,) = sources.values()
    return {"source": source}


def _source(name: str, recording: Recording) -> dict[str, Any]:
    """Describe the columns of `_table`: in SI units, from the start of the motion, by the recording's clock."""
    channels = []
    read = {"column", "origin", "unit", "scale", "offset", "noise"}
    for channel, column, noise in zip(recording.channels, _columns(recording), recording.noise.tolist(), strict=True):
        where = channel.model_dump(mode="json", exclude_defaults=True, exclude=read)
        channels.append(where | {"column": column} | ({"noise": noise} if np.isfinite(noise) else {}))
    stated_too = recording.stated.model_dump(mode="json", exclude_defaults=True, exclude={"channels"})
    return {
        "kind": "file",
        "path": f"data/{name}.csv",
        "start": 0.0,
        "swaps": False,
        **stated_too,
        "channels": channels,
    }


def _table(recording: Recording) -> str:
    """Time [s] and channels in SI units, with all digits; empty where nothing was measured."""
    stream = StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(["t", *_columns(recording)])
    for time, row in zip(recording.times.tolist(), recording.values.tolist(), strict=True):
        writer.writerow([repr(time), *("" if np.isnan(value) else repr(value) for value in row)])
    return stream.getvalue()


def _columns(recording: Recording) -> list[str]:
    """A name for each channel; those that show the same in another way are numbered."""
    names = [channel.label for channel in recording.channels]
    return [f"{name}-{k}" if names.count(name) > 1 else name for k, name in enumerate(names)]
