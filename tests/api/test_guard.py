"""Hosts and origins, drawn at random, against the standard library's reading of addresses."""

from __future__ import annotations

import asyncio
import random
from typing import Any
from urllib.parse import urlsplit

import pytest
from shoal.api.guard import LOOPBACK, Guard, allowed_hosts
from shoal.errors import InputError

OWN = (*LOOPBACK, "shoal.example.org", "*.inner.example.org")
LISTED = "http://localhost:4200"
HOSTS = (
    "localhost",
    "LocalHost",
    "127.0.0.1",
    "[::1]",
    "::1",
    "shoal.example.org",
    "a.inner.example.org",
    "a.b.inner.example.org",
    "inner.example.org",
    "evilinner.example.org",
    "evil.example",
    "127.0.0.1.evil.example",
    "localhost.evil.example",
    "evil.example/localhost",
    "localhost@evil.example",
    "evil.example@localhost",
    "localhost evil.example",
    "localhost,evil.example",
    "localhost\x00",
    "0.0.0.0",
    "2130706433",
    "[::ffff:7f00:1]",
    "[localhost]",
    "*",
    "",
)
PORTS = ("", "", ":8001", ":80", ":443", ":x", ":", ":8001:8002", ":123456")


def asked(scope: dict[str, Any], headers: list[tuple[str, str]], **stated: Any) -> int:
    """The status with which a request ends, 200 if it reaches the program."""
    said: list[Any] = []

    async def program(scope: Any, receive: Any, send: Any) -> None:
        await send({"type": "http.response.start", "status": 200, "headers": []})

    async def receive() -> Any:
        return {"type": f"{scope['type']}.connect"}

    async def send(message: Any) -> None:
        said.append(message)

    raw = [(name.lower().encode(), value.encode("latin-1")) for name, value in headers]
    guard = Guard(program, OWN, [LISTED], **stated)
    asyncio.run(guard({"scheme": "http", "method": "GET", "path": "/", **scope, "headers": raw}, receive, send))
    return 403 if said[0]["type"] == "websocket.close" else int(said[0]["status"])


HTTP = {"type": "http"}


@pytest.mark.parametrize("seed", range(200))
def test_hosts(seed: int) -> None:
    rng = random.Random(seed)
    host = rng.choice(HOSTS) + rng.choice(PORTS)
    try:
        parts = urlsplit(f"//{host}")
        name, port = parts.hostname or "", parts.port
        clean = parts.netloc == host and "@" not in host and " " not in host and not host.endswith(":")
    except ValueError:
        name, port, clean = "", None, False
    ours = name in ("localhost", "127.0.0.1", "::1", "shoal.example.org") or name.endswith(".inner.example.org")
    ours &= clean and (":" not in name or host.startswith("["))
    assert port is None or port < 65536
    assert asked(HTTP, [("Host", host)]) == (200 if ours else 400), host


@pytest.mark.parametrize("number", [0, 2])
def test_no_host_and_two(number: int) -> None:
    assert asked(HTTP, [("Host", "localhost")] * number) == 400


@pytest.mark.parametrize("seed", range(300))
def test_origins(seed: int) -> None:
    """A page uses the server where scheme, host and port are its own, or those of the list; of any method and kind."""
    rng = random.Random(seed)
    scheme, name = rng.choice(["http", "https"]), rng.choice(["localhost", "127.0.0.1", "[::1]"])
    port, default = rng.choice([80, 443, 4200]), {"http": 80, "https": 443}[scheme]
    own = f"{scheme}://{name}" + (f":{port}" if port != default or rng.random() < 0.5 else "")
    others = ["null", "", "file://", "http://[", "http://evil.example", f"{scheme}://evil.example:{port}"]
    others += [f"{scheme}://{name}:9999", f"{scheme}://{name}.evil.example", f"ws://{name}:{port}"]
    others += [f"{own}/", f"{own}0", f"{own}@evil.example"]
    origin = rng.choice([own, own, LISTED, *others])
    kind = rng.choice(["http", "websocket"])
    scope = {"type": kind, "scheme": {"http": scheme, "websocket": scheme.replace("http", "ws")}[kind]}
    scope["method"] = rng.choice(["GET", "POST", "DELETE", "OPTIONS", "PATCH"])
    expected = origin == LISTED or _origin(origin) == _origin(own) is not None
    headers = [("Host", own.partition("://")[2]), ("Origin", origin)]
    assert asked(scope, headers) == (200 if expected else 403), (own, origin)


def _origin(text: str) -> tuple[str, str, int] | None:
    """Scheme, host and port of an origin; nothing for what is none."""
    try:
        parts = urlsplit(text)
        port = parts.port or {"http": 80, "https": 443}[parts.scheme]
    except (ValueError, KeyError):
        return None
    name = f"[{parts.hostname}]" if ":" in str(parts.hostname) else parts.hostname
    plain = not (parts.path or parts.query) and parts.netloc in (name, f"{name}:{port}")
    return (parts.scheme, str(name), port) if plain else None


def test_a_proxy_that_ends_tls_changes_the_scheme_alone() -> None:
    headers = [("Host", "shoal.example.org"), ("Origin", "https://shoal.example.org")]
    assert asked({"type": "http", "method": "POST"}, headers) == 200
    headers[1] = ("Origin", "http://shoal.example.org")
    assert asked({"type": "http", "method": "POST", "scheme": "https"}, headers) == 403


@pytest.mark.parametrize("site", ["same-origin", "none", "same-site", "cross-site"])
@pytest.mark.parametrize("mode", ["navigate", "no-cors", "cors"])
@pytest.mark.parametrize("dest", ["document", "iframe", "image", "script", "empty"])
@pytest.mark.parametrize("method", ["GET", "POST"])
def test_fetch_metadata(site: str, mode: str, dest: str, method: str) -> None:
    """Another page may lead here; it may neither frame, embed nor post."""
    headers = [("Host", "localhost"), ("Sec-Fetch-Site", site), ("Sec-Fetch-Mode", mode), ("Sec-Fetch-Dest", dest)]
    ours = site in ("same-origin", "none") or (mode == "navigate" and dest == "document" and method == "GET")
    assert asked({"type": "http", "method": method}, headers) == (200 if ours else 403)


@pytest.mark.parametrize(("path", "found"), [("/a/b", 404), ("/a/b/c", 404), ("/a/bc", 200), ("/a", 200)])
def test_parts_that_are_not_served(path: str, found: int) -> None:
    assert asked({"type": "http", "path": path}, [("Host", "localhost")], off=["/a/b"]) == found


def test_headers_are_set_once() -> None:
    said: list[Any] = []

    async def program(scope: Any, receive: Any, send: Any) -> None:
        await send({"type": "http.response.start", "status": 200, "headers": [(b"X-A", b"theirs"), (b"b", b"c")]})

    async def send(message: Any) -> None:
        said.append(message)

    scope = {"type": "http", "method": "GET", "path": "/", "scheme": "http", "headers": [(b"host", b"localhost")]}
    asyncio.run(Guard(program, OWN, headers={"X-a": "ours"})(scope, send, send))  # type: ignore[arg-type]
    assert said[0]["headers"] == [(b"b", b"c"), (b"x-a", b"ours")]


def test_the_setting(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SHOAL_ALLOWED_HOSTS", " Shoal.Example.org, *.a.b ,,fd00::1")
    assert allowed_hosts("192.0.2.7") == (*LOOPBACK, "192.0.2.7", "shoal.example.org", "*.a.b", "[fd00::1]")
    monkeypatch.delenv("SHOAL_ALLOWED_HOSTS")
    for wildcard in ("", "0.0.0.0", "::", "[::]"):
        assert allowed_hosts(wildcard) == LOOPBACK
    assert allowed_hosts("::1") == LOOPBACK


@pytest.mark.parametrize("entry", ["http://a", "a:8001", "a/b", "a*", "*a", "a b"])
def test_an_entry_that_is_no_host(entry: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SHOAL_ALLOWED_HOSTS", f"a,{entry}")
    with pytest.raises(InputError, match=r"^SHOAL_ALLOWED_HOSTS: '.*' is not a host name"):
        allowed_hosts()
