"""Run the program of an engine until Ctrl-C."""

from __future__ import annotations

import uvicorn

from shoal.api.program import create_program
from shoal.api.settings import Settings

PORTS = {"gauss": 8001, "exudyn": 8002, "exudyn-ge": 8002, "casadi": 8003}
"""Where an engine is served unless somebody says otherwise."""


def serve(engine: str, host: str, port: int | None) -> None:
    """Serve an engine. Raises InputError."""
    settings = Settings.read()
    uvicorn.run(
        create_program(engine, settings),
        host=host,
        port=port or PORTS[engine],
        limit_concurrency=settings.connections,
        timeout_graceful_shutdown=5,
        access_log=False,
        server_header=False,
    )
