"""MLflow's server with pages that open on runs and metrics: `mlflow server --app-name shoal`.

They open on traces of language models until the browser remembers something else. A page sets it once, where the
browser remembers nothing: later choices of users are kept. MLflow's assistant, which runs commands of the server's
user, and its gateway to language models elsewhere are switched off. Requests of other origins are refused, also those
of other ports of this machine, which MLflow lets in. MLflow's own check of hosts, whose default `10.*` is met by
10.evil.example, compares with the names of this server.
"""

from __future__ import annotations

import json
import os
from typing import Any

from shoal.api.guard import Guard, allowed_hosts

_HOSTS = allowed_hosts()
os.environ.setdefault(
    "MLFLOW_SERVER_ALLOWED_HOSTS",
    ",".join(pattern for name in _HOSTS for pattern in (name, f"{name.replace('[', '[[]', 1)}:*")),
)
os.environ.setdefault("MLFLOW_ENABLE_AI_GATEWAY", "false")

# MLflow reads its settings when it is imported.
from flask import request  # noqa: E402
from mlflow.server import app as pages  # noqa: E402
from mlflow.server.fastapi_app import app as mlflow  # noqa: E402

_OFF = (
    "/ajax-api/3.0/mlflow/assistant",
    "/ajax-api/3.0/mlflow/gateway",
    "/ajax-api/2.0/mlflow/gateway-proxy",
    "/gateway",
)
"""Paths that lead to language models, and to commands on this machine by their means."""
_POLICY = "; ".join(
    (
        # Pages of artifacts, such as a study's report, are shown within MLflow's and bring scripts along.
        "default-src 'self' 'unsafe-inline' 'unsafe-eval' data: blob:",
        "object-src 'none'",
        "base-uri 'self'",
        "form-action 'self'",
        "frame-ancestors 'self'",
    )
)
"""Nothing is loaded from and nothing sent to another server."""
_REMEMBERED = {
    "mlflow.workflowType_v1": '"machine_learning"',
    "mlflow.assistant.fab.autoOpenedOnFirstLoad_v1": "true",
    "_mlflow_model_registry_promo_modal_dismissed_v1": "true",
    # The server passes no usage data on (`settings.defaults`): the pages need not collect any, nor ask.
    "mlflow.settings.telemetry.enabled_v1": "false",
    "mlflow.telemetry.info.alert.dismissed_v1": "true",
}
"""What the pages keep in the browser's storage, as MLflow 3.17 writes it."""
_HEAD = (
    "<style>[data-assistant-ui] { display: none !important; }</style>"
    f"<script>for (const [key, value] of Object.entries({json.dumps(_REMEMBERED)})) "
    "if (localStorage.getItem(key) === null) localStorage.setItem(key, value);</script>"
)


@pages.after_request  # type: ignore[untyped-decorator, unused-ignore]
def _told(response: Any) -> Any:
    """Put the script at the head of the only page there is."""
    if request.path == "/" and response.status_code == 200:
        response.direct_passthrough = False
        response.set_data(response.get_data(as_text=True).replace("<head>", f"<head>{_HEAD}", 1))
        # The file's own mark, which a browser that has the unchanged page would show.
        response.headers.remove("ETag")
    return response


app = Guard(
    mlflow,
    _HOSTS,
    [origin for origin in os.environ.get("MLFLOW_SERVER_CORS_ALLOWED_ORIGINS", "").split(",") if origin],
    {"Content-Security-Policy": _POLICY, "Referrer-Policy": "same-origin"},
    _OFF,
)
__all__ = ["app"]
