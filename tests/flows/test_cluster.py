"""The same computations on a cluster: the same answers, and a killed worker costs time only."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator

import numpy as np
import pytest
from deployed import free_port
from shoal.engines.pieces import joined, pieces
from shoal.errors import ComputationError, InputError
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
    pending = [workers.submit(jobs.swept, SCENE, grid, "gauss", 0.2) for grid in grids]
    victim = next(iter(client.run(os.getpid).values()))
    time.sleep(0.5)
    os.kill(victim, signal.SIGKILL)
    found = joined([part.result() for part in pending])
    here = joined([jobs.swept(SCENE, grid, "gauss", 0.2) for grid in grids])
    assert found.ok
    assert np.array_equal(found.displacements["B"], here.displacements["B"])
    assert victim not in client.run(os.getpid).values()
    client.cluster.close()
    client.close()


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
