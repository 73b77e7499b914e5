"""The program of one service: put together here, nowhere else."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import partial
from typing import Annotated

from fastapi import Depends, FastAPI, Security
from fastapi.exceptions import RequestValidationError
from fastapi.security import APIKeyHeader
from starlette.exceptions import HTTPException

from shoal.api import routes, umbridge
from shoal.api.access import AccessLog
from shoal.api.connection import Crowd
from shoal.api.guard import Guard, allowed_hosts
from shoal.api.jobs import Jobs
from shoal.api.pool import Pool
from shoal.api.refusal import Refusal, on_failure, on_refusal
from shoal.api.settings import Settings
from shoal.api.worker import MakeEngine, Worker
from shoal.engines import get_engine
from shoal.versions import versions

_header = APIKeyHeader(name="X-API-Key", auto_error=False)


async def state_key(_: Annotated[str | None, Security(_header)] = None) -> None:
    """State in /openapi.json that endpoints ask for a key; `strict.StrictRoute` checks it before a body is read."""


def create_program(
    engine: str,
    settings: Settings | None = None,
    make_engine: MakeEngine | None = None,
    *,
    listening: str = "127.0.0.1",
) -> FastAPI:
    """Return the program that serves an engine. Raises InputError.

    settings: else those of the environment; make_engine: called in every worker, else the engine of that name is made;
    listening: the address under which it is served, one of the hosts that it answers to
    """
    settings = settings or Settings.read()
    worker = partial(Worker, make_engine or partial(get_engine, engine), settings)

    @asynccontextmanager
    async def lifespan(program: FastAPI) -> AsyncIterator[None]:
        calls = Pool(worker, settings.workers, settings.queue)
        job_pool = Pool(worker, settings.job_workers, settings.job_queue + settings.job_workers)
        program.state.calls, program.state.job_pool = calls, job_pool
        program.state.jobs = Jobs(job_pool, settings)
        calls.start()
        job_pool.start()
        yield
        await calls.stop()
        await job_pool.stop()

    program = FastAPI(
        title=f"Shoal: {engine}",
        version=versions(["shoal"])["shoal"],
        description="Simulates and identifies rigid-flexible machines. Errors are problem documents (RFC 9457).",
        lifespan=lifespan,
        docs_url=None,  # pages that load scripts from elsewhere
        redoc_url=None,
    )
    program.state.settings, program.state.keys = settings, settings.keys()
    guard = [Depends(state_key)] if program.state.keys else []
    program.include_router(routes.health)
    for router in (routes.v1, routes.library, routes.jobs, routes.earlier, umbridge.router):
        program.include_router(router, dependencies=guard)
    program.include_router(routes.by_id, prefix=routes.JOBS, dependencies=guard)
    program.include_router(routes.by_id, prefix=routes.EARLIER, dependencies=guard, include_in_schema=False)
    for kind in (Refusal, RequestValidationError, HTTPException):
        program.add_exception_handler(kind, on_refusal)
    program.add_exception_handler(Exception, on_failure)
    # The last is the outermost.
    program.add_middleware(Crowd, most=settings.connections)
    program.add_middleware(Guard, hosts=allowed_hosts(listening))
    program.add_middleware(AccessLog)
    return program
