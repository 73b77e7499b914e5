"""Bodies of bounded size, depth and duration, read as strict JSON: no NaN, no infinity, no key twice, nothing else."""

from __future__ import annotations

import asyncio
import hmac
import json
from collections import Counter
from collections.abc import Callable, Coroutine
from typing import Any

import orjson
from fastapi import Request, Response
from fastapi.routing import APIRoute

from shoal.api.access import KEY_NAME
from shoal.api.refusal import Refusal
from shoal.api.settings import Settings


class StrictRequest(Request):
    """A request whose body is read within the limits of the service."""

    async def body(self) -> bytes:
        """The body. Raises Refusal if it is too large or too slow."""
        if not hasattr(self, "_body"):
            settings: Settings = self.app.state.settings
            try:
                async with asyncio.timeout(settings.receive_seconds):
                    self._body = await self._receive_all(settings.body_bytes)
            except TimeoutError:
                text = f"the body did not arrive within {settings.receive_seconds:g} s"
                raise Refusal("too-slow", text, headers={"Connection": "close"}) from None
        return self._body

    async def _receive_all(self, limit: int) -> bytes:
        stated = self.headers.get("content-length", "0")
        if not stated.isdecimal() or len(stated) > 18 or int(stated) > limit:
            raise _too_large(limit)
        chunks, size = [], 0
        async for chunk in self.stream():
            size += len(chunk)
            if size > limit:
                raise _too_large(limit)
            chunks.append(chunk)
        return b"".join(chunks)

    async def json(self) -> Any:
        """The body as plain data. Raises Refusal."""
        body = await self.body()
        try:
            data = orjson.loads(body)
        except orjson.JSONDecodeError as error:
            raise Refusal("malformed", f"not JSON: {error}", "body") from None
        check_depth(data, self.app.state.settings.json_depth)
        # orjson keeps the last of two keys without a word. Its numbers are limited, those of json are not.
        json.loads(body, object_pairs_hook=_without_twins, parse_int=float)
        return data


def check_key(request: Request) -> None:
    """Keep the name of the API key that a request shows. Raises Refusal where keys are asked for and it shows none."""
    keys: dict[bytes, str] = request.app.state.keys
    given = request.headers.get("X-API-Key", "").encode()
    # Every key is compared, each in constant time, so that the time tells nothing.
    matches = [name for key, name in keys.items() if hmac.compare_digest(given, key)]
    if keys and not matches:
        raise Refusal("unauthorized", "X-API-Key: the key is missing or not known", "X-API-Key")
    setattr(request.state, KEY_NAME, matches[0] if matches else None)


class StrictRoute(APIRoute):
    """A route that validates strictly; without a key no body is read."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """The handler that FastAPI calls."""
        inner = super().get_route_handler()

        async def handler(request: Request) -> Response:
            check_key(request)
            return await inner(StrictRequest(request.scope, request.receive))

        return handler


def _without_twins(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        twice, _ = Counter(key for key, _ in pairs).most_common(1)[0]
        raise Refusal("malformed", f"the key {twice[:40]!r} stands twice", "body")
    return found


def check_depth(data: Any, limit: int) -> None:
    """Raises Refusal where objects and lists are nested deeper than the limit."""
    level = [data] if isinstance(data, dict | list) else []
    for _ in range(limit):
        entries = (entry for box in level for entry in (box.values() if isinstance(box, dict) else box))
        level = [entry for entry in entries if isinstance(entry, dict | list)]
        if not level:
            return
    raise Refusal("malformed", f"JSON is nested deeper than {limit}", "body")


def _too_large(limit: int) -> Refusal:
    return Refusal("body-too-large", f"the body may have {limit} bytes", "body", {"Connection": "close"})
