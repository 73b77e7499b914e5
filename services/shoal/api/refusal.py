"""Every way in which a service says no: problem documents after RFC 9457."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import orjson
from fastapi import HTTPException, Request
from fastapi.exceptions import RequestValidationError
from pydantic import BaseModel, ConfigDict
from starlette.exceptions import HTTPException as PlainHTTPException
from starlette.responses import Response

MEDIA_TYPE = "application/problem+json"

KINDS: dict[str, tuple[int, str]] = {
    "malformed": (400, "The body is not the JSON that this service reads"),
    "unsupported": (400, "The model does not offer that"),
    "host": (400, "The request is for a host that this server does not answer to"),
    "unauthorized": (401, "A valid API key is needed"),
    "origin": (403, "Pages of other origins may not use this server"),
    "not-found": (404, "There is no such thing here"),
    "method-not-allowed": (405, "The method does not suit this address"),
    "too-slow": (408, "The request took too long to arrive"),
    "conflict": (409, "That is not to be had in this state"),
    "body-too-large": (413, "The body is larger than this service reads"),
    "input": (422, "The request is wrong"),
    "too-much": (422, "The request asks for more than this service computes"),
    "busy": (429, "All workers are busy and the queue is full"),
    "computation": (500, "The computation failed"),
    "crashed": (500, "The worker that computed it died"),
    "internal": (500, "The service failed"),
    "crowded": (503, "More requests are open than this service takes"),
    "not-ready": (503, "The service is not ready"),
    "timeout": (504, "The computation took longer than it may"),
}
"""Status and title by kind."""
_BY_STATUS = {404: "not-found", 405: "method-not-allowed", 400: "malformed"}


class ProblemDocument(BaseModel):
    """A problem document. type: `urn:shoal:` and the kind; detail: one line; field: which field it is about."""

    model_config = ConfigDict(json_schema_extra={"title": "Problem document (RFC 9457)"})

    type: str
    title: str
    status: int
    detail: str
    field: str | None = None


class Refusal(HTTPException):
    """A request that is refused, or a computation that did not end well. kind: one of KINDS."""

    def __init__(
        self, kind: str, detail: str, field: str | None = None, headers: Mapping[str, str] | None = None
    ) -> None:
        super().__init__(KINDS[kind][0], detail, dict(headers or {}))
        self.kind, self.text, self.field = kind, detail, field or named_field(detail)

    @property
    def document(self) -> ProblemDocument:
        """The problem document."""
        status, title = KINDS[self.kind]
        return ProblemDocument(
            type=f"urn:shoal:{self.kind}", title=title, status=status, detail=self.text, field=self.field
        )


def named_field(detail: str) -> str | None:
    """The field that a line such as `scene: bodies.OA.length: ...` names."""
    *heads, _ = detail.split(": ")
    fields = []
    for head in heads:
        if " " in head:
            break
        fields.append(head)
    return ".".join(fields) or None


def problem_response(refusal: Refusal) -> Response:
    """The answer that carries a refusal."""
    return Response(
        orjson.dumps(refusal.document.model_dump(exclude_none=True)),
        refusal.status_code,
        dict(refusal.headers or {}),
        MEDIA_TYPE,
    )


def of_validation(error: RequestValidationError) -> Refusal:
    """The first thing that is wrong with a request."""
    first = error.errors()[0]
    where = [str(part) for part in first["loc"] if part != "body"]
    others = len(error.errors()) - 1
    detail = first["msg"].removeprefix("Value error, ") + (f" (and {others} more)" if others else "")
    field = ".".join(where)
    return Refusal("input", f"{field}: {detail}" if field else detail, field or "body")


def _of_content(request: Request, error: RequestValidationError) -> Refusal | None:
    """Return a refusal where a body was not read as JSON for lack of a content type."""
    stated = request.headers.get("content-type", "")
    if error.errors()[0]["loc"] != ("body",) or "json" in stated:
        return None
    found = f"is {stated}" if stated else "is missing"
    return Refusal("input", f"Content-Type: {found}; the body is read with Content-Type: application/json")


async def on_refusal(request: Request, error: Exception) -> Response:
    """Handler of refusals and of what the framework itself refuses."""
    if isinstance(error, Refusal):
        return problem_response(error)
    if isinstance(error, RequestValidationError):
        return problem_response(_of_content(request, error) or of_validation(error))
    assert isinstance(error, PlainHTTPException)
    kind = _BY_STATUS.get(error.status_code, "internal")
    return problem_response(Refusal(kind, str(error.detail), headers=error.headers))


async def on_failure(request: Request, error: Exception) -> Response:
    """Handler of defects: says nothing about the inside."""
    return problem_response(Refusal("internal", "the service failed; its log tells why"))


def documented(*kinds: str) -> dict[int | str, dict[str, Any]]:
    """These refusals for the OpenAPI description of an endpoint."""
    by_status: dict[int | str, dict[str, Any]] = {}
    for kind in ("malformed", "unauthorized", "internal", *kinds):
        status, title = KINDS[kind]
        content = {MEDIA_TYPE: {"schema": ProblemDocument.model_json_schema()}}
        by_status.setdefault(status, {"description": title, "content": content})
    return by_status
