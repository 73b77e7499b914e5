"""`python -m shoal_flows.deployment.deploy`: deploys the flows to Prefect's server, with alerts of failed nights."""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import suppress

from shoal.errors import ShoalError
from shoal.shelf import shelf

from shoal_flows.deployment import alert

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


if __name__ == "__main__":
    sys.exit(main())
