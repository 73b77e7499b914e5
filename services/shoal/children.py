"""Worker processes that end when their parent ends, even if it is killed; they would wait for work for ever."""

from __future__ import annotations

import os
from multiprocessing import parent_process
from threading import Thread


def end_with_parent() -> None:
    """Initialise a worker process: from now on it ends when the process that started it has ended."""
    Thread(target=_wait_for_end, daemon=True).start()


def _wait_for_end() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
