"""`python -m shoal_flows.deployment.deploy`: deploys the flows to Prefect's server, with alerts of failed nights."""

from __future__ import annotations

import os
import subprocess
import sys

from shoal.errors import ShoalError
from shoal.shelf import shelf

from shoal_flows.deployment import alert


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
    alert.state(told)
    return 0


if __name__ == "__main__":
    sys.exit(main())
