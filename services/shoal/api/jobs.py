"""Computations in the background: they go on when the client leaves, and their results are kept for a while."""

from __future__ import annotations

import asyncio
import secrets
import time
from collections.abc import AsyncIterator
from dataclasses import dataclass, field
from typing import Literal

from shoal.api.operations import Request
from shoal.api.pool import Pool
from shoal.api.refusal import Refusal
from shoal.api.schemas import JobStatus
from shoal.api.settings import Settings

State = Literal["queued", "running", "done", "failed", "cancelled"]


@dataclass
class Job:
    """One computation. changed: set, and replaced, whenever something new is known; key: of who asked for it."""

    operation: str
    asked: Request
    key: str | None = None
    id: str = field(default_factory=lambda: secrets.token_urlsafe(16))
    state: State = "queued"
    progress: dict[str, float | None] | None = None
    result: bytes = b""
    refusal: Refusal | None = None
    ended: float | None = None
    changed: asyncio.Event = field(default_factory=asyncio.Event)

    def become(self, state: State) -> None:
        """Enter a state; the last ones are final."""
        self.state = state
        if state in ("done", "failed", "cancelled"):
            self.ended = time.monotonic()
        self.tell()

    def note(self, progress: dict[str, float | None]) -> None:
        """Take the progress, numbers by name."""
        self.progress = progress
        self.tell()

    def tell(self) -> None:
        """Wake whoever waits for news."""
        changed, self.changed = self.changed, asyncio.Event()
        changed.set()

    @property
    def status(self) -> JobStatus:
        """Return the status for clients."""
        problem = None if self.refusal is None else self.refusal.document.model_dump(exclude_none=True)
        return JobStatus(
            id=self.id, operation=self.operation, status=self.state, progress=self.progress, problem=problem
        )

    async def news(self) -> AsyncIterator[JobStatus]:
        """The status now, and whenever it has changed, until the end."""
        while True:
            changed = self.changed
            yield self.status
            if self.ended is not None:
                return
            await changed.wait()


class Jobs:
    """The jobs of a service, running and finished."""

    def __init__(self, pool: Pool, settings: Settings) -> None:
        self._pool, self._settings = pool, settings
        self._jobs: dict[str, Job] = {}
        self._running: dict[str, asyncio.Task[None]] = {}

    def submit(self, operation: str, request: Request, key: str | None = None) -> Job:
        """Take a request that was checked. Raises Refusal if too many wait already.

        key: of a client that may ask twice, because it does not know whether it was heard: the second time gives the
        job of the first. Raises Refusal if that was another request.
        """
        self._forget()
        if key is not None and (same := next((job for job in self._jobs.values() if job.key == key), None)):
            if (same.operation, same.asked) != (operation, request):
                raise Refusal("input", "this key was sent with another request", "Idempotency-Key")
            return same
        going = sum(job.ended is None for job in self._jobs.values())
        if going >= self._settings.job_workers + self._settings.job_queue:
            text = f"{going} jobs are running or waiting; come again"
            raise Refusal("busy", text, headers={"Retry-After": "10"})
        job = Job(operation, request, key)
        self._jobs[job.id] = job
        task = asyncio.create_task(self._run(job, (operation, request)))
        self._running[job.id] = task
        task.add_done_callback(lambda _: self._running.pop(job.id, None))
        return job

    def get(self, name: str) -> Job:
        """The job of that id. Raises Refusal."""
        self._forget()
        if name not in self._jobs:
            raise Refusal("not-found", "there is no such job; results are kept for a while only", "id")
        return self._jobs[name]

    def cancel(self, name: str) -> None:
        """Stop a job; its worker is killed. One that has ended stays as it is."""
        job = self.get(name)
        if job.ended is None:
            job.become("cancelled")
            self._running[name].cancel()

    async def _run(self, job: Job, asked: tuple[str, Request]) -> None:
        try:
            job.result = await self._pool.run(
                "call", asked, self._settings.job_seconds, job.note, lambda: job.become("running")
            )
        except Refusal as refusal:
            job.refusal = refusal
            job.become("failed")
        else:
            job.become("done")

    def _forget(self) -> None:
        """Drop finished jobs that are too old or too many."""
        finished = sorted((j for j in self._jobs.values() if j.ended is not None), key=lambda j: j.ended or 0.0)
        oldest = time.monotonic() - self._settings.keep_seconds
        for k, job in enumerate(finished):
            if (job.ended or 0.0) < oldest or k < len(finished) - self._settings.keep_jobs:
                del self._jobs[job.id]
