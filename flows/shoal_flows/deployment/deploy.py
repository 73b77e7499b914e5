"""`python -m shoal_flows.deployment.deploy`: deploys the flows to Prefect's server, with alerts of failed nights."""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import suppress
from typing import TYPE_CHECKING

from shoal.errors import ShoalError
from shoal.requests.request import renamed
from shoal.shelf import shelf

from shoal_flows.deployment import alert

if TYPE_CHECKING:
    from prefect.client.orchestration import SyncPrefectClient

RENAMED = ("forward/forward", "select/select", "sweep/sensitivity", "nightly/validation")
"""Deployments of Shoal 0.1: a server that knows them would make two runs a night."""


def main() -> int:
    """Apply prefect.yaml of this folder, then $SHOAL_ALERT; returns the exit status."""
    try:
        told = alert.whom(os.environ.get("SHOAL_ALERT", ""))
    except ShoalError as error:
        sys.stderr.write(f"deploy: {error}\n")
        return error.exit_status
    shelf().identity(make=True)
    command = [sys.executable, "-m", "prefect", "--no-prompt", "deploy", "--all"]
    if status := subprocess.run(command, check=False).returncode:
        return status
    _remove_renamed()
    _rename_parameters()
    alert.state(told)
    return 0


def _remove_renamed() -> None:
    """Remove the deployments of Shoal 0.1 from the server of PREFECT_API_URL."""
    from prefect.client.orchestration import get_client
    from prefect.exceptions import ObjectNotFound

    with get_client(sync_client=True) as client:
        for name in RENAMED:
            with suppress(ObjectNotFound):
                client.delete_deployment(client.read_deployment_by_name(name).id)


def _rename_parameters() -> None:
    """State what deployments and their schedules keep on the server of PREFECT_API_URL by the names of today."""
    from prefect.client.orchestration import get_client

    with get_client(sync_client=True) as client:
        rename_parameters(client)


def rename_parameters(client: SyncPrefectClient) -> None:
    """Rename saved parameters of Shoal's flows, whose old names work for one release."""
    from prefect.client.schemas.actions import DeploymentUpdate

    from shoal_flows.flows import FLOWS

    for one in client.read_deployments():
        flow = FLOWS.get(client.read_flow(one.flow_id).name)
        request = getattr(flow and flow.fn, "request", None)
        if request is None:
            continue
        if (found := renamed(request, one.parameters, _say)) != one.parameters:
            client.update_deployment(one.id, DeploymentUpdate(parameters=found))
        for schedule in one.schedules:
            if (found := renamed(request, schedule.parameters or {}, _say)) != (schedule.parameters or {}):
                client.update_deployment_schedule(one.id, schedule.id, parameters=found)


def _say(note: str) -> None:
    sys.stderr.write(f"deploy: {note}\n")


if __name__ == "__main__":
    sys.exit(main())
