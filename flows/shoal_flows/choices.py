"""The names that forms offer: sent to Prefect's server again whenever the library has changed.

A deployment's form is a JSON schema that the server keeps. Lists in it that depend on the library carry a mark, by
which they are found and replaced, without Prefect and without the flows. They also carry the identity of the library
that they were made from, which is the worker's: names of any other library are not offered, as its runs would fail.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from socket import gethostname
from typing import Any
from urllib.request import Request, urlopen

from shoal.csrf import csrf_headers
from shoal.home import stated_home
from shoal.shelf import shelf

MARK, LIBRARY = "x-shoal-names", "x-shoal-library"
SECONDS = 2.0
"""A server that takes longer is left with the names that it has."""
_SERVER = "prefect-server"

Names = Mapping[str, Iterable[str]]
"""Names in the library by kind."""


def names(kind: str, own: Iterable[str] | None = None) -> list[str]:
    """The names of a kind: built-in ones, then `own`, else those of the library here."""
    from shoal.identification.problem import built_in_problems
    from shoal.response.stated import built_in_studies
    from shoal.scene.load import built_in_scenes

    built_in = {
        "scenes": built_in_scenes,
        "problems": built_in_problems,
        "recordings": lambda: [""],
        "studies": built_in_studies,
    }[kind]
    return [*built_in(), *([entry.name for entry in shelf().entries(kind)] if own is None else own)]


def library() -> dict[str, str]:
    """Return what a form states of the library here: its identity, folder and host; empty if it has no identity."""
    identity = shelf().identity()
    return {"identity": identity, "folder": str(shelf().root), "host": gethostname()} if identity else {}


def refresh(own: Names | None = None, identity: str | None = None) -> str:
    """Replace the names in the forms of the server, if there is one; return why they were left as they are, or "".

    own: names of a library and identity: the identity of that library; both of the one here by default
    """
    different = ""
    with _tolerant():
        for deployment in _deployments():
            schema = deployment.get("parameter_openapi_schema")
            if different := different or _difference(schema, identity):
                continue
            if _renewed(schema, own):
                _asked(f"deployments/{deployment['id']}", "PATCH", {"parameter_openapi_schema": schema})
    return different


def difference() -> str:
    """Return a line if the worker behind the server has another library than this process, else ""."""
    with _tolerant():
        return next(filter(None, (_difference(one.get("parameter_openapi_schema")) for one in _deployments())), "")
    return ""


def _deployments() -> list[Any]:
    return [] if address() is None else list(_asked("deployments/filter", "POST", {}))


def _difference(schema: Any, identity: str | None = None) -> str:
    theirs: Mapping[str, str] = next(_found(schema, LIBRARY), {})
    ours = shelf().identity() if identity is None else identity
    if not theirs or theirs["identity"] == ours:
        return ""
    which = f"the library {shelf().root}" if identity is None else "the library of that service"
    return (
        f"Prefect's worker at {address()} uses the library {theirs['folder']} on {theirs['host']}, not {which}: its "
        "forms offer, and its runs find, the names of its own library only; set SHOAL_HOME or SHOAL_LIBRARY alike"
    )


def _found(schema: Any, key: str) -> Iterator[Any]:
    """The values of a key anywhere in a schema."""
    if isinstance(schema, dict):
        if key in schema:
            yield schema[key]
        schema = list(schema.values())
    if isinstance(schema, list):
        for one in schema:
            yield from _found(one, key)


@contextmanager
def _tolerant() -> Iterator[None]:
    """Ignore what answers if it is no server of Prefect's, or none that permits the request."""
    with suppress(OSError, ValueError, KeyError, TypeError, AttributeError):
        yield


def address() -> str | None:
    """Return the address of the server's API: PREFECT_API_URL, else that of the `make up` which uses the same home."""
    if stated := os.environ.get("PREFECT_API_URL"):
        return stated.rstrip("/")
    try:
        return (stated_home() / _SERVER).read_text(encoding="utf-8").strip() or None
    except OSError:
        return None


def remember(server: str | None) -> None:
    """Keep the address of the server beside its state, or forget it."""
    file = stated_home() / _SERVER
    if server is None:
        file.unlink(missing_ok=True)
    else:
        file.write_text(server, encoding="utf-8")


def _renewed(schema: Any, own: Names | None) -> bool:
    """Put the names into all marked lists of a schema; whether one was not as it should be."""
    if isinstance(schema, list):
        return sum(_renewed(one, own) for one in schema) > 0
    if not isinstance(schema, dict):
        return False
    if (kind := schema.get(MARK)) is not None:
        wanted = names(kind, None if own is None else own.get(kind, ()))
        changed = schema["enum"] != wanted
        schema["enum"] = wanted
        return bool(changed)
    return sum(_renewed(one, own) for one in schema.values()) > 0


def _asked(path: str, method: str, data: object) -> Any:
    api, key = str(address()), os.environ.get("PREFECT_API_KEY")
    authorized = {"Authorization": f"Bearer {key}"} if key else {}
    headers = {"Content-Type": "application/json", **authorized, **csrf_headers(api, SECONDS, authorized)}
    request = Request(f"{api}/{path}", json.dumps(data).encode(), headers, method=method)
    with urlopen(request, timeout=SECONDS) as answer:
        content = answer.read()
    return json.loads(content) if content else None
