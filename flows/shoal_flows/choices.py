"""The names that forms offer: told to Prefect's server again whenever the library has changed.

A deployment's form is a JSON schema that the server keeps. Lists in it that depend on the library carry a mark, by
which they are found and replaced, without Prefect and without the flows.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from typing import Any
from urllib.request import Request, urlopen

from shoal.home import stated_home

MARK = "x-shoal-names"
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
    from shoal.shelf import shelf

    built_in = {
        "scenes": built_in_scenes,
        "problems": built_in_problems,
        "recordings": lambda: [""],
        "studies": built_in_studies,
    }[kind]
    return [*built_in(), *([entry.name for entry in shelf().entries(kind)] if own is None else own)]


def refresh(own: Names | None = None) -> int:
    """Tell the server the names that there are; returns how many deployments have changed. Quiet where there is none.

    own: names of the library, else of the one here
    """
    server = address()
    if server is None:
        return 0
    changed = 0
    try:
        for deployment in _asked(f"{server}/deployments/filter", "POST", {}):
            schema = deployment.get("parameter_openapi_schema")
            if _renewed(schema, own):
                where = f"{server}/deployments/{deployment['id']}"
                _asked(where, "PATCH", {"parameter_openapi_schema": schema})
                changed += 1
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        pass  # what answers is no server of Prefect's, or none that lets us
    return changed


def address() -> str | None:
    """That of the server's API: PREFECT_API_URL, else that of the `make up` which uses the same home."""
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


def _asked(url: str, method: str, data: object) -> Any:
    headers = {"Content-Type": "application/json"}
    if key := os.environ.get("PREFECT_API_KEY"):
        headers["Authorization"] = f"Bearer {key}"
    request = Request(url, json.dumps(data).encode(), headers, method=method)
    with urlopen(request, timeout=SECONDS) as answer:
        content = answer.read()
    return json.loads(content) if content else None
