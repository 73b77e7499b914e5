"""Runs whose process was stopped, killed or never began: they are ended in MLflow and in Prefect, with a reason."""

from __future__ import annotations

import os
import time
from uuid import UUID

from shoal.errors import ComputationError

from shoal_flows import alive, server, settings
from shoal_flows.alive import MLFLOW, PREFECT, Mark

WHY = "broken off: the process that ran it was stopped or killed"
UNSTARTED = "never begun: Prefect's worker took this run, and no process began it; ask for it again"


def end_left() -> int:
    """End the orphaned runs of this home, and return their number. Those of unreachable servers are left for later.

    Runs of servers other than those of PREFECT_API_URL and MLFLOW_TRACKING_URI are left alone.
    """
    settings.apply()
    return alive.settle(_end)


class Unstarted:
    """Flow runs of a work pool that a worker took and that no process begins.

    Where the server or its database is away while a run is submitted, Prefect's worker neither submits it again nor
    reports the failure later: the run would stay "Pending" or "Submitting" for ever.
    """

    def __init__(self, pool: str) -> None:
        self._pool = pool
        self._since: dict[UUID, float] = {}

    def end(self, patience: float) -> int:
        """Crash those that were in one state at all calls of the last `patience` seconds; return how many.

        No clock is compared with another machine's. Nothing happens while no server answers.
        """
        from httpx import HTTPError
        from prefect.client.orchestration import get_client
        from prefect.client.schemas.filters import (
            FlowRunFilter,
            FlowRunFilterState,
            FlowRunFilterStateType,
            WorkPoolFilter,
            WorkPoolFilterName,
        )
        from prefect.client.schemas.objects import StateType
        from prefect.states import Crashed

        pending = FlowRunFilter(state=FlowRunFilterState(type=FlowRunFilterStateType(any_=[StateType.PENDING])))
        pool = WorkPoolFilter(name=WorkPoolFilterName(any_=[self._pool]))
        begun, now, ended = alive.run_ids(PREFECT), time.monotonic(), 0
        try:
            with get_client(sync_client=True) as client:
                found = client.read_flow_runs(flow_run_filter=pending, work_pool_filter=pool)
                states = {run.state.id: run.id for run in found if run.state and str(run.id) not in begun}
                self._since = {state: self._since.get(state, now) for state in states}
                for state, run in states.items():
                    if now - self._since[state] >= patience:
                        client.set_flow_run_state(run, Crashed(message=UNSTARTED), force=True)
                        ended += 1
        except (HTTPError, OSError):
            self._since = {}
        return ended


def _end(mark: Mark) -> bool:
    """Return whether there is nothing left to do for this run."""
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
