"""No time limit counts what compiling takes, in whichever thread."""

from __future__ import annotations

import threading
import time
from concurrent.futures import ThreadPoolExecutor

import pytest
from numba import njit
from shoal.compile import clock, locks
from shoal.identification.deadline import Deadline
from shoal.mechanics import warm


@pytest.fixture
def at(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The time, as one number that a test moves."""
    moment = [100.0]
    monkeypatch.setattr(time, "monotonic", lambda: moment[0])
    return moment


def test_it_stands_still_until_the_last_has_ended(at: list[float]) -> None:
    begin, heard = clock.now(), list[bool]()
    with clock.heard(heard.append):
        with clock.stopped():
            at[0] += 5.0
            with clock.stopped():
                at[0] += 7.0
            at[0] += 1.0
            assert clock.now() == begin
        at[0] += 2.0
    assert clock.now() == pytest.approx(begin + 2.0, abs=1e-9)
    assert heard == [True, False]


def test_threads_that_compile_at_once_stop_it_once(at: list[float]) -> None:
    begin, inside, leave = clock.now(), threading.Barrier(3), threading.Event()

    def compiles() -> None:
        with clock.stopped():
            inside.wait(30)
            leave.wait(30)

    threads = [threading.Thread(target=compiles) for _ in range(2)]
    for thread in threads:
        thread.start()
    inside.wait(30)
    at[0] += 4.0
    leave.set()
    for thread in threads:
        thread.join()
    at[0] += 1.0
    assert clock.now() == pytest.approx(begin + 1.0, abs=1e-9)


def test_a_deadline_does_not_count_it(at: list[float]) -> None:
    deadline = Deadline(10.0)
    with clock.stopped():
        at[0] += 60.0
    at[0] += 3.0
    assert deadline.remaining == pytest.approx(7.0, abs=1e-9)


def test_numba_stops_it() -> None:
    @njit
    def doubled(x: float) -> float:
        return 2.0 * x

    locks.install()
    heard = list[bool]()
    with clock.heard(heard.append):
        assert doubled(2.0) == 4.0
        assert doubled(3.0) == 6.0
    assert heard == [True, False]


def test_it_stands_still_while_other_processes_compile(at: list[float], monkeypatch: pytest.MonkeyPatch) -> None:
    """What a command says a search took is not the minute in which its kernels were compiled."""

    class Pool(ThreadPoolExecutor):
        def __init__(self, workers: int, *_: object) -> None:
            super().__init__(workers)

    def compiles(kernel: warm.KernelSignature) -> str:
        at[0] += 40.0
        return kernel.name

    monkeypatch.setattr(warm, "ProcessPoolExecutor", Pool)
    monkeypatch.setattr(warm, "_compile", compiles)
    monkeypatch.setattr(warm.KernelSignature, "cached", False)
    begin, said = clock.now(), list[str]()
    warm.ahead([warm.KernelSignature("shoal.mechanics.march", "loop", ())], said.append)
    assert clock.now() == begin
    assert "loop (1 of 1" in said[1]
