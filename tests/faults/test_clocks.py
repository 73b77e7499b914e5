"""The clock on the wall may jump: only stamps for people are taken from it, no limit and no expiry."""

from __future__ import annotations

import ast
import asyncio
import time
from pathlib import Path
from typing import Any

import pytest
import shoal
import shoal_flows
from shoal.api.jobs import Jobs
from shoal.api.operations import Identify
from shoal.api.refusal import Refusal
from shoal.api.settings import Settings

STAMPS = {
    shoal_flows: {"tracking/record.py": 1, "report/morning.py": 1},
    shoal: {"api/access.py": 1, "api/connection.py": 1, "doctor.py": 1},
}
"""When an entry of MLflow or a morning page was made; when a request came or was refused; when the next night comes."""
WALL = {("time", "time"), ("time", "time_ns"), ("datetime", "now"), ("datetime", "utcnow"), ("date", "today")}


def wall_clocks(file: Path) -> int:
    """How often a file looks at the clock on the wall."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    names = {n.name for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) for n in node.names}
    assert not {"time_ns"} & names
    assert not any(isinstance(n, ast.ImportFrom) and n.module == "time" for n in ast.walk(tree)), file
    pairs = [
        (n.value.id if isinstance(n.value, ast.Name) else getattr(n.value, "attr", ""), n.attr)
        for n in ast.walk(tree)
        if isinstance(n, ast.Attribute)
    ]
    return sum(pair in WALL for pair in pairs)


@pytest.mark.by_day(1)
@pytest.mark.parametrize("package", [shoal, shoal_flows])
def test_only_stamps_are_taken_from_the_wall(package: Any) -> None:
    root = Path(package.__path__[0])
    found = {file.relative_to(root).as_posix(): wall_clocks(file) for file in root.rglob("*.py")}
    assert {name: count for name, count in found.items() if count} == STAMPS[package]
    assert len(found) > 20


class Instant:
    """A pool whose tasks end at once."""

    async def run(self, task: str, request: Any, seconds: float, note: Any, started: Any) -> bytes:
        started()
        return b"{}"


def test_a_result_is_kept_over_a_jump(monkeypatch: pytest.MonkeyPatch) -> None:
    """A year forth and a year back; forgotten is what is old by the clock that does not jump."""

    async def kept() -> list[bool]:
        jobs = Jobs(Instant(), Settings(keep_seconds=3600.0))  # type: ignore[arg-type]
        name = jobs.submit("identify", Identify(problem="paper-case-1")).id
        await asyncio.sleep(0.01)
        found, now, steady = [], time.time(), time.monotonic()
        for jump in (3.2e7, -3.2e7):
            monkeypatch.setattr(time, "time", lambda jump=jump: now + jump)
            found.append(jobs.get(name).state == "done")
        monkeypatch.setattr("shoal.api.jobs.time.monotonic", lambda: steady + 3700.0)
        with pytest.raises(Refusal, match="there is no such job"):
            jobs.get(name)
        return found

    assert asyncio.run(kept()) == [True, True]
