"""What ends by itself is started again, as long as that helps."""

from __future__ import annotations

import io
from dataclasses import dataclass

import pytest
from rich.console import Console
from shoal.errors import ComputationError
from shoal_flows.deployment import parts, processes
from shoal_flows.deployment.parts import TRIES, look_after


@dataclass
class Made:
    """A part that dies as often as stated.

    says: for each start, whether it becomes ready, and after how many looks; then the test is over
    """

    name: str
    says: list[tuple[bool, int]]
    needs: tuple[str, ...] = ()
    alive: bool = False
    looks: int = 0
    starts: int = 0

    def begin(self) -> None:
        self.starts += 1
        if not self.says:
            raise KeyboardInterrupt
        self.alive, self.looks = self.says.pop(0)
        if not self.alive and not self.looks:
            raise ComputationError(f"{self.name} cannot be started")

    def is_ready(self) -> bool:
        self.looks -= 1
        ready = self.looks <= 0
        if ready:
            self.alive = False  # it dies at once
        return ready

    def ended(self) -> bool:
        return not self.alive


YES, NO = (True, 1), (False, 0)


@pytest.fixture(autouse=True)
def at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parts, "PAUSE", 0.0)


def printed(*made: Made) -> tuple[type[BaseException], list[str]]:
    """How looking after parts ends, and the lines that it prints."""
    out = io.StringIO()
    with pytest.raises((ComputationError, KeyboardInterrupt)) as end:
        look_after(made, Console(file=out))
    return end.type, out.getvalue().splitlines()


@pytest.mark.parametrize("how", [NO, (False, 1)])
def test_a_part_that_does_not_start_any_more_ends_all(how: tuple[bool, int]) -> None:
    end, lines = printed(Made("prefect", [how] * 10))
    assert end is ComputationError
    assert lines == ["prefect ended by itself: it is started again"] * TRIES


def test_failures_before_a_success_are_forgotten() -> None:
    """A server whose database comes back late is given time, each time again."""
    prefect = Made("prefect", [*[NO] * (TRIES - 1), YES] * 3)
    assert printed(prefect)[0] is KeyboardInterrupt
    assert prefect.starts == 3 * TRIES + 1


def test_what_ended_together_is_started_together_and_after_what_it_needs() -> None:
    """Two servers that take long are started without waiting for each other; the worker waits for both."""
    slow = (True, 5)
    worker = Made("worker", [YES], needs=("prefect", "mlflow"))
    _, lines = printed(Made("mlflow", [slow]), Made("prefect", [slow]), Made("gauss", [slow]), worker)
    begun = [f"{name} ended by itself: it is started again" for name in ("mlflow", "prefect", "gauss", "worker")]
    ready = [f"{name} is ready" for name in ("mlflow", "prefect", "gauss")]
    assert lines[:7] == [*begun[:3], *ready, begun[3]]


def test_what_is_never_ready_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parts, "PATIENCE", 0.0)
    end, lines = printed(Made("prefect", [(True, 10**9)] * 10))
    assert end is ComputationError
    assert len(lines) == TRIES


def test_the_needs_name_what_is_there() -> None:
    """In the order in which everything is started."""
    order = ["postgres", *(name for stage in processes.STAGES for name in stage)]
    for name, needed in processes.NEEDS.items():
        assert all(order.index(one) < order.index(name) for one in needed)
