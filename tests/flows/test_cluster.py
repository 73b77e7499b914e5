"""The same computations on a cluster: the same answers, and a killed worker costs time only."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from threading import Event
from typing import Any

import numpy as np
import pytest
from deployed import free_port, of_home
from shoal.engines.sweep import joined, pieces
from shoal.errors import ComputationError, InputError
from shoal.requests.sweep import Sweep
from shoal_flows import cluster, jobs, workers

SCENE = "flexible-double-pendulum"
VARY = {"initial.OA.angle": np.linspace(0.0, 1.5, 32), "initial.AB.angle": np.linspace(0.0, 1.5, 16)}


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> Iterator[pytest.MonkeyPatch]:
    cluster.client.cache_clear()
    yield monkeypatch
    cluster.client.cache_clear()


@pytest.mark.slow
def test_a_killed_worker_loses_nothing(asked: pytest.MonkeyPatch) -> None:
    asked.setenv("SHOAL_CLUSTER", "local:2")
    client = cluster.client()
    client.wait_for_workers(2)
    assert workers.count() == 2
    grids = pieces(VARY, 4)
    pending = [workers.submit(jobs.swept, Sweep(SCENE, grid, 0.2)) for grid in grids]
    victim = next(iter(client.run(os.getpid).values()))
    time.sleep(0.5)
    os.kill(victim, signal.SIGKILL)
    found = joined([part.result() for part in pending])
    here = joined([jobs.swept(Sweep(SCENE, grid, 0.2)) for grid in grids])
    assert found.ok
    assert np.array_equal(found.displacements["B"], here.displacements["B"])
    assert victim not in client.run(os.getpid).values()
    client.cluster.close()
    client.close()


def test_what_a_cluster_has_is_cancelled(asked: pytest.MonkeyPatch) -> None:
    """Whoever waits is released, and nothing begins any more: what SIGTERM leads to."""

    class Waiting:
        """A future that is done once it is cancelled."""

        def __init__(self) -> None:
            self.cancelled = False

        def done(self) -> bool:
            return self.cancelled

    class Client:
        def submit(self, *_: object, **__: object) -> Waiting:
            return Waiting()

        def cancel(self, futures: list[Waiting], force: bool) -> None:
            for one in futures:
                one.cancelled = force

    asked.setenv("SHOAL_CLUSTER", "tcp://127.0.0.1:1")
    made = Client()
    asked.setattr(cluster, "client", cache(lambda: made))
    asked.setattr(workers, "_abandoned", Event())
    pending: Any = [workers.submit(abs, -1) for _ in range(3)]
    workers.abandon()
    assert all(one.cancelled for one in pending)
    with pytest.raises(ComputationError, match="stopped before"):
        workers.submit(abs, -1)
    workers.warm_up()
    assert not workers.submit(abs, -1).done()  # type: ignore[attr-defined]


@pytest.mark.slow
def test_sigterm_ends_a_study_on_a_cluster(tmp_path: Path) -> None:
    """Of many optimisations that take minutes: one line, and all processes are gone."""
    settings = {"SHOAL_CLUSTER": "local:1", "SHOAL_HOME": str(tmp_path)}
    command = [sys.executable, "-c", "from shoal.cli import main; main()", "run", "identify"]
    command += ["--param", "methods=[iafsa]", "--param", f"seeds={[*range(100)]}"]
    with subprocess.Popen(command, env=os.environ | settings, stderr=subprocess.PIPE, text=True) as study:
        assert study.stderr is not None
        assert any(line.startswith("done: data") for line in study.stderr)
        time.sleep(5)
        study.terminate()
        rest = study.stderr.read()
    assert study.returncode == 130
    assert rest.endswith("shoal: stopped\n")
    assert rest.count("done: ") < 50
    deadline = time.monotonic() + 60
    while left := of_home(tmp_path):
        assert time.monotonic() < deadline, left
        time.sleep(0.1)


@pytest.mark.parametrize("wanted", ["local:0", "local:many"])
def test_a_cluster_that_is_none_is_refused_in_one_line(asked: pytest.MonkeyPatch, wanted: str) -> None:
    asked.setenv("SHOAL_CLUSTER", wanted)
    with pytest.raises(InputError, match="SHOAL_CLUSTER: 'local"):
        workers.count()


def test_a_scheduler_that_does_not_answer_is_told(asked: pytest.MonkeyPatch) -> None:
    asked.setenv("SHOAL_CLUSTER", f"tcp://127.0.0.1:{free_port()}")
    asked.setattr(cluster, "PATIENCE", 0.5)
    with pytest.raises(ComputationError, match="SHOAL_CLUSTER: no scheduler at tcp://"):
        workers.count()
