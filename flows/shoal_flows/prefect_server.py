"""Prefect's server behind the checks of Shoal's own: `python -m shoal_flows.prefect_server --port 4200`.

`prefect server start` answers any Host and Origin, and its second set of pages asks a host
elsewhere. Here requests of other origins are refused, websockets included, which CORS does not cover; peers have a
limited time; and pages are served that may load from and connect to this server alone.
"""

from __future__ import annotations

import os
import socket
from pathlib import Path
from typing import Any

import click

from shoal_flows import settings

UPLOAD_SECONDS = 300.0
"""For a body: flows send results and logs over slow networks."""


@click.command()
@click.option("--host", default="127.0.0.1", show_default=True, help="Address to listen on.")
@click.option("--port", type=int, default=4200, show_default=True, help="Port to listen on.")
@click.option("--descriptor", type=int, help="Socket to listen on, which another process keeps open; without services.")
def main(host: str, port: int, descriptor: int | None) -> None:
    """Serve Prefect's interface and pages with its background services, until SIGTERM."""
    for name, value in settings.guarded(port).items():
        os.environ.setdefault(name, value)
    config = _configured(host, port, webserver_only=descriptor is not None)
    import uvicorn

    listening = None if descriptor is None else [socket.socket(fileno=descriptor)]
    uvicorn.Server(config).run(sockets=listening)


def _configured(host: str, port: int, *, webserver_only: bool) -> Any:
    """Return how uvicorn serves it, as `prefect server start` does but for the checks."""
    import prefect
    import uvicorn
    from prefect.server.api.server import create_app
    from prefect.settings import get_current_settings
    from shoal.api.connection import Patience, bounded
    from shoal.api.guard import Guard, allowed_hosts

    # The second set of pages is offered wherever its files are found, whatever the settings say.
    prefect.__ui_v2_static_path__ = Path(os.devnull)
    api = get_current_settings().server.api
    origins = [origin.strip() for origin in os.environ["PREFECT_SERVER_CORS_ALLOWED_ORIGINS"].split(",")]
    program = Guard(
        create_app(webserver_only=webserver_only, final=True),
        allowed_hosts(host),
        origins,
        {
            "Content-Security-Policy": _policy(origins),
            "X-Frame-Options": "SAMEORIGIN",
            "Referrer-Policy": "same-origin",
        },
        # Pages on the API that load their scripts from elsewhere.
        off=("/docs", "/redoc", "/api/docs", "/api/redoc"),
    )
    return uvicorn.Config(
        program,
        host=host,
        port=port,
        http=bounded(Patience(body_seconds=UPLOAD_SECONDS)),
        timeout_keep_alive=api.keepalive_timeout,
        ws_ping_interval=api.websocket_ping_interval,
        ws_ping_timeout=api.websocket_ping_timeout,
        log_level="warning",
        timeout_graceful_shutdown=5,
        forwarded_allow_ips=os.environ.get("FORWARDED_ALLOW_IPS", ""),
    )


def _policy(origins: list[str]) -> str:
    """Return the content security policy of the pages: everything is loaded from here, and nothing sent elsewhere."""
    reached = " ".join([*origins, *(origin.replace("http", "ws", 1) for origin in origins)])
    return "; ".join(
        (
            "default-src 'self'",
            f"connect-src 'self' {reached}",
            # The graph of a run compiles its shaders.
            "script-src 'self' 'unsafe-eval'",
            "style-src 'self' 'unsafe-inline'",
            "img-src 'self' data: blob:",
            "font-src 'self' data:",
            "worker-src 'self' blob:",
            "object-src 'none'",
            "base-uri 'self'",
            "form-action 'self'",
            "frame-ancestors 'self'",
        )
    )


if __name__ == "__main__":
    main()
