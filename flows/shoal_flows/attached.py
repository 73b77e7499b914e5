"""Run a module as a program that ends with the process that started it: `python -m shoal_flows.attached MODULE ARGS`.

Standard input is a pipe from that process; it closes however the process ends, even by a signal that
leaves no time to stop anything.
"""

from __future__ import annotations

import os
import runpy
import signal
import sys
from threading import Thread


def _end_with_input() -> None:
    while os.read(0, 1024):
        pass
    os.kill(os.getpid(), signal.SIGTERM)


if __name__ == "__main__":
    Thread(target=_end_with_input, daemon=True).start()
    sys.argv = sys.argv[1:]
    runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
