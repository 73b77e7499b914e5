"""Tokens against cross-site requests, which Prefect's server asks for with every request that changes or filters."""

from __future__ import annotations

import json
from collections.abc import Mapping
from urllib.error import HTTPError
from urllib.request import Request, urlopen
from uuid import uuid4


def csrf_headers(api: str, seconds: float, headers: Mapping[str, str] | None = None) -> dict[str, str]:
    """Return the headers that a request of another method than GET needs; none where the server asks for none.

    Args:
        api: address of the server's API, as PREFECT_API_URL
        seconds: that it has to answer
        headers: of the request, such as an authorization

    Raises:
        OSError, ValueError: if no server of Prefect's answers
    """
    client = str(uuid4())
    try:
        with urlopen(
            Request(f"{api}/csrf-token?client={client}", headers=dict(headers or {})), timeout=seconds
        ) as answer:
            token = json.load(answer)["token"]
    except HTTPError:
        return {}
    return {"Prefect-Csrf-Token": token, "Prefect-Csrf-Client": client}
