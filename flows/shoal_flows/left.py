"""Runs whose process was stopped or killed: they are ended in MLflow and in Prefect, with a word why."""

from __future__ import annotations

import os
from uuid import UUID

from shoal.errors import ComputationError

from shoal_flows import alive, server, settings
from shoal_flows.alive import MLFLOW, Mark

WHY = "broken off: the process that ran it was stopped or killed"


def end_left() -> int:
    """End the runs of this home that nobody runs any more; returns how many. What cannot be reached is left for later.

    A run that another server knows than those of PREFECT_API_URL and MLFLOW_TRACKING_URI is left to whoever uses that.
    """
    settings.apply()
    return alive.settle(_end)


def _end(mark: Mark) -> bool:
    """Whether there is nothing left to do for this run."""
    from httpx import HTTPError

    try:
        return _end_in_mlflow(mark) if mark.kind == MLFLOW else _end_in_prefect(mark)
    except (ComputationError, HTTPError, OSError):
        return False


def _end_in_mlflow(mark: Mark) -> bool:
    from shoal_flows.tracking.store import answering, connect, found_run

    client = connect()
    run = found_run(client, mark.run_id)
    if run is None:
        return mark.server == os.environ["MLFLOW_TRACKING_URI"]
    if run.info.status == "RUNNING":
        with answering():
            client.set_tag(mark.run_id, "broken_off", WHY)
            client.set_terminated(mark.run_id, "KILLED")
    return True


def _end_in_prefect(mark: Mark) -> bool:
    from prefect.client.orchestration import get_client
    from prefect.client.schemas.filters import FlowRunFilter, FlowRunFilterId
    from prefect.exceptions import ObjectNotFound
    from prefect.states import Crashed

    with get_client(sync_client=True) as client:
        try:
            run = client.read_flow_run(UUID(mark.run_id))
        except ObjectNotFound:
            return mark.server == server.shared()
        # One that was asked for again waits for its worker.
        if run.state is not None and (run.state.is_running() or run.state.is_cancelling()):
            client.set_flow_run_state(run.id, Crashed(message=WHY), force=True)
            of_run = FlowRunFilter(id=FlowRunFilterId(any_=[run.id]))
            for task in client.read_task_runs(flow_run_filter=of_run):
                if task.state is not None and not task.state.is_final():
                    client.set_task_run_state(task.id, Crashed(message=WHY), force=True)
    return True
