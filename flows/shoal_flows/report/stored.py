"""Identifications that MLflow keeps, as the answers that a page is made of."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from shoal.errors import InputError
from shoal.pictures.answer import Answer
from shoal.pictures.archive import parse

from shoal_flows.tracking.identification import ARCHIVE
from shoal_flows.tracking.store import answering, connect, found_run


@answering()
def stored(run_id: str) -> dict[str, Answer]:
    """The answer of a run, or those of all runs of a study, by their names. Raises InputError, ComputationError."""
    client = connect()
    run = found_run(client, run_id)
    if run is None:
        raise InputError(f"run: {run_id} is neither a file nor the id of a run in MLflow; `shoal ui` shows them")
    children = client.search_runs([run.info.experiment_id], f"tags.`mlflow.parentRunId` = '{run_id}'")
    # MLflow lists the latest first.
    runs = [
        one
        for one in (run, *reversed(children))
        if any(a.path == ARCHIVE for a in client.list_artifacts(one.info.run_id))
    ]
    if not runs:
        raise InputError(
            f"run: {run_id} ({run.info.run_name}) holds no identification; name one of the experiment Identification"
        )
    return {str(one.info.run_name): _read(client, one.info.run_id) for one in runs}


def _read(client: Any, run_id: str) -> Answer:
    with TemporaryDirectory() as folder:
        file = Path(client.download_artifacts(run_id, ARCHIVE, folder))
        return parse(file.read_text(encoding="utf-8"), f"run {run_id}")
