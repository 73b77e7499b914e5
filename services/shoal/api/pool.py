"""Workers, and the queue before them."""

from __future__ import annotations

import asyncio
import logging
from collections import deque
from collections.abc import Awaitable, Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from shoal.api.refusal import Refusal
from shoal.api.worker import Note, Worker

LONGEST_PAUSE = 30.0
"""Between two attempts to start a worker [s]."""
LOOK = 0.5
"""How often it is looked whether somebody still waits for an answer [s]; what takes no longer is never broken off."""
log = logging.getLogger("shoal.api")


async def _never() -> bool:
    return False


async def _end_if(gone: Callable[[], Awaitable[bool]], worker: Worker, answer: asyncio.Future[bytes]) -> None:
    """Kill a worker whose answer is not awaited any more."""
    while not answer.done():
        await asyncio.sleep(LOOK)
        if await gone() and not answer.done():
            worker.kill()
            return


class Pool:
    """A fixed number of workers, made by `make`; at most `queue` tasks wait for one, first come, first served."""

    def __init__(self, make: Callable[[], Worker], count: int, queue: int) -> None:
        self._make, self._count, self._queue = make, count, queue
        self._threads = ThreadPoolExecutor(count, "shoal-pool")
        self._idle: list[Worker] = []
        self._line = deque[asyncio.Future[Worker]]()
        self._workers = set[Worker]()
        self._starting = set[asyncio.Task[None]]()
        self._open = True
        self.about: dict[str, Any] = {}
        """What a worker tells of itself, once one has started."""

    @property
    def ready(self) -> bool:
        """Return whether a worker is up and warm."""
        return any(worker.up for worker in self._workers)

    def start(self) -> None:
        """Start the workers; they come up while the service answers already."""
        for _ in range(self._count):
            self._replace()

    async def stop(self) -> None:
        """End every worker, those that compute among them."""
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
        gone: Callable[[], Awaitable[bool]] = _never,
    ) -> bytes:
        """Return the result of a task, within a limit of seconds of computing. Raises Refusal.

        note: told how it goes; started: called when a worker has been found; gone: whether nobody asks any longer.
        Then, and where this is cancelled, the worker that computes is killed.
        """
        worker = await self._free(gone)
        started()
        loop = asyncio.get_running_loop()

        def noted(content: Any) -> None:
            loop.call_soon_threadsafe(note, content)

        answer = loop.run_in_executor(self._threads, worker.run, task, request, seconds, noted)
        watch = asyncio.create_task(_end_if(gone, worker, answer))
        try:
            return await answer
        except asyncio.CancelledError:
            worker.kill()
            raise
        finally:
            watch.cancel()
            self._release(worker)

    async def _free(self, gone: Callable[[], Awaitable[bool]]) -> Worker:
        while self._idle:
            if (worker := self._idle.pop()).up:
                return worker
            self._replace(worker)  # it died while it was idle
        if len(self._line) >= self._queue:
            text = f"{self._count} computing, {len(self._line)} waiting; come again"
            raise Refusal("busy", text, headers={"Retry-After": "1"})
        turn: asyncio.Future[Worker] = asyncio.get_running_loop().create_future()
        self._line.append(turn)
        try:
            worker = await asyncio.shield(turn)
            left = await gone()
        except BaseException:
            self._leave(turn)
            raise
        if left:
            self._release(worker)
            raise Refusal("busy", "nobody waits for the answer any longer")
        return worker

    def _leave(self, turn: asyncio.Future[Worker]) -> None:
        """Give up a place in the line, or the worker that came with the turn."""
        if turn.done():
            self._release(turn.result())
        else:
            self._line.remove(turn)

    def _release(self, worker: Worker) -> None:
        """Hand a worker to the task that has waited longest."""
        if not worker.up:
            self._replace(worker)
        elif self._line:
            self._line.popleft().set_result(worker)
        else:
            self._idle.append(worker)

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
            self._release(worker)
            return
