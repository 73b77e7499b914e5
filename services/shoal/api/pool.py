"""Workers, and the queue before them."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from shoal.api.refusal import Refusal
from shoal.api.worker import Note, Worker

LONGEST_PAUSE = 30.0
"""Between two attempts to start a worker [s]."""
log = logging.getLogger("shoal.api")


class Pool:
    """So many workers, made by `make`; at most `queue` tasks wait for one."""

    def __init__(self, make: Callable[[], Worker], count: int, queue: int) -> None:
        self._make, self._count, self._queue = make, count, queue
        self._threads = ThreadPoolExecutor(count, "shoal-pool")
        self._idle = asyncio.LifoQueue[Worker]()
        self._workers = set[Worker]()
        self._starting = set[asyncio.Task[None]]()
        self._waiting = 0
        self._open = True
        self.about: dict[str, Any] = {}
        """What a worker tells of itself, once one has started."""

    @property
    def ready(self) -> bool:
        """Whether a worker is up and warm."""
        return any(worker.up for worker in self._workers)

    def start(self) -> None:
        """Start the workers; they come up while the service answers already."""
        for _ in range(self._count):
            self._replace()

    async def stop(self) -> None:
        """End every worker, whatever it is doing."""
        self._open = False
        for task in list(self._starting):
            task.cancel()
        for worker in list(self._workers):
            worker.kill()
        self._threads.shutdown(wait=False, cancel_futures=True)

    async def run(
        self,
        task: str,
        request: Any,
        seconds: float,
        note: Note = lambda _: None,
        started: Callable[[], None] = lambda: None,
    ) -> bytes:
        """What the task gives, within so many seconds of computing. Raises Refusal.

        note: told how it goes; started: called when a worker has been found. Where this is cancelled, the worker that
        computes is killed.
        """
        worker = await self._free()
        started()
        loop = asyncio.get_running_loop()

        def noted(content: Any) -> None:
            loop.call_soon_threadsafe(note, content)

        try:
            return await loop.run_in_executor(self._threads, worker.run, task, request, seconds, noted)
        except asyncio.CancelledError:
            worker.kill()
            raise
        finally:
            if worker.up:
                self._idle.put_nowait(worker)
            else:
                self._replace(worker)

    async def _free(self) -> Worker:
        if self._idle.empty() and self._waiting >= self._queue:
            text = f"{self._count} computing, {self._waiting} waiting; come again"
            raise Refusal("busy", text, headers={"Retry-After": "1"})
        self._waiting += 1
        try:
            # One may have died while it was idle.
            while not (worker := await self._idle.get()).up:
                self._replace(worker)
            return worker
        finally:
            self._waiting -= 1

    def _replace(self, worker: Worker | None = None) -> None:
        """Bring a fresh worker up in the background, in the place of one that is gone."""
        if worker is not None:
            worker.kill()
            self._workers.discard(worker)
        if not self._open:
            return
        task = asyncio.create_task(self._start_one())
        self._starting.add(task)
        task.add_done_callback(self._starting.discard)

    async def _start_one(self) -> None:
        """Bring one worker up, however often it takes."""
        pause = 1.0
        while True:
            worker = self._make()
            self._workers.add(worker)
            try:
                await asyncio.get_running_loop().run_in_executor(None, worker.start)
            except Exception as error:
                log.error("a worker did not start: %s", getattr(error, "text", error))
                worker.kill()
                self._workers.discard(worker)
                await asyncio.sleep(pause)
                pause = min(2 * pause, LONGEST_PAUSE)
                continue
            self.about = worker.about
            self._idle.put_nowait(worker)
            return
