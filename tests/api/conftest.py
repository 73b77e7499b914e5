"""Two services: one with the native engine, one whose engine does as it is told."""

from __future__ import annotations

from collections.abc import Iterator

import engines_for_tests
import httpx
import pytest
from one_body import pendulum
from running import serving
from shoal.api.settings import Settings


@pytest.fixture(scope="session")
def gauss() -> Iterator[httpx.Client]:
    """A client of the native engine's service."""
    with serving("gauss", Settings(workers=1)) as url, httpx.Client(base_url=url, timeout=300) as client:
        yield client


@pytest.fixture(scope="session")
def obedient() -> Iterator[httpx.Client]:
    """A client of a service with one worker, one place in the queue and little patience."""
    settings = Settings(
        workers=1, queue=1, job_queue=1, wall_seconds=4.0, job_seconds=900.0, body_bytes=2**20, max_memory_mb=2048
    )
    with (
        serving(engines_for_tests.NAME, settings, engines_for_tests.obedient) as url,
        httpx.Client(base_url=url, timeout=300) as client,
    ):
        yield client


@pytest.fixture(scope="session")
def machine() -> dict[str, object]:
    """An inline scene: one rigid body."""
    return pendulum(inertia=0.1, centre=0.5)


@pytest.fixture(scope="session")
def problem(machine: dict[str, object]) -> dict[str, object]:
    """An inline problem: the start of the body from the recorded path of its end."""
    return {
        "name": "start",
        "scene": machine,
        "parameters": {"theta": {"path": "initial.OA.angle", "lower": -1.0, "upper": 1.0}},
        "channels": [{"marker": "A", "quantity": axis, "column": axis} for axis in ("x", "y")],
        "source": {"kind": "file"},
        "method": "least-squares",
    }
