"""Medians of repeated runs."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import Any, TypeVar

T = TypeVar("T")


def undisturbed(call: Callable[[], T]) -> tuple[float, T]:
    """Time of a call [s], less what it waited for others on the machine: never more than its processor time."""
    begin, busy = time.perf_counter(), time.process_time()
    answer = call()
    return min(time.perf_counter() - begin, time.process_time() - busy), answer


def median_time(run: Callable[[], Any], repeats: int) -> float:
    """Median wall-clock time of a call [s], after one call that does not count."""
    run()
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        run()
        times.append(time.perf_counter() - begin)
    return statistics.median(times)
