"""MLflow's server with pages that open on runs and metrics: `mlflow server --app-name shoal`.

They open on traces of language models, with an assistant at the side, until the browser remembers something else. So
it is told once, where it remembers nothing: whoever chooses otherwise stays with that.
"""

from __future__ import annotations

import json
from typing import Any

from flask import request
from mlflow.server import app as pages
from mlflow.server.fastapi_app import app

_REMEMBERED = {
    "mlflow.workflowType_v1": '"machine_learning"',
    "mlflow.assistant.fab.autoOpenedOnFirstLoad_v1": "true",
    "_mlflow_model_registry_promo_modal_dismissed_v1": "true",
    # The server passes no usage data on (`settings.defaults`): the pages need not collect any, nor ask.
    "mlflow.settings.telemetry.enabled_v1": "false",
    "mlflow.telemetry.info.alert.dismissed_v1": "true",
}
"""What the pages keep in the browser's storage, as MLflow 3.17 writes it."""
_SCRIPT = (
    f"<script>for (const [key, value] of Object.entries({json.dumps(_REMEMBERED)})) "
    "if (localStorage.getItem(key) === null) localStorage.setItem(key, value);</script>"
)


@pages.after_request  # type: ignore[untyped-decorator, unused-ignore]
def _told(response: Any) -> Any:
    """Put the script at the head of the only page there is."""
    if request.path == "/" and response.status_code == 200:
        response.direct_passthrough = False
        response.set_data(response.get_data(as_text=True).replace("<head>", f"<head>{_SCRIPT}", 1))
        # The file's own mark, which a browser that has the unchanged page would show.
        response.headers.remove("ETag")
    return response


__all__ = ["app"]
