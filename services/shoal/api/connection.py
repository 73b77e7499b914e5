"""HTTP connections whose peers have a limited time: a protocol of uvicorn's for services and servers.

What a peer owes is, in turn, a request line with headers, a body, and the reception of the answer. Whoever is late with
any of them loses the connection; where too many are open, the one that has owed something longest does. See RFC 9112.
"""

from __future__ import annotations

import asyncio
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, cast

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

from shoal.api import access
from shoal.api.guard import Application, Receive, Scope, Send
from shoal.api.refusal import Refusal, problem_response

if TYPE_CHECKING:
    from uvicorn.protocols.http.h11_impl import RequestResponseCycle

HEADER_BYTES = 16 * 1024
"""Request line and headers together, as h11's default."""
HANDSHAKE_SECONDS = 10.0
"""For TLS, in place of asyncio's minute."""
SLOWEST = 1000.0
"""Bytes per second that a peer has to take of an answer, on average over the time for a body: a modem does."""
_TICK = 0.5
"""Seconds between two looks at a connection."""


@dataclass(frozen=True)
class Patience:
    """Limits of a server for its peers.

    header_seconds: from the beginning of a connection, or from the last answer, until the headers are complete
    body_seconds: from there until the body is complete; None for no limit
    body_bytes: of a body that goes on when it has been answered already; None for no limit
    connections: open at once; beyond, connections with incomplete requests are closed, the oldest first; None: no limit
    """

    header_seconds: float = 10.0
    body_seconds: float | None = 30.0
    body_bytes: int | None = None
    connections: int | None = None


class StrictConnection(h11.Connection):
    """A connection that refuses what RFC 9112 forbids and h11 reads: folded headers, and two lengths of one body."""

    def next_event(self) -> Any:
        """Return the next event. Raises h11.RemoteProtocolError."""
        if self.their_state is h11.IDLE and _has_folded_header(self.trailing_data[0]):
            raise h11.RemoteProtocolError("obsolete line folding in a header")
        event = super().next_event()
        names = {name for name, _ in event.headers} if isinstance(event, h11.Request) else set()
        if {b"content-length", b"transfer-encoding"} <= names:
            raise h11.RemoteProtocolError("both Content-Length and Transfer-Encoding")
        return event


def _has_folded_header(data: bytes) -> bool:
    """Return whether a line before the first empty one begins with white space."""
    lines = data.replace(b"\r\n", b"\n").partition(b"\n\n")[0].split(b"\n")
    return any(line[:1] in (b" ", b"\t") for line in lines[1:])


class BoundedProtocol(H11Protocol):
    """An HTTP connection within a server's patience; made by `bounded`."""

    patience = Patience()

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Start the clock of a new connection, and make room for it."""
        super().connection_made(transport)
        self.conn = StrictConnection(h11.SERVER, HEADER_BYTES)
        self._owing: tuple[Any, int] | None = None
        self.since = self.loop.time()
        self._unsent, self._unsent_since = 0, self.since
        self._surplus = 0
        self._timer: asyncio.TimerHandle | None = self.loop.call_later(_TICK, self._look)
        self._make_room()

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop the clock."""
        self._stop()
        super().connection_lost(exc)

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        """Leave the connection to the protocol of websockets, which has pings of its own."""
        self._stop()
        super().handle_websocket_upgrade(event)

    def data_received(self, data: bytes) -> None:
        """Read on, but no more than is granted of a body that has been answered already."""
        if self.conn.their_state is h11.SEND_BODY and self.cycle.response_complete:
            self._surplus += len(data)
            if self.patience.body_bytes is not None and self._surplus > self.patience.body_bytes:
                self.transport.abort()
                return
        super().data_received(data)

    def send_400_response(self, msg: str) -> None:
        """Refuse what cannot be read as a request."""
        self._log(400)
        super().send_400_response(msg)

    def on_response_complete(self) -> None:
        """Begin to count what arrives of a body beyond its answer."""
        self._surplus = 0
        super().on_response_complete()

    @property
    def computing(self) -> bool:
        """Return whether the peer waits for the server: a request is complete and its answer is not."""
        cycle = cast("RequestResponseCycle | None", self.cycle)
        return cycle is not None and not cycle.response_complete and not self._sending_body()

    def _sending_body(self) -> bool:
        return self.conn.their_state is h11.SEND_BODY

    def _stop(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _log(self, status: int) -> None:
        """Log a request that no program has seen."""
        access.write(datetime.now(UTC), self.client, status, self.loop.time() - self.since)

    def _make_room(self) -> None:
        """Close those that owe something, the oldest first, until one connection more fits."""
        limit = self.patience.connections
        while limit is not None and len(self.connections) > limit:
            others = [one for one in self.connections if one is not self and isinstance(one, BoundedProtocol)]
            owing = [one for one in others if not one.computing]
            if not owing:
                return
            oldest = min(owing, key=lambda one: one.since)
            self.connections.discard(oldest)
            oldest.transport.abort()

    def _look(self) -> None:
        """Close the connection if its peer is late; else look again."""
        now = self.loop.time()
        if self._owes_header_or_body(now) or self._owes_reception(now):
            self._timer = None
            self._close()
        else:
            self._timer = self.loop.call_later(_TICK, self._look)

    def _owes_header_or_body(self, now: float) -> bool:
        owing = (self.conn.their_state, id(self.cycle))
        if owing != self._owing:
            # The clock of the first request began with the connection.
            self.since = self.since if self._owing is None else now
            self._owing = owing
        limits = {h11.IDLE: self.patience.header_seconds, h11.SEND_BODY: self.patience.body_seconds}
        limit = limits.get(self.conn.their_state)
        return limit is not None and now - self.since > limit

    def _owes_reception(self, now: float) -> bool:
        """Return whether less than is due has been taken of an answer."""
        unsent, seconds = self.transport.get_write_buffer_size(), self.patience.body_seconds
        if seconds is None or not unsent or not self._unsent:
            self._unsent, self._unsent_since = unsent, now
        elif now - self._unsent_since > seconds:
            if self._unsent - unsent < SLOWEST * seconds:
                return True
            self._unsent, self._unsent_since = unsent, now
        return False

    def _close(self) -> None:
        """Answer that the request took too long, unless an answer has begun, and drop the connection."""
        said_nothing = self.conn.our_state in (h11.IDLE, h11.SEND_RESPONSE)
        begun = self.conn.their_state is not h11.IDLE or bool(self.conn.trailing_data[0])
        if said_nothing and begun and not self.transport.is_closing() and not self.transport.get_write_buffer_size():
            if self.conn.their_state is h11.IDLE:
                self._log(408)
            self.transport.write(b"HTTP/1.1 408 Request Timeout\r\nConnection: close\r\nContent-Length: 0\r\n\r\n")
            self.transport.close()
            self.loop.call_later(_TICK, self.transport.abort)
        else:
            self.transport.abort()


def bounded(patience: Patience) -> type[BoundedProtocol]:
    """Return the protocol that grants this, for `uvicorn.Config(http=...)`."""
    return type("Bounded", (BoundedProtocol,), {"patience": patience})


class HandshakeLoop(asyncio.SelectorEventLoop):
    """An event loop whose servers end TLS handshakes that take too long; a protocol knows nothing of them yet."""

    async def create_server(self, *arguments: Any, **options: Any) -> asyncio.Server:
        """Listen as asyncio does, with a limit of our own."""
        if options.get("ssl") is not None:
            options["ssl_handshake_timeout"] = HANDSHAKE_SECONDS
        return await super().create_server(*arguments, **options)


class Crowd:
    """ASGI middleware that limits the number of concurrent requests; more are refused at once."""

    def __init__(self, application: Application, most: int) -> None:
        self.application, self.most, self._now = application, most, 0

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or refuse it."""
        if scope["type"] != "http":
            return await self.application(scope, receive, send)
        if self._now >= self.most:
            text = f"{self.most} requests are open, and this service takes no more"
            refusal = Refusal("crowded", text, headers={"Retry-After": "1", "Connection": "close"})
            return await problem_response(refusal)(scope, receive, send)
        self._now += 1
        try:
            return await self.application(scope, receive, send)
        finally:
            self._now -= 1
