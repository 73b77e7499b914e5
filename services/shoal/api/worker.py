"""The service's hold on a process that computes one task at a time.

Engines are other people's compiled code: they may crash or never return. Then one task ends and its process with it.
"""

from __future__ import annotations

import multiprocessing as mp
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from multiprocessing.context import ForkServerProcess
from multiprocessing.util import get_temp_dir
from tempfile import TemporaryDirectory
from typing import Any

from shoal.api import entry
from shoal.api.refusal import Refusal
from shoal.api.settings import Settings
from shoal.engines.contract import Engine

MakeEngine = Callable[[], Engine]
Note = Callable[[Any], None]
"""Told how a computation goes."""
START_SECONDS = 1800.0
"""Kernels that are not compiled yet take minutes."""


def _folder() -> TemporaryDirectory[str]:
    """In that of this process's other temporary files, which a worker removes if the service is killed."""
    return TemporaryDirectory(prefix="shoal-worker-", dir=get_temp_dir(), ignore_cleanup_errors=True)


@dataclass(eq=False)
class Worker:
    """The service's end of one process. `start` and `run` block; they belong into a thread."""

    make_engine: MakeEngine
    settings: Settings
    about: dict[str, Any] = field(default_factory=dict, init=False)
    """What the process tells of itself once it has started; see `process.about`."""
    _process: ForkServerProcess | None = field(default=None, init=False)
    _folder: TemporaryDirectory[str] = field(default_factory=_folder, init=False)

    @property
    def up(self) -> bool:
        """Return whether the process is there, with warm kernels."""
        return bool(self.about) and self._process is not None and self._process.is_alive()

    def start(self) -> None:
        """Start the process and wait until its kernels are warm. Raises Refusal."""
        context = mp.get_context("forkserver")
        context.set_forkserver_preload(["shoal.api.process"])
        self._pipe, theirs = context.Pipe()
        arguments = (theirs, self.make_engine, self.settings, self._folder.name)
        self._process = context.Process(target=entry.main, args=arguments, daemon=True, name="shoal-worker")
        self._process.start()
        theirs.close()
        self.about = self._answer(START_SECONDS, lambda _: None)

    def run(self, task: str, request: Any, seconds: float, note: Note) -> bytes:
        """Compute one of process.TASKS within a time [s] that does not count the compilation of kernels.

        Raises Refusal; where the process did not survive, the worker is not up.
        """
        try:
            self._pipe.send((task, request))
        except OSError:
            raise self._died() from None
        return bytes(self._answer(seconds, note))

    def _answer(self, seconds: float, note: Note) -> Any:
        left, stands = seconds, False
        while True:
            begin = time.monotonic()
            try:
                if not self._pipe.poll(START_SECONDS if stands else left):
                    self.kill()
                    raise Refusal("timeout", f"ended after {seconds:g} s, which is all it may take")
                kind, content = self._pipe.recv()
            except (EOFError, OSError):
                raise self._died() from None
            if not stands:
                left = max(0.0, left - (time.monotonic() - begin))
            if kind == "clock":
                stands = content
            elif kind == "note":
                note(content)
            elif kind == "done":
                return content
            else:
                raise Refusal(kind, content)

    def _died(self) -> Refusal:
        self.kill()
        code = None if self._process is None else self._process.exitcode
        return Refusal("crashed", f"the worker died (exit code {code}); a fresh one replaces it")

    def kill(self) -> None:
        """Kill the process."""
        if self._process is not None and self._process.pid is not None:
            self._process.kill()
            self._process.join()
        self._folder.cleanup()
