"""Processes that are forked off one that has simulated, as those of the services and flows are."""

from __future__ import annotations

import subprocess
import sys

PROGRAM = """
import os, sys
import numpy as np
import shoal

def tips():
    grid = {"initial.OA.angle": np.linspace(0.1, 0.4, 64)}
    return shoal.sweep("single-pendulum", grid, 0.1, verify=False).positions["A"]

before = tips()
child = os.fork()
if child == 0:
    os._exit(0 if np.array_equal(tips(), before) else 1)
sys.exit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""


def test_a_forked_process_simulates_many_at_once() -> None:
    """Its parent's threads are not there; it begins its own instead of waiting for them."""
    assert subprocess.run([sys.executable, "-c", PROGRAM], timeout=300, check=False).returncode == 0
