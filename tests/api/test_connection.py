"""What a peer owes a server, and for how long: by sockets on this machine, without workers."""

from __future__ import annotations

import asyncio
import http.client
import json
import logging
import random
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

import pytest
import uvicorn
from running import eventually, listening, port_of
from shoal.api.access import AccessLog
from shoal.api.connection import BoundedProtocol, Crowd, Patience, bounded

LONG = 1000.0
"""Seconds that no test waits for."""
GREETING = b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n"
CHUNKED = b"POST /unread HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n"


async def program(scope: Any, receive: Any, send: Any) -> None:
    """Answers with what it is asked for: /read the size of the body, /large 64 MB, anything else at once."""
    size = 0
    if scope["path"] == "/read":
        more = True
        while more:
            message = await receive()
            if message["type"] == "http.disconnect":
                return
            size, more = size + len(message["body"]), message["more_body"]
    body = b"x" * 2**26 if scope["path"] == "/large" else str(size).encode()
    start = {"type": "http.response.start", "status": 200, "headers": [(b"content-length", str(len(body)).encode())]}
    await send(start)
    await send({"type": "http.response.body", "body": body})


@contextmanager
def served(patience: Patience, application: Any = program) -> Iterator[uvicorn.Server]:
    config = uvicorn.Config(
        application, port=0, http=bounded(patience), ws="none", lifespan="off", log_config=None, timeout_keep_alive=600
    )
    with listening(config) as server:
        yield server


_opened: list[socket.socket] = []


@pytest.fixture(autouse=True)
def _closed() -> Iterator[None]:
    yield
    while _opened:
        _opened.pop().close()


@pytest.fixture(scope="module")
def patient() -> Iterator[uvicorn.Server]:
    with served(Patience()) as server:
        yield server


def connected(server: uvicorn.Server, data: bytes = b"") -> socket.socket:
    found = socket.create_connection(("127.0.0.1", port_of(server)), 60)
    _opened.append(found)
    found.sendall(data)
    return found


def answer(connection: socket.socket) -> bytes:
    """The head of what comes; nothing if the other side has ended."""
    try:
        return connection.recv(4096)
    except ConnectionError:
        return b""


def ended(connection: socket.socket, drip: bytes) -> bool:
    """Whether the other side ends the connection while this goes on to send."""
    connection.settimeout(0.05)
    for _ in range(2000):
        try:
            connection.sendall(drip)
            if not connection.recv(4096):
                return True
        except TimeoutError:
            continue
        except ConnectionError:
            return True
    return False


@pytest.mark.parametrize("begin", [b"GET / HTTP/1.1\r\nA: ", GREETING + b"GET / HTTP/1.1\r\nA: "])
def test_headers_that_never_end(begin: bytes) -> None:
    """Of the first request of a connection and of a later one, however steadily they drip."""
    with served(Patience(header_seconds=1.0)) as server:
        assert ended(connected(server, begin), b"a")


def test_who_is_late_with_headers_is_told_and_logged(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, "shoal.api.access")
    with served(Patience(header_seconds=0.5)) as server:
        assert answer(connected(server, b"GET / HT")).startswith(b"HTTP/1.1 408 ")
        assert answer(connected(server)) == b""  # who has said nothing hears nothing
    (line,) = [json.loads(record.message) for record in caplog.records if record.name == "shoal.api.access"]
    assert (line["status"], line["client"], line["operation"]) == (408, "127.0.0.1", None)


@pytest.mark.parametrize("path", [b"/unread", b"/read"])
def test_a_body_that_never_ends(path: bytes) -> None:
    """Whether the program waits for it or has answered already."""
    with served(Patience(body_seconds=1.0)) as server:
        assert ended(connected(server, CHUNKED.replace(b"/unread", path)), b"1\r\na\r\n")


def test_a_body_that_goes_on_after_its_answer_is_bounded_in_size() -> None:
    with served(Patience(body_seconds=LONG, body_bytes=10_000)) as server:
        assert ended(connected(server, CHUNKED), b"3e8\r\n" + b"a" * 1000 + b"\r\n")


def test_an_answer_that_is_not_taken() -> None:
    """Neither at all, nor byte by byte."""
    with served(Patience(body_seconds=1.0)) as server:
        idle, slow = (connected(server, GREETING.replace(b"/", b"/large", 1)) for _ in range(2))

        def gone() -> bool:
            slow.recv(1)
            return not server.server_state.connections

        eventually(lambda: len(server.server_state.connections) == 2)
        eventually(gone)
        assert answer(idle)  # what had been sent before


def test_half_open_connections_shut_nobody_out() -> None:
    """As many as there may be and more: the oldest give way, and the latest is served."""
    places = 8
    with served(Patience(header_seconds=LONG, body_seconds=LONG, connections=places)) as server:
        rng = random.Random(1)
        openings = [b"", b"GET / HT", GREETING, CHUNKED, CHUNKED.replace(b"/unread", b"/read")]
        held = [connected(server, rng.choice(openings)) for _ in range(3 * places)]
        for _ in range(places):
            assert answer(connected(server, GREETING)).startswith(b"HTTP/1.1 200 ")
        assert len(server.server_state.connections) <= places
        assert len(held) > places


def test_who_waits_for_an_answer_does_not_give_way() -> None:
    """Requests that are computed keep their places; another is refused, with a line in the log."""
    release = asyncio.Event()

    async def waits(scope: Any, receive: Any, send: Any) -> None:
        await release.wait()
        await program(scope, receive, send)

    with served(Patience(connections=3), AccessLog(Crowd(waits, 3))) as server:
        waiting = [connected(server, GREETING) for _ in range(3)]
        eventually(lambda: sum(_computing(one) for one in server.server_state.connections) == 3)
        for _ in range(5):
            refused = answer(connected(server, GREETING))
            assert refused.startswith(b"HTTP/1.1 503 ")
            assert b"retry-after: 1" in refused
        server.servers[0].get_loop().call_soon_threadsafe(release.set)
        assert all(answer(one).startswith(b"HTTP/1.1 200 ") for one in waiting)


def _computing(connection: Any) -> bool:
    assert isinstance(connection, BoundedProtocol)
    return connection.computing


@pytest.mark.parametrize("seed", range(40))
def test_folded_headers(seed: int, patient: uvicorn.Server) -> None:
    """Random headers in random pieces: refused if and only if a line begins with white space."""
    rng = random.Random(seed)
    requests, folded = [], False
    for _ in range(rng.randint(1, 2)):
        lines = [b"GET / HTTP/1.1", b"Host: localhost"]
        for k in range(rng.randint(0, 5)):
            lines.append(b"X-%d: %s" % (k, rng.choice([b"", b"a", b" a  b", b"\ta"])))
            if rng.random() < 0.1:
                lines.append(rng.choice([b" ", b"\t", b"  "]) + b"c")
                folded = True
        requests.append(rng.choice([b"\r\n", b"\n"]).join(lines) + b"\r\n\r\n")
    data = b"".join(requests)
    cuts = sorted(rng.sample(range(1, len(data)), 3))
    connection = connected(patient)
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    with suppress(OSError):  # a request that is refused may end the connection before it is whole
        for begin, end in zip([0, *cuts], [*cuts, len(data)], strict=True):
            connection.sendall(data[begin:end])
        connection.shutdown(socket.SHUT_WR)
    said = b""
    while more := answer(connection):
        said += more
    assert (b"HTTP/1.1 400 " in said) == folded
    assert said.count(b"HTTP/1.1 200 ") == len(requests) or folded


def test_two_lengths_of_one_body(patient: uvicorn.Server) -> None:
    """Two servers in a row may read two bodies (request smuggling)."""
    data = CHUNKED.replace(b"Transfer", b"Content-Length: 3\r\nTransfer") + b"0\r\n\r\n"
    assert answer(connected(patient, data)).startswith(b"HTTP/1.1 400 ")


def test_an_ordinary_client_is_left_alone() -> None:
    """Requests one after the other over one connection for longer than any of them may take."""
    with served(Patience(header_seconds=1.0, body_seconds=1.0, body_bytes=10, connections=1)) as server:
        client = http.client.HTTPConnection("127.0.0.1", port_of(server), 60)
        for _ in range(16):
            time.sleep(0.15)
            client.request("POST", "/read", b"a" * 100)
            assert client.getresponse().read() == b"100"
        assert client.sock.getpeername()[1] == port_of(server)
        client.close()
