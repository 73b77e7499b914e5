"""Addresses of runs for a browser: the page of one, and the table of its kind with the main columns."""

from __future__ import annotations

import os
from contextlib import suppress

from shoal.errors import ComputationError

from shoal_flows import settings
from shoal_flows.tracking.record import LOCAL
from shoal_flows.tracking.store import answering, connect

_LOOK = "viewStateShareKey=studies"
"""Opens the table with the saved view of that key (`tracking.views`)."""


def run_address(run_id: str, otherwise: str | None = None) -> str | None:
    """The page of a run; None if the run is still in the outbox, there is no server, or it does not answer now.

    otherwise: the server that is meant where the runs are in a database. SHOAL_MLFLOW_URL is the server's address as a
    browser sees it, where that is not the address that tasks use.
    """
    place = _experiment(run_id, otherwise)
    return place and f"{place}/runs/{run_id}"


def table_address(run_id: str, otherwise: str | None = None) -> str | None:
    """The table of all runs of its experiment, with problem, verdict and fitness; None likewise."""
    place = _experiment(run_id, otherwise)
    return place and f"{place}/runs?{_LOOK}"


@answering()
def latest_study(server: str) -> tuple[str, str] | None:
    """The pages of the study that was begun last, and of all; None where there is none. Raises ComputationError."""
    client = connect()
    experiment = client.get_experiment_by_name("Identification")
    if experiment is None:
        return None
    found = client.search_runs([experiment.experiment_id], "tags.kind = 'study'", max_results=1)
    place = f"{server}/#/experiments/{experiment.experiment_id}"
    return (f"{place}/runs/{found[0].info.run_id}", f"{place}/runs?{_LOOK}") if found else None


def _experiment(run_id: str, otherwise: str | None) -> str | None:
    server = os.environ.get("SHOAL_MLFLOW_URL") or settings.tracking_server() or otherwise
    if not server or run_id.startswith(LOCAL):
        return None
    # A study that has ended does not fail for a link.
    with suppress(ComputationError), answering():
        return f"{server.rstrip('/')}/#/experiments/{connect().get_run(run_id).info.experiment_id}"
    return None
