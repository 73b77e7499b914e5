"""One run in MLflow: opened with its name and tags, filled in batches, ended with its status."""

from __future__ import annotations

import math
import os
import re
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from shoal.errors import ComputationError

from shoal_flows import provenance, settings

_BATCH = 1000
_KIND = "custom_model_development"
"""What makes MLflow open on runs and metrics instead of traces of language models."""
_EXPERIMENTS = {
    "Identification": "Parameters found from measured motion: a parent per study, a child per method, case and seed.",
    "Comparison": "One scene on several engines: a parent run per scene, a child per engine.",
    "Sweep": "One scene over a grid of values.",
    "Forward": "Motion of one scene on one engine.",
}


@dataclass
class Run:
    """An open run of MLflow; what is added is sent when it ends or in full batches."""

    client: Any
    run_id: str
    _metrics: list[tuple[str, float, int, int]] = field(default_factory=list)
    _params: list[tuple[str, str]] = field(default_factory=list)

    def params(self, values: Mapping[str, Any]) -> None:
        """Settings, which never change; what is too long for MLflow is cut."""
        self._params += [(name, str(value)[:6000]) for name, value in values.items()]

    def metric(self, name: str, value: float, step: int = 0) -> None:
        """One number; what is not finite is left out."""
        if math.isfinite(value):
            self._metrics.append((_plain(name), float(value), int(time.time() * 1000), step))

    def series(self, name: str, values: Iterable[tuple[int, float]]) -> None:
        """Numbers by step."""
        for step, value in values:
            self.metric(name, value, step)

    def text(self, content: str, path: str) -> None:
        """A text artifact at `path`."""
        self.client.log_text(self.run_id, content, path)

    def picture(self, content: bytes, path: str) -> None:
        """A PNG artifact named `path`."""
        with TemporaryDirectory() as folder:
            file = Path(folder) / path
            file.write_bytes(content)
            self.client.log_artifact(self.run_id, str(file))

    def flush(self) -> None:
        """Send what was added, at most 1000 metrics and 100 settings a call."""
        from mlflow.entities import Metric, Param

        while self._metrics or self._params:
            metrics = [Metric(*row) for row in self._metrics[:_BATCH]]
            params = [Param(*row) for row in self._params[:100]]
            self.client.log_batch(self.run_id, metrics=metrics, params=params)
            del self._metrics[:_BATCH], self._params[:100]


@contextmanager
def open_run(
    experiment: str,
    name: str,
    *,
    description: str = "",
    tags: Mapping[str, str] | None = None,
    parent: str | None = None,
) -> Iterator[Run]:
    """A run from its start to its end, failed if an exception leaves the block; parent: the id of a run.

    Raises ComputationError if MLflow cannot be reached.
    """
    client = connect()
    from mlflow.exceptions import MlflowException

    try:
        all_tags = {**_common_tags(), **(tags or {}), "mlflow.runName": name}
        if parent:
            all_tags["mlflow.parentRunId"] = parent
        if description:
            all_tags["mlflow.note.content"] = description
        created = client.create_run(_experiment(experiment), tags=all_tags, run_name=name)
    except MlflowException as error:
        raise _unreachable(error) from None
    run = Run(client, created.info.run_id)
    try:
        yield run
        run.flush()
    except BaseException:
        client.set_terminated(run.run_id, "FAILED")
        raise
    client.set_terminated(run.run_id, "FINISHED")


@cache
def connect() -> Any:
    """MLflow's client, its database made if need be. Raises ComputationError if MLflow cannot be reached."""
    # MLflow reads the settings when it is imported.
    settings.apply()
    from mlflow import MlflowClient
    from mlflow.exceptions import MlflowException

    try:
        client = MlflowClient()
        client.search_experiments(max_results=1)
    except MlflowException as error:
        raise _unreachable(error) from None
    return client


def _unreachable(error: Exception) -> ComputationError:
    return ComputationError(f"MLflow at {os.environ['MLFLOW_TRACKING_URI']}: {str(error).splitlines()[0]}")


@cache
def _experiment(name: str) -> str:
    """The experiment of that name, made with its description when it is first used."""
    from mlflow.exceptions import MlflowException

    client = connect()
    found = client.get_experiment_by_name(name)
    if found is not None:
        if found.lifecycle_stage == "deleted":
            client.restore_experiment(found.experiment_id)
        return str(found.experiment_id)
    location = None if settings.tracking_server() else (settings.artifact_folder() / name.lower()).as_uri()
    tags = {"mlflow.note.content": _EXPERIMENTS[name], "project": "shoal", "mlflow.experimentKind": _KIND}
    try:
        return str(client.create_experiment(name, artifact_location=location, tags=tags))
    except MlflowException:
        # Another worker may have made it in the meantime.
        made = client.get_experiment_by_name(name)
        if made is None:
            raise
        return str(made.experiment_id)


def _common_tags() -> dict[str, str]:
    tags = {f"version.{package}": found for package, found in provenance.versions().items()}
    revision = provenance.revision()
    if revision:
        tags |= {"mlflow.source.git.commit": revision.partition("+")[0], "source.revision": revision}
    return {**tags, "platform": provenance.machine(), "mlflow.source.name": "shoal", "mlflow.source.type": "PROJECT"}


def _plain(name: str) -> str:
    """A name that MLflow accepts for a metric."""
    return re.sub(r"[^\w\-. /]", "_", name)


__all__ = ["Run", "connect", "open_run"]
