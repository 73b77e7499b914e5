"""Checks of Host, Origin and fetch metadata before any ASGI program, against DNS rebinding and cross-site requests.

A browser sends requests to servers of this machine for any page that is open in it. Those of a rebound name carry that
name as Host, those of another origin an Origin or Sec-Fetch-Site. See OWASP, Cross-Site Request Forgery Prevention, and
W3C, Fetch Metadata Request Headers.
"""

from __future__ import annotations

import os
import re
from collections.abc import Awaitable, Callable, Iterable, Mapping, MutableMapping, Sequence
from ipaddress import ip_address
from typing import Any

from shoal.api.refusal import Refusal, problem_response
from shoal.errors import InputError

SETTING = "SHOAL_ALLOWED_HOSTS"
LOOPBACK = ("localhost", "127.0.0.1", "[::1]")

Scope = MutableMapping[str, Any]
Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
Application = Callable[[Scope, Receive, Send], Awaitable[None]]

_HOST = re.compile(r"(\[[0-9a-f:.]+\]|[a-z0-9_.-]+)(?::[0-9]{1,5})?", re.ASCII)
_NAME = re.compile(r"(?:\*\.)?[a-z0-9_-]+(?:\.[a-z0-9_-]+)*|\[[0-9a-f:.]+\]|\*", re.ASCII)


def allowed_hosts(listening: str = "") -> tuple[str, ...]:
    """Return the host names that a server answers to: this machine's, its own address and those of SHOAL_ALLOWED_HOSTS.

    Args:
        listening: the address that the server listens on; a wildcard address (0.0.0.0, ::) adds nothing

    Raises:
        InputError: for an entry of the setting that is no host name
    """
    stated = [_bracketed(entry.strip().lower()) for entry in os.environ.get(SETTING, "").split(",") if entry.strip()]
    for entry in stated:
        if not _NAME.fullmatch(entry):
            raise InputError(
                f"{SETTING}: {entry!r} is not a host name; list names such as shoal.example.org or *.example.org "
                "between commas, without scheme and port"
            )
    own = [] if is_wildcard(listening) else [_bracketed(listening.lower())]
    return tuple(dict.fromkeys((*LOOPBACK, *own, *stated)))


def is_wildcard(listening: str) -> bool:
    """Return whether an address to listen on is that of all interfaces, or none."""
    try:
        return not listening or ip_address(listening.strip("[]")).is_unspecified
    except ValueError:
        return False


def _bracketed(name: str) -> str:
    """Return an IPv6 address as it stands in a Host header; other names as they are."""
    try:
        return f"[{name}]" if ip_address(name).version == 6 else name
    except ValueError:
        return name


class RequestPolicy:
    """Policy on the Host, the Origin and the fetch metadata of requests.

    Args:
        hosts: host names without port that the server answers to; `*.` stands for any subdomain, `*` for any name
        origins: origins besides its own whose pages may use it, such as http://localhost:4200
    """

    def __init__(self, hosts: Sequence[str], origins: Iterable[str] = ()) -> None:
        self.hosts, self.origins = tuple(hosts), frozenset(origins)

    def refusal(self, scope: Scope) -> Refusal | None:
        """Return why a request of an ASGI scope is refused; None if it is not."""
        given: dict[str, list[str]] = {}
        for name, value in scope["headers"]:
            given.setdefault(name.decode("latin-1").lower(), []).append(value.decode("latin-1"))
        host = given.get("host", [])
        if len(host) != 1 or not self._answers_to(host[0]):
            found = repr(host[0][:100]) if host else "none"
            return Refusal(
                "host", f"Host: {found} is no name of this server; {SETTING} lists those it answers to", "Host"
            )
        secure = scope.get("scheme") in ("https", "wss")
        foreign = [origin for origin in given.get("origin", []) if not self._is_own(origin, host[0], secure)]
        if foreign:
            return Refusal("origin", f"Origin: pages of {foreign[0][:100]!r} may not use this server", "Origin")
        if "origin" not in given and scope["type"] == "http" and _is_foreign_subresource(scope["method"], given):
            return Refusal("origin", "Sec-Fetch-Site: pages of other origins may not use this server", "Sec-Fetch-Site")
        return None

    def _answers_to(self, host: str) -> bool:
        found = _HOST.fullmatch(host.lower())
        return found is not None and any(
            name in ("*", found[1]) or (name.startswith("*.") and found[1].endswith(name[1:])) for name in self.hosts
        )

    def _is_own(self, origin: str, host: str, secure: bool) -> bool:
        """Return whether a page of this origin was served under this Host, or is one of the origins allowed besides.

        A page may be of https where the request is of http: a proxy ended TLS. The reverse is another origin.
        """
        if origin in self.origins:
            return True
        scheme, _, place = origin.lower().partition("://")
        default = {"http": ":80", "https": ":443"}.get(scheme)
        if default is None or (secure and scheme == "http"):
            return False
        return place.removesuffix(default) == host.lower().removesuffix(default)


class Guard:
    """ASGI middleware that refuses requests for unknown hosts and requests of pages of other origins.

    Args:
        application: the program behind it
        hosts, origins: see RequestPolicy
        headers: response headers that are set in every answer, such as a content security policy
        off: paths of the program that are not served, with all below them
    """

    def __init__(
        self,
        application: Application,
        hosts: Sequence[str],
        origins: Iterable[str] = (),
        headers: Mapping[str, str] | None = None,
        off: Sequence[str] = (),
    ) -> None:
        self.application, self.policy, self.off = application, RequestPolicy(hosts, origins), tuple(off)
        self._headers = [(name.lower().encode(), value.encode()) for name, value in (headers or {}).items()]

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or refuse it."""
        if scope["type"] not in ("http", "websocket"):
            return await self.application(scope, receive, send)
        refusal = self.policy.refusal(scope) or self._not_served(scope["path"])
        if refusal is None:
            return await self.application(scope, receive, self._with_headers(send) if self._headers else send)
        if scope["type"] == "websocket":
            await receive()
            return await send({"type": "websocket.close", "code": 1008, "reason": refusal.text[:100]})
        return await problem_response(refusal)(scope, receive, send)

    def _not_served(self, path: str) -> Refusal | None:
        if any(path == one or path.startswith(f"{one}/") for one in self.off):
            return Refusal("not-found", "this part of the program is not served here")
        return None

    def _with_headers(self, send: Send) -> Send:
        async def sending(message: Message) -> None:
            if message["type"] == "http.response.start":
                names = {name for name, _ in self._headers}
                kept = [(name, value) for name, value in message.get("headers", ()) if name.lower() not in names]
                message = {**message, "headers": [*kept, *self._headers]}
            await send(message)

        return sending


def _is_foreign_subresource(method: str, given: Mapping[str, list[str]]) -> bool:
    """Return whether a browser fetches this for a page of another origin, and not as a page of its own."""
    if not {"cross-site", "same-site"} & set(given.get("sec-fetch-site", [])):
        return False
    opened = given.get("sec-fetch-mode") == ["navigate"] and given.get("sec-fetch-dest") == ["document"]
    return not (opened and method in ("GET", "HEAD"))
