"""Ctrl-C is heard inside a run of the compiled time loop, which would go on for hours here, in any thread."""

from __future__ import annotations

import signal
import subprocess
import sys

import numpy as np
import pytest
from shoal.mechanics.simulate import simulate
from shoal.scene import load_scene

HEARD = 120
"""A process that has not ended by then [s] has not heard, however slow the machine is."""

BEGIN = """
import os, signal, threading
def soon():  # once the loop runs
    threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()
"""
SCENE = f"""{BEGIN}
import numpy as np
from shoal.mechanics.simulate import simulate
from shoal.scene import load_scene
scene = load_scene("flexible-double-pendulum").with_values({{"solver.integrator": "leapfrog", "solver.step": 5e-4}})
def run(end, lanes=0):
    values = {{"initial.OA.angle": np.linspace(0.1, 0.2, lanes)}} if lanes else None
    simulate(scene, np.array([end]), values, threads=2)
"""
MAIN = "run(1.0); soon(); run(1e6)"
TILES = "run(1.0, 16); soon(); run(1e6, 16)"
THREAD = "run(1.0); soon(); other = threading.Thread(target=run, args=(1e6,)); other.start(); other.join()"
OWN_HANDLER = """
def hear(*signalled):
    signal.signal(signal.SIGINT, signal.default_int_handler)
    print("heard", flush=True)
    soon()
signal.signal(signal.SIGINT, hear)
run(1.0); soon(); run(1e6)
"""
COMMAND = f"""{BEGIN}
from shoal.cli import main
from shoal.mechanics import march
compiled = march._call
def call(*arguments):
    march._call = compiled
    soon()
    compiled(*arguments)
march._call = call
main(["simulate", "rigid-double-pendulum", "--set", "solver.duration=1e6", "--set", "solver.max_steps=1000000000"])
"""


@pytest.fixture(autouse=True, scope="module")
def _compiled() -> None:
    """The kernels, for which no process should wait."""
    scene = load_scene("flexible-double-pendulum").with_values({"solver.integrator": "leapfrog"})
    simulate(scene, np.array([0.01]))
    simulate(scene, np.array([0.01]), {"initial.OA.angle": np.linspace(0.1, 0.2, 16)})
    simulate(load_scene("rigid-double-pendulum"), np.array([0.01]))


def ended(script: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=HEARD, check=False)


@pytest.mark.parametrize("how", [MAIN, TILES, THREAD], ids=["main", "tiles", "thread"])
@pytest.mark.by_day(1)
def test_a_run_is_interrupted(how: str) -> None:
    """One compiled call held the main thread until its end, and threads of tiles were waited for."""
    process = ended(SCENE + how)
    assert "KeyboardInterrupt" in process.stderr
    assert process.returncode == -signal.SIGINT


@pytest.mark.slow
def test_a_handler_of_the_users_own_decides() -> None:
    """It returns, so the run goes on, until the next signal is left to Python's own."""
    process = ended(SCENE + OWN_HANDLER)
    assert process.stdout == "heard\n"
    assert process.returncode == -signal.SIGINT


@pytest.mark.slow
def test_the_command_ends_with_the_status_of_an_interrupt() -> None:
    process = ended(COMMAND)
    assert "shoal: stopped" in process.stderr
    assert process.returncode == 130
