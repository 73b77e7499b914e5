"""What ends by itself is started again, as long as that helps."""

from __future__ import annotations

import io
from dataclasses import dataclass

import pytest
from rich.console import Console
from shoal.errors import ComputationError
from shoal_flows.deployment.parts import TRIES, look_after


@dataclass
class Made:
    """A part that dies when it is told; says: for each start, whether it succeeds, then that nobody looks any more."""

    name: str
    says: list[bool]
    alive: bool = False
    starts: int = 0

    def start(self) -> None:
        self.starts += 1
        if not self.says:
            raise KeyboardInterrupt
        self.alive = self.says.pop(0)
        if not self.alive:
            raise ComputationError(f"{self.name} did not start")

    def ended(self) -> bool:
        dead, self.alive = not self.alive, False
        return dead


def told(*parts: Made) -> tuple[type[BaseException], str]:
    out = io.StringIO()
    with pytest.raises((ComputationError, KeyboardInterrupt)) as end:
        look_after(parts, Console(file=out))
    return end.type, out.getvalue()


def test_a_part_that_does_not_start_any_more_ends_all() -> None:
    end, text = told(Made("prefect", [False] * TRIES))
    assert end is ComputationError
    assert text.count("prefect ended by itself: it is started again") == TRIES


def test_failures_before_a_success_are_forgotten() -> None:
    """A server whose database comes back late is given time, each time anew."""
    prefect = Made("prefect", [*[False] * (TRIES - 1), True] * 3)
    assert told(prefect)[0] is KeyboardInterrupt
    assert prefect.starts == 3 * TRIES + 1


def test_what_others_need_comes_first() -> None:
    _, text = told(Made("postgres", [True]), Made("prefect", [False, True]))
    assert [line.split()[0] for line in text.splitlines()][:3] == ["postgres", "prefect", "prefect"]
