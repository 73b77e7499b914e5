"""The book of jobs: what is kept, for how long, and what becomes of a job without a client."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from click.testing import CliRunner
from shoal.api.jobs import Jobs
from shoal.api.operations import Identify
from shoal.api.refusal import Refusal
from shoal.api.settings import Settings
from shoal.cli import main
from shoal.engines import ENGINES
from shoal.ports import PORTS

REQUEST = Identify(problem="paper-case-1")


class Instant:
    """A pool whose tasks end at once."""

    async def run(self, task: str, request: Any, seconds: float, note: Any, started: Any) -> bytes:
        started()
        return b"{}"


def is_gone(jobs: Jobs, name: str) -> bool:
    try:
        jobs.get(name)
    except Refusal as refusal:
        return refusal.kind == "not-found"
    return False


def test_finished_jobs_are_bounded() -> None:
    """The newest are kept, those that are too many or too old are forgotten."""

    async def forgotten(settings: Settings) -> list[bool]:
        jobs = Jobs(Instant(), settings)  # type: ignore[arg-type]
        found = []
        for _ in range(3):
            found.append(jobs.submit("identify", REQUEST))
            await asyncio.sleep(0.01)
        assert all(job.state == "done" for job in found)
        return [is_gone(jobs, job.id) for job in found]

    assert asyncio.run(forgotten(Settings(keep_jobs=2))) == [True, False, False]
    assert asyncio.run(forgotten(Settings(keep_seconds=1e-9))) == [True, True, True]


def test_a_request_that_is_sent_again_is_the_same_job() -> None:
    """Also where there is no room for another; a key that was used for something else is refused."""

    async def submit() -> None:
        jobs = Jobs(Instant(), Settings(job_workers=1, job_queue=0))  # type: ignore[arg-type]
        first = jobs.submit("identify", REQUEST, "a")
        assert jobs.submit("identify", Identify(problem="paper-case-1"), "a") is first
        with pytest.raises(Refusal, match="another request"):
            jobs.submit("identify", Identify(problem="paper-case-2"), "a")
        with pytest.raises(Refusal, match="jobs are running"):
            jobs.submit("identify", REQUEST, "b")
        await asyncio.sleep(0.01)
        assert first.state == "done"
        assert jobs.submit("identify", REQUEST, "a") is first
        assert jobs.submit("identify", REQUEST) is not first

    asyncio.run(submit())


def test_too_many_jobs_are_refused() -> None:
    async def submit() -> None:
        jobs = Jobs(Instant(), Settings(job_workers=1, job_queue=1))  # type: ignore[arg-type]
        for _ in range(3):  # nothing runs before this gives way
            jobs.submit("identify", REQUEST)

    with pytest.raises(Refusal, match="2 jobs are running or waiting"):
        asyncio.run(submit())


def test_every_engine_can_be_served() -> None:
    assert f"{{{'|'.join(ENGINES)}}}" in CliRunner().invoke(main, ["serve", "--help"]).stdout
    assert PORTS == {"gauss": 8001, "exudyn": 8002, "casadi": 8003, "tree": 8004, "mujoco": 8005}
