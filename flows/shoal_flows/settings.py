"""Defaults of Prefect and MLflow: quiet, private and below Shoal's home. Call `apply` before importing either."""

from __future__ import annotations

import logging
import os
from pathlib import Path

from shoal.home import home

DASK_ROUTES = '["shoal_flows.dask_health"]'
"""What schedulers and workers show, in place of Dask's own pages."""
PREFECT_PORT = 4200
"""Of Prefect's server, unless SHOAL_PREFECT_PORT says otherwise."""


def apply() -> None:
    """Set what the user has not set. Raises InputError if the home cannot be written to."""
    for name, value in defaults(home()).items():
        os.environ.setdefault(name, value)
    # Alembic announces every migration of a new database.
    for name in ("mlflow", "alembic"):
        logging.getLogger(name).setLevel(logging.WARNING)
    # An environment without pip, as of uv and in containers, is none to be warned of with every model.
    logging.getLogger("mlflow.utils.environment").setLevel(logging.ERROR)


def defaults(folder: Path) -> dict[str, str]:
    """Environment of the pipeline with its state below `folder`."""
    return {
        **guarded(os.environ.get("SHOAL_PREFECT_PORT") or PREFECT_PORT),
        "DO_NOT_TRACK": "true",
        "PREFECT_HOME": str(folder / "prefect"),
        "PREFECT_SERVER_ANALYTICS_ENABLED": "false",
        "PREFECT_SERVER_EPHEMERAL_STARTUP_TIMEOUT_SECONDS": "120",
        # The log of a flow is in Prefect's database; a terminal shows progress and the answer.
        "PREFECT_LOGGING_HANDLERS_CONSOLE_LEVEL": "CRITICAL",
        "PREFECT_CLI_COLORS": "false",
        **{f"DASK_DISTRIBUTED__{part}__HTTP__ROUTES": DASK_ROUTES for part in ("SCHEDULER", "WORKER")},
        "MLFLOW_TRACKING_URI": f"sqlite:///{folder / 'mlflow.db'}",
        "MLFLOW_DISABLE_TELEMETRY": "true",
        "MLFLOW_SERVER_ENABLE_JOB_EXECUTION": "false",
        "MLFLOW_LOGGING_LEVEL": "WARNING",
        # A server that does not answer is soon known not to: what it should have is kept (`tracking.outbox`).
        "MLFLOW_HTTP_REQUEST_MAX_RETRIES": "2",
        "MLFLOW_HTTP_REQUEST_TIMEOUT": "30",
        "MLFLOW_SUPPRESS_PRINTING_URL_TO_STDOUT": "true",
    }


def guarded(port: int | str) -> dict[str, str]:
    """Return the environment of a Prefect server whose pages are at this port, and whose pages alone may use it."""
    return {
        "PREFECT_SERVER_CORS_ALLOWED_ORIGINS": f"http://127.0.0.1:{port},http://localhost:{port}",
        "PREFECT_SERVER_CSRF_PROTECTION_ENABLED": "true",
        # The other pages ask amplitude.com what to count of their visitors; see `prefect_server`.
        "PREFECT_SERVER_UI_V2_ENABLED": "false",
        "PREFECT_SERVER_UI_SHOW_PROMOTIONAL_CONTENT": "false",
    }


def artifact_folder() -> Path:
    """Return the folder of artifacts, unless an MLflow server keeps them."""
    return home() / "artifacts"


def log_folder() -> Path:
    """Return the folder of the servers' logs, made on demand."""
    folder = home() / "logs"
    folder.mkdir(exist_ok=True)
    return folder


def tracking_server() -> str | None:
    """The address of the MLflow server that takes the runs and their artifacts; None if they go to a database."""
    address = os.environ["MLFLOW_TRACKING_URI"]
    return address if address.startswith(("http:", "https:", "databricks")) else None
