"""The endpoints of Shoal's own interface."""

from __future__ import annotations

import inspect
from collections.abc import AsyncIterator
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Depends, Header, Path, Request, Response
from fastapi.sse import EventSourceResponse, ServerSentEvent

from shoal.api.jobs import Jobs
from shoal.api.operations import OPERATIONS
from shoal.api.operations import Request as Operation
from shoal.api.pool import Pool
from shoal.api.refusal import Refusal, documented
from shoal.api.schemas import (
    EngineDocument,
    Health,
    JobStatus,
    Library,
    LibraryDocument,
    LibraryEntry,
    LibraryTask,
    PutRequest,
    VersionDocument,
)
from shoal.api.strict import StrictRoute

COMPUTING = ("input", "too-much", "body-too-large", "too-slow", "busy", "crashed", "not-ready", "timeout")
JOBS = "/v1/jobs"
EARLIER = "/v1/identifications"
"""Where jobs were when there was but one kind of them; they still answer there."""

health = APIRouter(tags=["health"])
v1 = APIRouter(prefix="/v1", route_class=StrictRoute)
library = APIRouter(prefix="/v1/library", route_class=StrictRoute, tags=["library"])
jobs = APIRouter(prefix=JOBS, route_class=StrictRoute, tags=["jobs"])
by_id = APIRouter(route_class=StrictRoute, tags=["jobs"])
earlier = APIRouter(prefix=EARLIER, route_class=StrictRoute)


async def require_ready(request: Request) -> None:
    """Raises Refusal until workers are up."""
    calls, jobs = request.app.state.calls, request.app.state.job_pool
    if not (calls.about and jobs.about):
        raise Refusal("not-ready", "no worker is up yet; see /ready", headers={"Retry-After": "5"})


async def _calls(request: Request) -> Pool:
    pool: Pool = request.app.state.calls
    return pool


async def _jobs(request: Request) -> Jobs:
    found: Jobs = request.app.state.jobs
    return found


Ready = Depends(require_ready)
Calls = Annotated[Pool, Depends(_calls)]
AllJobs = Annotated[Jobs, Depends(_jobs)]
Key = Annotated[str | None, Header(alias="Idempotency-Key", min_length=1, max_length=200)]
JobId = Annotated[str, Path(max_length=64)]
EntryKind = Annotated[str, Path(max_length=64)]
EntryName = Annotated[str, Path(max_length=100)]


@health.get("/health")
async def live() -> Health:
    """Return whether the program lives."""
    return Health(status="ok")


@health.get("/ready", responses=documented("not-ready"))
async def ready(request: Request) -> Health:
    """Return whether workers are up, with warm kernels."""
    if not (request.app.state.calls.ready and request.app.state.job_pool.ready):
        raise Refusal("not-ready", "workers are starting", headers={"Retry-After": "5"})
    return Health(status="ok")


@v1.get("/version", dependencies=[Ready], responses=documented("not-ready"))
async def version(calls: Calls) -> VersionDocument:
    """Versions of what computes here."""
    return VersionDocument(**calls.about["version"])


@v1.get("/capabilities", dependencies=[Ready], responses=documented("not-ready"))
async def capabilities(calls: Calls) -> EngineDocument:
    """Return the capabilities of the engine."""
    return EngineDocument(**calls.about["capabilities"])


@v1.get("/schemas/{kind}", dependencies=[Ready], responses=documented("not-ready", "input"))
async def schema(kind: Literal["scene", "problem"], calls: Calls) -> dict[str, Any]:
    """The JSON schema of a scene or a problem."""
    found: dict[str, Any] = calls.about["schemas"][kind]
    return found


def _noted(asked: Operation) -> dict[str, str]:
    """The header that says in one line what whoever asked should know beside the answer; none if there is nothing."""
    return {"Warning": f'299 shoal "{"; ".join(asked.notes)}"'} if asked.notes else {}


def _answering(name: str, kind: type[Operation]) -> None:
    """The endpoints of an operation: at once, and as a job."""

    async def now(asked: Operation, request: Request, calls: Calls) -> Response:
        seconds = request.app.state.settings.wall_seconds
        answer = await calls.run("call", (name, asked), seconds, gone=request.is_disconnected)
        return Response(answer, headers=_noted(asked), media_type="application/json")

    async def later(
        asked: Operation, request: Request, response: Response, calls: Calls, jobs: AllJobs, key: Key = None
    ) -> JobStatus:
        seconds = request.app.state.settings.wall_seconds
        await calls.run("check", (name, asked), seconds, gone=request.is_disconnected)
        job = jobs.submit(name, asked, key)
        response.headers.update({"Location": f"{JOBS}/{job.id}", **_noted(asked)})
        return job.status

    for function, what in ((now, name), (later, f"{name}-job")):
        function.__name__ = what
        function.__annotations__["asked"] = kind
    about: dict[str, Any] = {"dependencies": [Ready], "responses": documented(*COMPUTING)}
    described: dict[str, Any] = {"summary": name.capitalize(), "description": inspect.cleandoc(kind.__doc__ or "")}
    v1.post(f"/{name}", response_model=kind.answer, **described, **about)(now)
    checked = (
        f"Checked, then computed in the background; `Location` says where to ask. The body is that of /v1/{name}. "
        "The same request with the same `Idempotency-Key` is the same job."
    )
    jobs.post(f"/{name}", status_code=202, summary=f"{name.capitalize()} as a job", description=checked, **about)(later)
    if name == "identify":
        earlier.post("", status_code=202, include_in_schema=False, **about)(later)


for _name, _kind in OPERATIONS.items():
    _answering(_name, _kind)


@jobs.post("/{operation}", include_in_schema=False)
async def no_operation(operation: JobId) -> None:
    """A job of what there is not."""
    raise Refusal("not-found", f"no operation {operation!r}; there are {', '.join(OPERATIONS)}", "operation")


@by_id.get("/{id}", responses=documented("not-found", "input"))
async def status(id: JobId, jobs: AllJobs) -> JobStatus:
    """Return the state of a job."""
    return jobs.get(id).status


@by_id.delete("/{id}", status_code=204, responses=documented("not-found", "input"))
async def cancel(id: JobId, jobs: AllJobs) -> None:
    """Stop a job; one that has ended stays as it is."""
    jobs.cancel(id)


@by_id.get("/{id}/result", response_model=dict[str, Any], responses=documented("not-found", "conflict", *COMPUTING))
async def result(id: JobId, jobs: AllJobs) -> Response:
    """Return the schema of an operation's answer."""
    job = jobs.get(id)
    if job.refusal is not None:
        raise job.refusal
    if job.state != "done":
        raise Refusal("conflict", f"the job is {job.state}", "id")
    return Response(job.result, media_type="application/json")


@library.get("", response_model=Library, dependencies=[Ready], responses=documented(*COMPUTING))
async def list_library(request: Request, calls: Calls) -> Response:
    """Names of the built-in scenes and problems, and the entries of the library."""
    return await _of_library(request, calls, LibraryTask("list"))


@library.get(
    "/{kind}/{name}",
    response_model=LibraryDocument,
    dependencies=[Ready],
    responses=documented("not-found", *COMPUTING),
)
async def get_entry(kind: EntryKind, name: EntryName, request: Request, calls: Calls) -> Response:
    """An entry with its files; NAME@VERSION is an earlier version."""
    return await _of_library(request, calls, LibraryTask("get", kind, name))


@library.put("/{kind}/{name}", response_model=LibraryEntry, dependencies=[Ready], responses=documented(*COMPUTING))
async def put_entry(kind: EntryKind, name: EntryName, asked: PutRequest, request: Request, calls: Calls) -> Response:
    """Check an entry and keep it; versions that were there stay."""
    return await _of_library(request, calls, LibraryTask("put", kind, name, asked.files))


@library.delete("/{kind}/{name}", status_code=204, dependencies=[Ready], responses=documented("not-found", *COMPUTING))
async def delete_entry(kind: EntryKind, name: EntryName, request: Request, calls: Calls) -> None:
    """Forget an entry with all its versions."""
    await _of_library(request, calls, LibraryTask("delete", kind, name))


async def _of_library(request: Request, calls: Pool, task: LibraryTask) -> Response:
    answer = await calls.run("library", task, request.app.state.settings.wall_seconds)
    return Response(answer, media_type="application/json")


async def known_job(id: JobId, jobs: AllJobs) -> None:
    """Refuse an unknown job before a stream has begun."""
    jobs.get(id)


@by_id.get(
    "/{id}/events",
    response_class=EventSourceResponse,
    dependencies=[Depends(known_job)],
    responses=documented("not-found", "input"),
)
async def events(id: JobId, jobs: AllJobs) -> AsyncIterator[ServerSentEvent]:
    """Server-sent events: the status of a job whenever it changes, until it ends."""
    async for news in jobs.get(id).news():
        yield ServerSentEvent(event="status", data=news)
