"""Prefect's server on a socket that another process keeps open: `python -m shoal_flows.embedded DESCRIPTOR`."""

from __future__ import annotations

import socket
import sys


def main(descriptor: int) -> None:
    """Serve Prefect's interface, without pages and background services, until SIGTERM."""
    import uvicorn
    from prefect.server.api.server import create_app

    application = create_app(webserver_only=True, final=True)
    config = uvicorn.Config(application, log_level="warning", timeout_graceful_shutdown=5)
    uvicorn.Server(config).run(sockets=[socket.socket(fileno=descriptor)])


if __name__ == "__main__":
    main(int(sys.argv[1]))
