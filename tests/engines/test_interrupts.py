"""Ctrl-C ends a run of an engine whose library would make it a failed one, and what runs after it."""

from __future__ import annotations

import os
import signal
import threading

import pytest
from shoal.engines import get_engine
from shoal.engines.interrupts import interruptible
from shoal.scene import load_scene


def call_library(*, swallows: bool) -> None:
    try:
        signal.raise_signal(signal.SIGINT)
    except KeyboardInterrupt:
        if not swallows:
            raise RuntimeError("PostStepUserFunction failed") from None


@pytest.mark.parametrize("swallows", [True, False])
def test_what_a_library_makes_of_it_does_not_count(swallows: bool) -> None:
    usual = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt), interruptible():
        call_library(swallows=swallows)
    assert signal.getsignal(signal.SIGINT) is usual


def test_other_failures_stay_what_they_are() -> None:
    with pytest.raises(RuntimeError, match="gave up"), interruptible():
        raise RuntimeError("the solver gave up")


def test_other_threads_hear_nothing() -> None:
    found = list[object]()

    def inside() -> None:
        with interruptible():
            found.append(signal.getsignal(signal.SIGINT))

    usual = signal.getsignal(signal.SIGINT)
    thread = threading.Thread(target=inside)
    thread.start()
    thread.join()
    assert found == [usual]


@pytest.mark.parametrize("engine", ["exudyn", "casadi"])
def test_an_engine_is_interrupted(engine: str) -> None:
    """After ten minutes of motion, which take far longer than the moment until the signal, it would be too late."""
    scene = load_scene("flexible-double-pendulum").with_values({"solver.duration": 600.0})
    get_engine(engine).simulate(scene, [scene.solver.step])
    timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            get_engine(engine).simulate(scene, [600.0])
    finally:
        timer.cancel()
