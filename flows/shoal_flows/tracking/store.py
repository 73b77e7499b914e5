"""One run in MLflow: opened with its name and tags, filled in batches, ended with its status."""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from shoal.errors import ComputationError, InputError

from shoal_flows import alive, provenance, settings
from shoal_flows.tracking import data, origin, outbox, registry, views
from shoal_flows.tracking.record import LOCAL, Run

log = logging.getLogger(__name__)
_PAUSE = 60.0
_silent: dict[str, float] = {}
"""Until when [s] a server that did not answer is not asked again, by its address."""
_DAMAGED = {
    "database is locked": "the database is locked by another program",
    "file is not a database": "the file is not a database; move it away, and a new one is made",
    "disk image is malformed": "the database is damaged; move it away, and a new one is made",
}
"""What SQLite says, and what it means."""
_BATCH = 1000
_KIND = "custom_model_development"
"""What makes MLflow open on runs and metrics instead of traces of language models."""
_EXPERIMENTS = {
    "Identification": "Parameters found from measured motion: a parent per study, a child per method, case and seed.",
    "Comparison": "One scene on several engines: a parent run per scene, a child per engine.",
    "Sweep": "One scene over a grid of values.",
    "Uncertain": "Bounds and probabilities of machines whose parameters are known as intervals or distributions.",
    "Forward": "Motion of one scene on one engine.",
    "Statics": "Where a scene comes to rest.",
    "Selection": "The cheapest model of a scene that meets a tolerance.",
    "Export": "Scenes as files of other tools, with the files.",
    "Design": "What to measure to know the parameters of a problem.",
    "Validation": "The nights of `shoal validate`: error and time of every problem, engine and method.",
}


@contextmanager
def open_run(
    experiment: str,
    name: str,
    *,
    description: str = "",
    tags: Mapping[str, str] | None = None,
    parent: str | None = None,
    took: float = 0.0,
) -> Iterator[Run]:
    """A run from its start to its end; failed if an exception leaves the block, killed if a signal does.

    parent: the id of a run.

    took: how long [s] the work lasted that had ended before the block.
    Where MLflow does not answer, the run goes to the outbox: a result is never lost for that.
    """
    run = Run(experiment, name, {**_common_tags(), **(tags or {})}, parent, took=took)
    run.describe(description)
    if parent is None and (call := origin.of_flow()) is not None:
        run.files |= call
    if not _waits(run):
        _attempt(_make, run)
    try:
        with alive.held(alive.MLFLOW, run.run_id, _address()):
            try:
                yield run
            except BaseException as error:
                if isinstance(error, Exception):
                    run.judge("refused" if isinstance(error, InputError) else "failed", [str(error)], "No answer")
                run.end("FAILED" if isinstance(error, Exception) else "KILLED")
                raise
            else:
                run.end("FINISHED")
            finally:
                _deliver(run)
    finally:
        if parent is None and not _is_silent():
            # MLflow answers: what this or an earlier study could not send goes along, however this one ended.
            with suppress(ComputationError):
                upload()


@contextmanager
def or_failed(experiment: str, name: str, tags: Mapping[str, str]) -> Iterator[None]:
    """Log a failed run with the reason where the block fails."""
    try:
        yield
    except Exception as error:
        with suppress(type(error)), open_run(experiment, name, tags=tags):
            raise
        raise


def upload() -> int:
    """Send the runs of the outbox; returns how many. Raises ComputationError if MLflow does not answer."""
    with answering():
        return outbox.upload(_make, _send)


@contextmanager
def answering() -> Iterator[None]:
    """Turn errors of MLflow's server within the block into ComputationError."""
    try:
        yield
    except _failures() as error:
        raise _unreachable(error) from None


def found_run(client: Any, run_id: str) -> Any:
    """The run of that id; None if MLflow knows none. Raises ComputationError if MLflow does not answer."""
    from mlflow.exceptions import MlflowException

    with answering():
        try:
            return client.get_run(run_id)
        except MlflowException as error:
            # An id that cannot be one is an invalid value.
            if error.error_code not in ("RESOURCE_DOES_NOT_EXIST", "INVALID_PARAMETER_VALUE"):
                raise
            return None


def _attempt(what: Callable[[Run], None], run: Run) -> bool:
    """Return whether MLflow took it; one that does not answer is not asked again for a while, as every try takes
    seconds.
    """
    if _is_silent():
        return False
    try:
        what(run)
    except _failures() as error:
        _silent[_address()] = time.monotonic() + _PAUSE
        log.warning("%s; run %r is kept in %s", _unreachable(error), run.name, outbox.folder())
        return False
    return True


def _is_silent() -> bool:
    return time.monotonic() < _silent.get(_address(), 0.0)


def _deliver(run: Run) -> None:
    if not run.known or not _attempt(_send, run):
        outbox.keep(run)


def _waits(run: Run) -> bool:
    """Return whether it is part of a study that MLflow does not know yet."""
    return run.parent is not None and run.parent.startswith(LOCAL)


def _make(run: Run) -> None:
    tags = {**run.tags, "mlflow.runName": run.name}
    if run.parent:
        tags["mlflow.parentRunId"] = run.parent
    client = connect()
    start = run.started - int(1000 * run.took)
    made = client.create_run(_experiment(_address(), run.experiment), start_time=start, tags=tags, run_name=run.name)
    run.run_id = made.info.run_id


def _send(run: Run) -> None:
    """All of a run, in calls of at most 1000 metrics and 100 settings; what MLflow already has is sent again."""
    from mlflow.entities import Metric, Param, RunTag

    client = connect()
    client.log_batch(run.run_id, tags=[RunTag(*tag) for tag in run.tags.items()])
    metrics = [Metric(*row) for row in run.metrics]
    params = [Param(*row) for row in run.kept_params.items()]
    for start in range(0, max(len(metrics), 10 * len(params)), _BATCH):
        some = params[start // 10 : start // 10 + _BATCH // 10]
        client.log_batch(run.run_id, metrics=metrics[start : start + _BATCH], params=some)
    if run.data:
        client.log_inputs(run.run_id, data.inputs(run.data))
    with TemporaryDirectory() as folder:
        run.write_files(Path(folder))
        client.log_artifacts(run.run_id, folder)
    registry.enter(client, run)
    client.set_terminated(run.run_id, run.status, run.ended)


def _failures() -> tuple[type[Exception], ...]:
    """Return the exceptions of a server that is down, or of a database that cannot be read or written."""
    from mlflow.exceptions import MlflowException
    from sqlalchemy.exc import SQLAlchemyError

    return ComputationError, MlflowException, SQLAlchemyError, OSError


def connect() -> Any:
    """MLflow's client, its database made if need be. Raises ComputationError if MLflow cannot be reached."""
    return _client(_address())


def _address() -> str:
    # MLflow reads the settings when it is imported.
    settings.apply()
    return os.environ["MLFLOW_TRACKING_URI"]


@cache
def _client(address: str) -> Any:
    from mlflow import MlflowClient

    with answering():
        client = MlflowClient(address)
        client.search_experiments(max_results=1)
    return client


def _unreachable(error: Exception) -> ComputationError:
    if isinstance(error, ComputationError):
        return error
    from requests import ConnectionError as NoConnection

    # MLflow's own words for a server that is away are several lines long.
    away = isinstance(error, NoConnection) or isinstance(error.__context__, NoConnection)
    reason = "it does not answer; start it, or let MLFLOW_TRACKING_URI name another" if away else str(error)
    told = next((words for mark, words in _DAMAGED.items() if mark in reason), reason.partition("\n")[0])
    return ComputationError(f"MLflow at {os.environ['MLFLOW_TRACKING_URI']}: {told}")


@cache
def _experiment(address: str, name: str) -> str:
    """Return the id of an experiment of MLflow at an address, cached."""
    return experiment(_client(address), name)


def experiment(client: Any, name: str) -> str:
    """The id of the experiment of that name, made or brought up to date with its description and views."""
    from mlflow.exceptions import MlflowException

    found = client.get_experiment_by_name(name)
    tags = {
        "mlflow.note.content": _EXPERIMENTS[name],
        "project": "shoal",
        "mlflow.experimentKind": _KIND,
        **views.tags(name),
    }
    if found is not None:
        for key, value in tags.items():
            if found.tags.get(key) != value:
                client.set_experiment_tag(found.experiment_id, key, value)
        if found.lifecycle_stage == "deleted":
            client.restore_experiment(found.experiment_id)
        return str(found.experiment_id)
    location = None if settings.tracking_server() else (settings.artifact_folder() / name.lower()).as_uri()
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


__all__ = ["Run", "answering", "connect", "experiment", "found_run", "open_run", "upload"]
