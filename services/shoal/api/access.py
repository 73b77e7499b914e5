"""Access log of a service: one JSON object a line for each request, by Python's logging, logger `shoal.api.access`.

A line holds what identifies a request and nothing that may be a secret: no query, no header, no body, and no path of
what is no endpoint.
"""

from __future__ import annotations

import json
import logging
import time
from collections.abc import Sequence
from datetime import UTC, datetime

from shoal.api.guard import Application, Message, Receive, Scope, Send

log = logging.getLogger("shoal.api.access")
KEY_NAME = "key_name"
"""Where the state of a request holds the name of its API key."""
PROBES = "GET /health", "GET /ready"
"""Asked for several times a second by whoever waits for a service, and every few seconds by whoever watches it."""
CLIENTS = 64
"""Whose probes are remembered at most."""


class AccessLog:
    """ASGI middleware that logs each request when it has been answered, a repeated probe if its status has changed.

    A line holds: time (UTC, when the request began), client (its address), key (the name of its API key), operation
    (method and endpoint, as in /openapi.json), entry (KIND/NAME of the library, or the identifier of a job), status
    (None if the client left before), seconds (until the answer was complete).
    """

    def __init__(self, application: Application) -> None:
        self.application = application
        self._probed: dict[tuple[str, object], int | None] = {}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on and log it."""
        if scope["type"] != "http":
            return await self.application(scope, receive, send)
        begun, start, status = datetime.now(UTC), time.perf_counter(), None

        async def sending(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
            await send(message)

        try:
            await self.application(scope, receive, sending)
        except Exception:
            # It is answered outside of all middleware.
            status = status or 500
            raise
        finally:
            route, about = scope.get("route"), scope.get("path_params", {})
            operation = f"{scope['method']} {_endpoint(scope['path'], route.path)}" if route is not None else None
            client = scope.get("client")
            if not self._is_repeated(operation, client, status):
                write(
                    begun,
                    client,
                    status,
                    time.perf_counter() - start,
                    key=scope.get("state", {}).get(KEY_NAME),
                    operation=operation,
                    entry="/".join(map(str, about.values())) or None,
                )

    def _is_repeated(self, operation: str | None, client: Sequence[object] | None, status: int | None) -> bool:
        """Return whether this is a probe by a client that has had the same status before."""
        if operation not in PROBES:
            return False
        asked = operation, client[0] if client else None
        repeated = asked in self._probed and self._probed[asked] == status
        if len(self._probed) < CLIENTS or asked in self._probed:
            self._probed[asked] = status
        return repeated


def _endpoint(path: str, template: str) -> str:
    """Return the template of a whole path; that of a route lacks the prefix of a router which is included twice."""
    words = template.split("/")[1:]
    return "/".join([*path.split("/")[: -len(words)], *words])


def write(
    begun: datetime,
    client: Sequence[object] | None,
    status: int | None,
    seconds: float,
    *,
    key: str | None = None,
    operation: str | None = None,
    entry: str | None = None,
) -> None:
    """Log one request; without an operation where none could be read."""
    line = {
        "time": begun.isoformat(timespec="milliseconds"),
        "client": client[0] if client else None,
        "key": key,
        "operation": operation,
        "entry": entry,
        "status": status,
        "seconds": round(seconds, 6),
    }
    log.info(json.dumps(line))
