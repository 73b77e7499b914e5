"""The time that a computation may take is that of its computing, and not measured by the clock on the wall."""

from __future__ import annotations

import itertools
import time
from typing import Any

import httpx
import pytest


def test_limits_do_not_follow_the_wall(
    obedient: httpx.Client, machine: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """With a clock that jumps by days whenever somebody looks: a call in time ends well, one that hangs is ended."""
    now, jumps = time.time(), itertools.cycle((2e5, -2e5))
    monkeypatch.setattr(time, "time", lambda: now + next(jumps))
    ask = {"at": [0.1]}
    assert obedient.post("/v1/simulate", json={"scene": machine | {"name": "short"}, **ask}).status_code == 200
    begin = time.monotonic()
    assert obedient.post("/v1/simulate", json={"scene": machine | {"name": "hang"}, **ask}).status_code == 504
    assert time.monotonic() - begin > 3.9


def test_compiling_does_not_count(obedient: httpx.Client, machine: dict[str, Any]) -> None:
    """Else the first call of a kind on a slow machine would be ended, the second too, and so on."""
    asked = {"scene": machine | {"name": "compile"}, "at": [0.1]}
    assert obedient.post("/v1/simulate", json=asked).status_code == 200
