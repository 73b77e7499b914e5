"""Prefect's server dies in the middle of a study: the study goes on to its end, and to the same figures."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import psutil
import pytest
from shoal.errors import ComputationError
from shoal_flows import events, remembered, run

STUDY = {"problem": "paper-case-1", "methods": ["least-squares"], "seeds": [0, 1]}
FIRST = "paper-case-1, least-squares · seed 0"


@pytest.fixture
def nothing_kept() -> Iterator[None]:
    with remembered.recomputed():
        yield


@contextmanager
def struck(when: str, blow: Callable[[], None]) -> Iterator[list[str]]:
    """Something happens while this work starts; gives what is told from then on."""
    told: list[str] = []

    def listen(name: str, what: str) -> None:
        if not told and (name, what) == (when, "started"):
            blow()
            told.append("struck")
        elif told:
            told.append(f"{what}: {name}")

    with events.listening(listen):
        yield told


def own_server() -> psutil.Process:
    """The server that this process has started."""
    (found,) = (child for child in psutil.Process().children() if "shoal_flows.prefect_server" in child.cmdline())
    return found


def kill() -> None:
    own_server().kill()


def figures(study: Any) -> list[Any]:
    return [(fit.cell, fit.estimate.fitness, fit.estimate.parameters, fit.motion.points.tolist()) for fit in study.fits]


@pytest.mark.usefixtures("nothing_kept")
@pytest.mark.slow
def test_a_study_outlives_its_server() -> None:
    """kill -9: another takes its place, and knows of the whole study; the figures are those of an undisturbed one."""
    undisturbed = run.run_flow("identify", STUDY)
    before = own_server()
    with struck(FIRST, kill) as told:
        found = run.run_flow("identify", STUDY)
    assert figures(found) == figures(undisturbed)
    assert not found.failures
    assert "done: Prefect's server, which ended with signal 9, started again" in told
    assert own_server() != before


@pytest.mark.slow
@pytest.mark.usefixtures("nothing_kept")
def test_a_server_that_stays_away_is_told_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """What was computed is kept; the same study, asked for again, computes the rest."""
    undisturbed = run.run_flow("identify", STUDY)
    monkeypatch.setattr(sys, "executable", "/bin/false")  # what another one would be started with
    monkeypatch.setenv("PREFECT_CLIENT_MAX_RETRIES", "1")
    with struck(FIRST, kill), pytest.raises(ComputationError, match="the same command goes on from there") as end:
        run.run_flow("identify", STUDY)
    assert "\n" not in str(end.value)
    monkeypatch.undo()
    assert figures(run.run_flow("identify", STUDY)) == figures(undisturbed)


@pytest.mark.slow
def test_a_server_that_is_not_there_is_told_in_one_line() -> None:
    command = [sys.executable, "-c", "from shoal.cli import main; main()", "run", "identify"]
    environment = {**os.environ, "PREFECT_API_URL": "http://127.0.0.1:9/api"}
    ended = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stdout) == (3, "")
    told = "shoal: PREFECT_API_URL: no server answers at http://127.0.0.1:9/api; unset it for a server of its own"
    assert ended.stderr.splitlines()[-1] == told
